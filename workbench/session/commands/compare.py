"""Commands about comparing: which fit, which measured row, what is laid over the scene."""

from dataclasses import dataclass, replace

from workbench.base.errors import OptionError
from workbench.data.dataset import Dataset
from workbench.session.command import AbstractChange
from workbench.session.comparison import compare, numbered_after
from workbench.session.state import Focus, Overlay, Session, Units

LEAST_EXAGGERATION, GREATEST_EXAGGERATION = 1.0, 500.0


def with_fit(session: Session, algorithm: str) -> Session:
    """The session with one of its fits shown and compared."""
    found = session.identification
    assert found is not None
    fitted = found.data.take(found.train_rows)
    checks: Dataset | None = found.held_out_data
    if not len(found.held_out_rows):
        checks = numbered_after(fitted, checks)
    run = found.runs[algorithm]
    compared = compare(fitted, checks, found.aligned, run.judged or run.calibrated)
    return replace(session, fit=algorithm, comparison=compared)


@dataclass(frozen=True)
class ShowFit(AbstractChange):
    """Show the robot that this algorithm identified."""

    key = "fit"

    algorithm: str

    @property
    def title(self) -> str:
        return f"Show the fit of {self.algorithm.upper()}"

    def check(self, session: Session) -> None:
        fits = {} if session.identification is None else session.identification.runs
        if self.algorithm not in fits:
            known = ", ".join(name.upper() for name in fits) or "none yet"
            raise OptionError(f"no fit by {self.algorithm.upper()} (available: {known})")

    def apply(self, session: Session) -> Session:
        return with_fit(session, self.algorithm)


@dataclass(frozen=True)
class ShowRow(AbstractChange):
    """Put the arm where it stood at a measured row, counted from 0 in the comparison."""

    key = "row"

    row: int

    @property
    def title(self) -> str:
        return f"Show measured pose {self.row + 1}"

    def check(self, session: Session) -> None:
        rows = 0 if session.comparison is None else len(session.comparison)
        if not 0 <= self.row < rows:
            have = f"must be 1 to {rows}" if rows else "no measurements are loaded"
            raise OptionError(f"no measured pose {self.row + 1}: {have}")

    def apply(self, session: Session) -> Session:
        return replace(session, row=self.row, focus=Focus.ROW)


@dataclass(frozen=True)
class SetOverlay(AbstractChange):
    """Choose what is laid over the scene, and how much the errors are exaggerated."""

    title = "Set the overlay"
    key = "overlay"

    overlay: Overlay

    def check(self, session: Session) -> None:
        for what, times in (("errors", self.overlay.exaggeration), ("bending", self.overlay.bending)):
            if not LEAST_EXAGGERATION <= times <= GREATEST_EXAGGERATION:
                limits = f"{LEAST_EXAGGERATION:g} to {GREATEST_EXAGGERATION:g}"
                raise OptionError(f"the exaggeration of {what} must be {limits}, got {times:g}")

    def apply(self, session: Session) -> Session:
        return replace(session, overlay=self.overlay)


@dataclass(frozen=True)
class SetDark(AbstractChange):
    """Make all pages dark, or light."""

    key = "dark"

    is_dark: bool

    @property
    def title(self) -> str:
        return "Dark pages" if self.is_dark else "Light pages"

    def apply(self, session: Session) -> Session:
        return replace(session, is_dark=self.is_dark)


@dataclass(frozen=True)
class SetUnits(AbstractChange):
    """Show and type coordinates in these units."""

    key = "units"

    units: Units

    @property
    def title(self) -> str:
        return f"Coordinates in {self.units}"

    def apply(self, session: Session) -> Session:
        return replace(session, units=self.units)
