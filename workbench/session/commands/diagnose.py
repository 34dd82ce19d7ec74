"""Commands that find missing effects, add them, and measure at the most informative poses."""

from dataclasses import replace
from functools import partial

import numpy as np

from workbench.base.errors import DataError
from workbench.base.progress import progress
from workbench.diagnosis.result import Diagnosis
from workbench.identification.instrument_preparation import preparation_of
from workbench.identification.result import Identification
from workbench.plate.collision import allows_target
from workbench.session.command import AbstractTask
from workbench.session.commands.compare import with_comparison
from workbench.session.commands.data import check_same_arm, check_unchanged, fitted_rows, measurements
from workbench.session.commands.identify import Identify
from workbench.session.loaded_measurements import Loaded, is_of_other_rows
from workbench.session.page_state import Severity
from workbench.session.state import Session
from workbench.session.target_steps import begin_step

MIN_ROWS = 20
"""Fewer rows can't tell one effect from another."""


class Diagnose(AbstractTask[tuple[Loaded, Diagnosis]]):
    """Find the effect that the model lacks; if there is none, take the arm that is fitted to all rows.

    Args:
        held_out: Share of the rows that is kept for judging; they choose nothing.
        seed: Of the held-out rows and the folds.
        anyway: Whether to go on though the rows are clearly another arm's.
    """

    title = "Diagnose"
    is_filed = True

    held_out: float = 0.2
    seed: int = 0
    anyway: bool = False

    def check(self, session: Session) -> None:
        check_same_arm(session, anyway=self.anyway or session.results.identification is not None)
        dataset = measurements(session).dataset
        if why := preparation_of(dataset).undiagnosed:
            raise DataError(why)
        rows = len(dataset) - len(session.measurements.left_out)
        if rows < MIN_ROWS:
            raise DataError(f"a diagnosis needs at least {MIN_ROWS} rows, got {rows}; measure more")

    def compute(self, session: Session) -> tuple[Loaded, Diagnosis]:
        from workbench.diagnosis.diagnose import diagnose

        loaded = measurements(session)
        standing = np.array([state.q for state in session.states if state.measurable])
        is_clear = partial(allows_target, session.robot, session.plate, standing)
        rows = fitted_rows(session, self.held_out, self.seed)
        return loaded, diagnose(session.robot, measurable=is_clear if loaded.virtual else None, **rows)

    def finish(self, session: Session, result: tuple[Loaded, Diagnosis]) -> Session:
        loaded, found = result
        check_unchanged(session, loaded, "diagnose")
        if found.effects or session.results.accepted:
            session = with_comparison(begin_step(session, is_whole=True).updated("results", diagnosis=found))
        else:  # nothing is left to be added
            session = AddEffects().finish(session, (found, (loaded, found.identification())))
        return session.with_message(Severity.LOG, session.measurements.named(found.message))


class AddEffects(AbstractTask[tuple[Diagnosis, tuple[Loaded, Identification]]]):
    """Make the arm of the diagnosis, its geometry and effects fitted on all rows, the calibrated one."""

    title = "Add the effects to the model"
    is_filed = True

    def check(self, session: Session) -> None:
        if session.results.diagnosis is None or not session.results.diagnosis.effects:
            raise DataError("no diagnosis has found an effect to add")

    def compute(self, session: Session) -> tuple[Diagnosis, tuple[Loaded, Identification]]:
        found = session.results.diagnosis
        assert found is not None
        progress(0.1, "judging the arm with them")
        fits = measurements(session), _on_same_rows(session, found, found.identification())[0]
        fits[1].warnings  # noqa: B018  worked out here, not by the worker as it draws the page
        return found, fits

    def finish(self, session: Session, result: tuple[Diagnosis, tuple[Loaded, Identification]]) -> Session:
        found, fits = result
        more = {"accepted": tuple(a.effect for a in found.effects), "diagnosis": found}
        before = session.results
        fit, is_same = _on_same_rows(session, found, fits[1])  # else the diagnosis has one of its own
        geometry = (before.geometry if before.accepted else before.run) if is_same else None
        return (before.asked or Identify()).finish(session, (fits[0], fit, geometry), **more)


def _on_same_rows(session: Session, found: Diagnosis, fit: Identification) -> tuple[Identification, bool]:
    """The fit of a diagnosis, on the last identification's base if that has the same rows; whether it has."""
    last, rows = session.results.identification, found.held_out_data.row
    is_stale = is_of_other_rows(last, session.measurements.left_out)
    if last is None or is_stale or not np.array_equal(last.held_out_data.row, rows):
        return fit, False
    if fit.ready is None or fit.ready is not last.ready:
        known = replace(fit, aligned=last.aligned, nominal=last.nominal, ready=last.ready)
        fit = replace(known, outlying=found.outliers)
    return fit, True
