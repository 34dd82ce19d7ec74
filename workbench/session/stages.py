"""Errors stage by stage: the nominal arm, its geometry identified, its causes added."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from workbench.identification.errors.row_errors import AbstractValidation
from workbench.identification.result import Identification
from workbench.report.numbers import compared
from workbench.session.comparison import STAGES, Comparison, ModelStage
from workbench.session.state import Session

NORM_OF_NOISE = float(np.sqrt(8.0 / np.pi))
"""Mean length of a position error of three normal components of unit deviation."""


@dataclass(frozen=True, eq=False)
class StageErrors:
    """Errors up to one stage of the model on held-out rows; on the fitted ones where none were held out.

    Args:
        title: The stage.
        words: What the model has by then, for people.
        error: Mean position error [mm].
        turned: Mean orientation error [°]; None if none were measured.
        rows: Position errors row by row [m].
    """

    title: ModelStage
    words: str
    error: float
    turned: float | None
    rows: Float[np.ndarray, " rows"]


def stages(session: Session) -> tuple[StageErrors, ...]:
    """Errors of the nominal arm, with its geometry, with what was found: what there is, on the same rows."""
    results, words = session.results, stage_words(session)
    if (found := results.identification) is None:
        return ()
    known: list[AbstractValidation | None] = [found.nominal, found.runs[results.fit]]
    if results.accepted:
        known.insert(1, results.geometry or (results.diagnosis and results.diagnosis.before))
    out = []
    for stage, errors in ((s, e) for s, e in zip(STAGES, known, strict=False) if e is not None):
        mean, turned, rows = errors.judged, errors.judged.orientation_deg, errors.judged.position
        out.append(StageErrors(stage, words[stage], mean.position_mm.mean, turned and turned.mean, rows))
    return tuple(out)


def stage_words(session: Session) -> dict[ModelStage, str]:
    """What the model has by each stage, for people; what only predicts is said to be learned."""
    found, words = session.results.diagnosis, {stage: str(stage) for stage in STAGES}
    if found is not None and found.residual_map is not None:
        words[ModelStage.EFFECTS] = f"{'effects and ' if found.causes else ''}learned correction"
    return words


def expected_elsewhere(session: Session) -> float:
    """Position error to expect far from the measured poses [mm]; NaN where it is no larger than at them."""
    found = session.results.identification
    if found is None or not found.transfer_warning():
        return float("nan")
    expected = 1e3 * found.best.transfer.anywhere.position
    return expected if expected > stages(session)[-1].error else float("nan")


def shown_stage(session: Session, rows: Comparison) -> ModelStage:
    """The stage whose errors are shown: the last known one up to the chosen one, or to the model as it is."""
    now = ModelStage.EFFECTS if session.results.accepted else ModelStage.GEOMETRY
    up_to = STAGES.index(session.choices.overlay.stage or now)
    return next((s for s in reversed(rows.stages) if STAGES.index(s) <= up_to), ModelStage.NOMINAL)


def before_and_after(session: Session) -> str:
    """Errors of the nominal arm and of the calibrated one as it stands: `Mean error 0.739 → 0.072 mm`."""
    first, *_, last = stages(session)
    return f"Mean error {compared(first.error)} → {compared(last.error)} mm"


def noise_length(found: Identification) -> float:
    """Mean length of the instrument's position errors [mm]; NaN where its noise is unknown."""
    known = found.instrument
    return 1e3 * NORM_OF_NOISE * known.position if known is not None else float("nan")


def share_of_noise(session: Session, found: Identification) -> float:
    """How many times the instrument's noise is left on average; NaN where that is unknown."""
    left, noise = found.runs[session.results.fit].judged.position_mm.mean, noise_length(found)
    return left / noise if noise > 0.0 else float("nan")
