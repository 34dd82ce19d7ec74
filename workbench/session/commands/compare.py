"""Commands for comparison: the shown fit, the shown row, the overlays in the scene."""

from dataclasses import replace

from workbench.arm.robot import Robot
from workbench.base.errors import OptionError
from workbench.data.directions import with_drivers
from workbench.session.command import AbstractChange, computed
from workbench.session.comparison import Overlay, Stage, compare, numbered_after
from workbench.session.state import Focus, Session, Units

LEAST_EXAGGERATION, GREATEST_EXAGGERATION = 1.0, 5000.0


def with_fit(session: Session, algorithm: str) -> Session:
    """The session with one of its fits shown and compared."""
    return with_comparison(replace(session, fit=algorithm))


def with_comparison(session: Session) -> Session:
    """The session with its measurements compared with every available model."""
    found, loaded = session.identification, session.loaded
    if loaded is None:
        return replace(session, comparison=None)
    if found is None:
        fitted = with_drivers(session.robot, loaded.dataset)
        checks, nominal, shown = numbered_after(fitted, loaded.checks), session.robot, None
    else:
        fitted = found.data.take(found.train_rows)
        checks = found.held_out_data
        if not len(found.held_out_rows):
            checks = numbered_after(fitted, checks)
        run = found.runs[session.fit]
        nominal, shown = found.aligned, run.judged or run.calibrated
    return replace(session, comparison=compare(fitted, checks, nominal, shown, _models(session, shown)))


def _models(session: Session, shown: Robot | None) -> dict[Stage, Robot]:
    """Arms by what they have of the actual one; none of them saw the held-out rows."""
    models, diagnosis = {}, session.diagnosis
    if diagnosis is not None:
        models = {Stage.NOMINAL: diagnosis.aligned, Stage.GEOMETRY: diagnosis.before_fit.calibrated}
        if diagnosis.effects:
            models[Stage.CAUSES] = diagnosis.after_fit.calibrated
    if session.identification is not None and shown is not None:
        models[Stage.NOMINAL] = session.identification.aligned
        if session.accepted:
            models[Stage.CAUSES] = shown
        else:  # one number for one stage: the diagnosis has fitted the geometry for itself
            models.setdefault(Stage.GEOMETRY, shown)
    return models


class ShowFit(AbstractChange):
    """Show the robot that this algorithm identified."""

    key = "fit"

    algorithm: str

    title = computed(lambda self: f"Show the fit of {self.algorithm.upper()}")

    def check(self, session: Session) -> None:
        fits = {} if session.identification is None else session.identification.runs
        if self.algorithm not in fits:
            known = ", ".join(name.upper() for name in fits) or "none yet"
            raise OptionError(f"no fit by {self.algorithm.upper()} (available: {known})")

    def apply(self, session: Session) -> Session:
        return with_fit(session, self.algorithm)


class ShowRow(AbstractChange):
    """Put the arm where it stood at a measured row, counted from 0 in the comparison."""

    key = "row"

    row: int

    title = computed(lambda self: f"Show measured pose {self.row + 1}")

    def check(self, session: Session) -> None:
        rows = 0 if session.comparison is None else len(session.comparison)
        if not 0 <= self.row < rows:
            have = f"must be 1 to {rows}" if rows else "no measurements are loaded"
            raise OptionError(f"no measured pose {self.row + 1}: {have}")

    def apply(self, session: Session) -> Session:
        return replace(session, row=self.row, focus=Focus.ROW)


class SetOverlay(AbstractChange):
    """Choose the overlays in the scene and the exaggeration of the errors."""

    title = "Set the overlay"
    key = "overlay"

    overlay: Overlay

    def check(self, session: Session) -> None:
        overlay = self.overlay
        for what, times in (
            ("errors", overlay.exaggeration),
            ("the calibrated arm's errors", overlay.exaggeration_after),
            ("bending", overlay.bending),
        ):
            if not LEAST_EXAGGERATION <= times <= GREATEST_EXAGGERATION:
                limits = f"{LEAST_EXAGGERATION:g} to {GREATEST_EXAGGERATION:g}"
                raise OptionError(f"the exaggeration of {what} must be {limits}, got {times:g}")

    def apply(self, session: Session) -> Session:
        return replace(session, overlay=self.overlay)


class SetDark(AbstractChange):
    """Make all pages dark, or light."""

    key = "dark"

    is_dark: bool

    title = computed(lambda self: "Dark pages" if self.is_dark else "Light pages")

    def apply(self, session: Session) -> Session:
        return replace(session, is_dark=self.is_dark, is_dark_chosen=True)


class FollowSystem(AbstractChange):
    """Follow the system's light or dark preference, unless the user has chosen one."""

    title = "As the system prefers"
    key = "system"
    is_automatic = True

    is_dark: bool

    def apply(self, session: Session) -> Session:
        return session if session.is_dark_chosen else replace(session, is_dark=self.is_dark)


class SetUnits(AbstractChange):
    """Show and type coordinates in these units."""

    key = "units"

    units: Units

    title = computed(lambda self: f"Coordinates in {self.units}")

    def apply(self, session: Session) -> Session:
        return replace(session, units=self.units)
