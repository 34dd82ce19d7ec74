"""Commands for comparison: the shown fit, the shown row, the overlays in the scene."""

from collections.abc import Iterable
from dataclasses import replace
from functools import partial

import numpy as np

from workbench.arm.robot import Robot
from workbench.base.advice import ask
from workbench.base.errors import OptionError
from workbench.base.types import frozen
from workbench.data.dataset import Dataset
from workbench.data.measuring_order import with_drivers
from workbench.identification.meaning.nominal_fit import placed
from workbench.session.command import AbstractChange, AbstractCommand, computed
from workbench.session.comparison import MAX_TIMES, MIN_TIMES, Comparison, ModelStage, Overlay, compare
from workbench.session.loaded_measurements import Loaded
from workbench.session.stages import suspects
from workbench.session.state import Focus, Session


def with_comparison(session: Session) -> Session:
    """The session with its measurements compared with every available model.

    What was identified or diagnosed stays even if its rows can't be compared.
    """
    loaded = session.measurements.loaded
    plain = session.updated("results", comparison=None)
    if loaded is None:
        return plain
    found = partial(_comparison, session, loaded)
    rows = found() if session.results.is_empty else ask("measured against predicted positions", found, None)
    return plain if rows is None else plain.updated("results", comparison=rows, row=_same_row(session, rows))


def _same_row(session: Session, rows: Comparison) -> int:
    """The row that is looked at, wherever it stands now; the worst one once there are errors at all."""
    before, row = session.results.comparison, session.results.row
    if rows.stages and (before is None or not before.stages):
        return int(rows.worst[0])
    same = [] if before is None else np.flatnonzero(rows.number == before.number[row]).tolist()
    return same[0] if same else 0


def _comparison(session: Session, loaded: Loaded) -> Comparison:
    found, shown, kept_out = session.results.identification, None, None
    nominal = session.robot if loaded.virtual else placed(session.robot, loaded.dataset)
    if found is not None:
        run = found.runs[session.results.fit]
        nominal, shown = found.aligned, run.as_measured
    models = _models(session, shown)
    robots = [robot for robot in (nominal, shown, *models.values()) if robot is not None]
    fitted = _driven(robots, loaded.dataset)
    checks = None if loaded.checks is None else _driven(robots, loaded.checks)
    if found is not None:
        held_out = fitted if len(found.held_out_rows) else checks
        used = np.union1d(
            found.data.row[found.train_rows], found.held_out_data.row if held_out is fitted else []
        )
        kept_out = fitted.take(~np.isin(fitted.row, used))
        fitted = _directed(found.data.take(found.train_rows), fitted)
        checks = _directed(found.held_out_data, held_out)
    if found is None or not len(found.held_out_rows):
        checks = checks and replace(checks, row=checks.row + 1 + int(loaded.dataset.row.max(initial=-1)))
    rows = compare(fitted, checks, kept_out, nominal, models)
    off, diagnosis = suspects(session), session.results.diagnosis
    off += [] if found is None else [outlier.row for outlier in found.outliers]
    off += [] if diagnosis is None else diagnosis.data.row[diagnosis.outliers].tolist()
    return replace(rows, set_apart=frozen(np.isin(rows.number, off)))


def _driven(robots: Iterable[Robot], data: Dataset) -> Dataset:
    """All rows of a file with what drives the effects of any of these arms."""
    for robot in robots:
        data = with_drivers(robot, data)
    return data


def _directed(rows: Dataset, whole: Dataset | None) -> Dataset:
    """Some rows of a file, in its order, with the directions of motion that only the whole file tells."""
    if whole is None or whole.direction is None or rows.direction is not None:
        return rows
    return replace(rows, direction=whole.direction[np.isin(whole.row, rows.row)])


def _models(session: Session, shown: Robot | None) -> dict[ModelStage, Robot]:
    """Arms by what they have of the actual one; none of them saw the held-out rows."""
    models, diagnosis = {}, session.results.diagnosis
    if diagnosis is not None:
        models = {ModelStage.NOMINAL: diagnosis.aligned, ModelStage.GEOMETRY: diagnosis.before_fit.calibrated}
        if diagnosis.effects:
            models[ModelStage.EFFECTS] = diagnosis.after_fit.calibrated
    if session.results.identification is not None and shown is not None:
        models[ModelStage.NOMINAL] = session.results.identification.aligned
        geometry: Robot | None = shown
        if session.results.accepted:
            models[ModelStage.EFFECTS] = shown
            geometry = None if session.results.geometry is None else session.results.geometry.as_measured
        if geometry is not None:  # one number for one stage: the diagnosis has fitted one for itself
            models[ModelStage.GEOMETRY] = geometry
    return models


class ShowFit(AbstractChange):
    """Show the robot that this algorithm identified."""

    key = "fit"

    algorithm: str

    title = computed(lambda self: f"Show the fit of {self.algorithm.upper()}")

    def check(self, session: Session) -> None:
        fits = {} if session.results.identification is None else session.results.identification.runs
        if self.algorithm not in fits:
            known = ", ".join(name.upper() for name in fits) or "none yet"
            raise OptionError(f"no fit by {self.algorithm.upper()} (available: {known})")

    def apply(self, session: Session) -> Session:
        return with_comparison(session.updated("results", fit=self.algorithm))


class ShowRow(AbstractChange):
    """Put the arm where it stood at a measured row, counted from 0 in the comparison."""

    key = "row"

    row: int

    title = computed(lambda self: f"Show measured pose {self.row + 1}")

    def check(self, session: Session) -> None:
        rows = 0 if session.results.comparison is None else len(session.results.comparison)
        if not 0 <= self.row < rows:
            have = f"must be 1 to {rows}" if rows else "no measurements are loaded"
            raise OptionError(f"no measured pose {self.row + 1}: {have}")

    def apply(self, session: Session) -> Session:
        return session.updated("playback", focus=Focus.ROW).updated("results", row=self.row)

    def merged_with(self, previous: AbstractCommand, session: Session) -> "ShowRow | None":
        return self if isinstance(previous, ShowRow) else None


class SetOverlay(AbstractChange):
    """Choose the overlays in the scene and the exaggeration of the errors."""

    title = "Set the overlay"
    key = "overlay"

    overlay: Overlay

    def check(self, session: Session) -> None:
        if not MIN_TIMES <= self.overlay.exaggeration <= MAX_TIMES:
            wrong = f"must be {MIN_TIMES:g} to {MAX_TIMES:g}, got {self.overlay.exaggeration:g}"
            raise OptionError(f"the exaggeration of errors {wrong}")

    def apply(self, session: Session) -> Session:
        return session.updated("choices", overlay=self.overlay)
