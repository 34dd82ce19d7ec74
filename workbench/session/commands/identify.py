"""The command that identifies the robot from the loaded measurements."""

from dataclasses import replace
from typing import Any

from workbench.base.errors import OptionError
from workbench.base.wording import plural
from workbench.data.accuracy_requirement import Wanted
from workbench.identification.algorithms import ALGORITHMS, DEFAULT_ALGORITHMS
from workbench.identification.fit import Fit
from workbench.identification.identify import identify
from workbench.identification.prior import Prior
from workbench.identification.result import Identification, Run
from workbench.session.command import AbstractChange, AbstractTask, computed
from workbench.session.commands.compare import with_comparison
from workbench.session.commands.data import check_same_arm, check_unchanged, fitted_rows, measurements
from workbench.session.comparison import times_for
from workbench.session.loaded_measurements import Loaded
from workbench.session.page_state import Severity
from workbench.session.stages import before_and_after
from workbench.session.state import Focus, Session
from workbench.session.target_steps import begin_step

IdentifiedRows = tuple[Loaded, Identification, Run | None]
"""The measurements, the result, and that of the geometry alone where effects were added."""


class Identify(AbstractTask[IdentifiedRows]):
    """Identify the robot's parameters.

    Args:
        algorithms: Which algorithms, side by side.
        held_out: Share of the rows that is kept for checking.
        frames: `auto`, `shared` or `per-session`: whether base and tool differ between sessions.
        seed: Of the choice of held-out rows.
        anyway: Whether to go on though the rows are clearly another arm's.
    """

    title = "Identify the parameters"
    is_filed = True

    algorithms: tuple[str, ...] = DEFAULT_ALGORITHMS
    held_out: float = 0.2
    frames: str = "auto"
    seed: int = 0
    anyway: bool = False

    def check(self, session: Session) -> None:
        check_same_arm(session, anyway=self.anyway or session.results.identification is not None)
        if not self.algorithms or set(self.algorithms) - set(ALGORITHMS):
            titles = ", ".join(algorithm.title for algorithm in ALGORITHMS.values())
            raise OptionError(f"choose at least one algorithm of {titles}")
        if not session.robot.default_free:
            raise OptionError("no parameter of this robot is free; name some in its file")
        if not 0.0 <= self.held_out < 1.0:
            raise OptionError(f"the held-out share must be 0 to 99 %, got {self.held_out:.0%}")

    def compute(self, session: Session) -> IdentifiedRows:
        loaded, robot, run = measurements(session), session.robot, session.results.run
        added = tuple(replace(effect, coefficients=()) for effect in session.results.accepted)
        names = tuple(name for effect in added for name in effect.names)
        rows = fitted_rows(session, self.held_out, self.seed)
        rows |= {"algorithms": self.algorithms, "frames": self.frames}
        if not added or run is None:
            return loaded, identify(robot, **rows), None
        whole = robot.with_effects(*robot.effects, *added)
        found = identify(whole, prior=_known(run.fit, names), effects=names, **rows)
        return loaded, found, identify(robot, **rows).best

    def finish(self, session: Session, result: IdentifiedRows, **more: Any) -> Session:
        """The session with what was identified, and with `more` results that go with it."""
        loaded, found, geometry = result
        check_unchanged(session, loaded, "identify")
        fit, last = found.best.fit.algorithm.name, session.results.identification
        more |= {"identification": found, "geometry": geometry, "asked": self, "fit": fit}
        results = replace(session.results, **more)
        session = begin_step(session, is_whole=True).updated("playback", focus=Focus.ROW)
        session = with_comparison(replace(session, results=results).updated("measurements", unread=None))
        overlay = replace(session.choices.overlay, stage=None)
        if last is None and (rows := session.results.comparison) is not None:  # as later models then are
            overlay = replace(overlay, exaggeration=times_for(rows.stage_errors[:, 0], session.robot.reach))
        session = session.updated("choices", overlay=overlay)
        return session.with_message(Severity.LOG, before_and_after(session))


def _known(fit: Fit, names: tuple[str, ...]) -> Prior | None:
    """What held effects near zero as they were found: a knot of a map that no row sees stays there."""
    names = tuple(name for name in names if name in fit.problem.names)
    columns = [fit.problem.names.index(name) for name in names]
    rows = fit.problem.prior[:, columns]
    return Prior(names, fit.problem.prior_centre[columns], rows.T @ rows) if names else None


class SetWanted(AbstractChange):
    """Set the maximum errors of the calibrated arm.

    Args:
        position: Maximum position error [m]; None: nothing is wanted, and nothing judged.
        rotation: Maximum orientation error [rad]; None: orientations are not judged.
        per_axis: Whether each axis alone has to keep it.
    """

    title = "Set the required error"
    key = "wanted"

    position: float | None
    rotation: float | None = None
    per_axis: bool = False

    def check(self, session: Session) -> None:
        self.wanted()

    def wanted(self) -> Wanted | None:
        if self.position is None:
            return None
        return Wanted(position=self.position, rotation=self.rotation, per_axis=self.per_axis)

    def apply(self, session: Session) -> Session:
        return session.updated("choices", wanted=self.wanted())


class SetLevelled(AbstractChange):
    """Say whether the instrument is levelled, for what is identified and diagnosed from now on."""

    key = "levelled"

    levelled: bool

    title = computed(lambda self: f"The instrument is {'' if self.levelled else 'not '}levelled")

    def apply(self, session: Session) -> Session:
        return session.updated("measurements", levelled=self.levelled)


class LeaveRowsOut(AbstractChange):
    """Exclude exactly these measured rows from the next identification.

    Args:
        rows: Numbers of the data's rows, counted from 0.
    """

    key = "rows"

    rows: tuple[int, ...]

    title = computed(lambda self: f"Exclude {plural(len(self.rows), 'row')}" if self.rows else "Use all rows")

    def check(self, session: Session) -> None:
        known = set(measurements(session).dataset.row.tolist())
        if unknown := sorted(set(self.rows) - known):
            raise OptionError(f"row numbers must be {min(known)} to {max(known)}, got {unknown[0]}")
        if not known - set(self.rows):
            raise OptionError("at least one row must be kept")

    def apply(self, session: Session) -> Session:
        session = begin_step(session, is_whole=True)
        return session.updated("measurements", left_out=frozenset(self.rows))
