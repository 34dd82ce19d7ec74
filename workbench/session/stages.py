"""Errors stage by stage: the nominal arm, its geometry identified, its causes added."""

from dataclasses import dataclass

import numpy as np

from workbench.base.wording import first_of
from workbench.identification.errors.row_errors import AbstractValidation, Errors
from workbench.identification.result import Identification
from workbench.report.numbers import compared
from workbench.session.comparison import STAGES, Comparison, ModelStage
from workbench.session.state import Session

MAX_NAMED = 3
NORM_OF_NOISE = float(np.sqrt(8.0 / np.pi))
"""Mean length of a position error of three normal components of unit deviation."""


@dataclass(frozen=True, eq=False)
class StageErrors:
    """Errors up to one stage of the model on held-out rows; on the fitted ones where none were held out.

    Args:
        title: The stage.
        words: What the model has by then, for people.
    """

    title: ModelStage
    words: str
    errors: Errors

    @property
    def error(self) -> float:
        """Mean position error [mm]."""
        return self.errors.position_mm.mean


def suspects(session: Session) -> list[int]:
    """Numbers of the held-out rows that no arm explains."""
    found, diagnosis = session.results.identification, session.results.diagnosis
    rows = [] if diagnosis is None else diagnosis.held_out_data.row[diagnosis.suspects].tolist()
    return sorted({*rows, *(() if found is None else found.suspects)})


def sure_errors(session: Session, found: Identification) -> Errors:
    """Those of the shown fit without suspects: one wrong row would shape their mean, and what is advised."""
    return found.runs[session.results.fit].without(np.isin(found.held_out_data.row, suspects(session)))


def without_suspects(session: Session) -> str:
    """Behind a mean: ` (0.086 without row 15, which no arm explains)`; empty where there is no such row."""
    rows, found = suspects(session), session.results.identification
    if not rows or found is None:
        return ""
    named = first_of(map(session.measurements.row_name, rows), MAX_NAMED)
    left = compared(sure_errors(session, found).position_mm.mean)
    return f" ({left} without row{'s' * (len(rows) > 1)} {named}, which no arm explains)"


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
        out.append(StageErrors(stage, words[stage], errors.judged))
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
    return f"Mean error {compared(first.error)} → {compared(last.error)} mm{without_suspects(session)}"


def noise_length(found: Identification) -> float:
    """Mean length of the instrument's position errors [mm]; NaN where its noise is unknown."""
    known = found.instrument
    return 1e3 * NORM_OF_NOISE * known.position if known is not None else float("nan")


def share_of_noise(session: Session, found: Identification) -> float:
    """How many times the instrument's noise is left on average; NaN where that is unknown."""
    left, noise = sure_errors(session, found).position_mm.mean, noise_length(found)
    return left / noise if noise > 0.0 else float("nan")
