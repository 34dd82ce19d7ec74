"""Errors stage by stage: the nominal arm, its geometry identified, its causes added."""

from dataclasses import dataclass

import numpy as np

from workbench.base.wording import first_of
from workbench.identification.errors.row_errors import AbstractValidation, Errors
from workbench.identification.result import Identification
from workbench.identification.rows.row_selection import AbstractSplit
from workbench.report.numbers import compared
from workbench.session.comparison import STAGES, Comparison, ModelStage
from workbench.session.state import Session

MAX_NAMED = 3
NORM_OF_NOISE = float(np.sqrt(8.0 / np.pi))
"""Mean length of a position error of three normal components of unit deviation."""


@dataclass(frozen=True, eq=False)
class StageErrors:
    """Errors up to one stage of the model on the rows that count (`counted`).

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


def counted(session: Session, found: AbstractSplit, errors: AbstractValidation) -> Errors:
    """Errors on held-out rows, without suspects; on the fitted ones where none were held out.

    One wrong row would shape their mean. Whether a required error is kept is judged on all of them.
    """
    keep = ~np.isin(found.held_out_data.row, suspects(session))
    return (errors.held_out and errors.held_out.take(keep)) or errors.train


def file_errors(session: Session) -> dict[str, Errors]:
    """Errors of each file of the shown arm on those rows."""
    if (run := session.results.run) is None or run.judging is not run.held_out_data:
        return {} if run is None else run.file_errors
    keep = ~np.isin(run.saved.valid_for(run.judging).row, suspects(session))
    return {name: (len(e) == len(keep) and e.take(keep)) or e for name, e in run.file_errors.items()}


def without_suspects(session: Session) -> str:
    """Behind a mean: ` without row 15, which no arm explains`; empty where there is no such row."""
    loaded, rows = session.measurements.loaded, suspects(session)
    named = first_of(map(str if loaded is None else loaded.row_name, rows), MAX_NAMED)
    return f" without row{'s' * (len(rows) > 1)} {named}, which no arm explains" if rows else ""


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
        out.append(StageErrors(stage, words[stage], counted(session, found, errors)))
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
    left, noise = stages(session)[-1].error, noise_length(found)
    return left / noise if noise > 0.0 else float("nan")
