"""Check before a fit whether the rows belong to this arm: a fit would distort any arm to match any rows.

The nominal arm is aligned with the rows by the best base and tool. An arm's own rows then differ by its
manufacturing errors, about 1 % of its reach, and lie inside its joint limits. Rows of another arm differ by
5 % or more (observed with rows of UR5, UR10, WAM, Panda and iiwa on each other), and often a built-in arm
fits them. Different joint zeros look alike, but then joint offsets explain the misfit and the rows are the
arm's own. The same holds where a mistake in the file explains it, such as exchanged joints.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np

from workbench.arm.built_in_arms import load_robot
from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base.assets import built_in_robots
from workbench.base.errors import RobotError, ShapeError
from workbench.base.wording import in_mm, plural, ranges
from workbench.data.dataset import Dataset
from workbench.identification.algorithms.opt2_levenberg_marquardt import Opt2
from workbench.identification.alignment import spread_rows
from workbench.identification.checks.likely_mistakes import (
    FRAME_STEPS,
    MIN_ERROR_RATIO,
    aligned,
    distances,
    explained,
    median_error,
    rough_error,
)
from workbench.identification.frames import visible_parts
from workbench.identification.problem import FrameFreedom, Problem

MAX_CHECKED_ROWS = 60
"""Maximum number of rows that are checked, and …"""
MIN_MATCHED_ROWS = 10
"""… minimum number of them with a measured point."""
RIVAL_MISFIT, FOREIGN_MISFIT = 0.045, 0.12
"""Misfit as a share of the reach: above the first other arms are tried, above the second rows are foreign."""
MISREAD_MISFIT = 0.01
"""Misfit as a share of the reach above which mistakes in the file are looked for."""
MAX_OUTSIDE_SHARE = 0.2
"""Share of rows outside the joint limits above which half that misfit suffices."""
MIN_FITTING_SHARE, TRIM_ROUNDS = 0.65, 8
"""Share of rows that must fit for the others to be wrong, and number of rounds that search for them."""
SLACK = 0.05
"""Tolerance on the joint limits [rad or m]."""
SAME_GEOMETRY = 1e-3
"""Relative difference in misfit below which two arms have the same geometry."""
SAME_ARM_MISFIT = 0.004
"""The same for comparing a nominal arm with a calibrated one, where there is no noise."""


@dataclass(frozen=True, kw_only=True)
class ArmMatch:
    """How well rows match a nominal arm.

    Args:
        robot: Name of the arm.
        error: Median distance of measured from predicted points with the best base and tool [m]; NaN with too
            few points, infinite if the numbers of joints differ.
        outside: Share of the rows in which a joint is beyond its limits.
        rival: Built-in arm that fits far better, as `load_robot` takes it; empty if there is none.
        rival_name: Its name for display.
        rival_error: Its median distance [m].
        mistake: Mistake in the file that alone explains the misfit; empty if there is none.
        headings: Corrected column headings, as `with_headings_corrected` takes them; empty if no heading
            corrects it.
        mistake_error: Median distance once it is corrected [m].
        is_foreign: Whether the rows clearly belong to another arm, or need a correction of the file.
        joints: Number of joints of the rows and of the arm, where they differ.
        rows: Rows that alone need a correction, where most others fit.
    """

    robot: str
    error: float
    outside: float
    rival: str = ""
    rival_name: str = ""
    rival_error: float = np.nan
    mistake: str = ""
    mistake_error: float = np.nan
    headings: Mapping[str, str] = field(default_factory=dict)
    is_foreign: bool = False
    joints: tuple[int, int] = (0, 0)
    rows: tuple[int, ...] = ()

    @property
    def text(self) -> str:
        rows, arm = self.joints
        found = [f"the nominal arm is {in_mm(self.error)} off with the best base and tool"]
        if rows != arm:
            found = [f"{rows} joints in the file, {arm} in the arm"]
        if self.outside >= 0.005:
            found.append(f"{100 * self.outside:.0f} % of the rows outside the joint limits")
        sentence = ", ".join(found)
        if self.mistake:
            return f"{sentence}: {self.mistake} ({in_mm(self.mistake_error)} off once corrected)"
        own = "these rows don't" if self.is_foreign else "these rows may"
        sentence += f": {own} belong to {self.robot}"
        if self.rival:
            sentence += f"; {self.rival_name} fits to {in_mm(self.rival_error)}"
        elif self.is_foreign and rows == arm:
            sentence += "; exchanged joints, signs or units don't explain it"
        return sentence

    @property
    def remedy(self) -> str:
        if self.rows:
            return "correct the units or joints of these rows, or exclude them"
        if self.mistake:
            return "correct the file's headings"
        return f"choose the robot '{self.rival}'" if self.rival else "choose the robot that was measured"


def arm_match(robot: Robot, data: Dataset, *, some: float = RIVAL_MISFIT) -> ArmMatch:
    """Compare rows with the arm to which they are said to belong; fast unless something is wrong.

    Args:
        data: Rows; if their number of joints differs, only matching built-in arms are searched.
        some: Misfit as a share of the reach above which other arms are tried.
    """
    if data.joints != robot.dof:
        return _with_other_joints(robot, data)
    outside = _outside(robot, data)
    if (aligned_to := _aligned_to_some(robot, data)) is None:
        return ArmMatch(robot=robot.name, error=np.nan, outside=outside)
    at, checked = aligned_to
    error = median_error(at, checked)
    found = ArmMatch(robot=robot.name, error=error, outside=outside)
    if error < min(some, MISREAD_MISFIT) * robot.reach:
        return found
    if error > some * robot.reach:
        found = _with_rival(found, data, checked)
    reading = explained(_bare(robot), checked, error, maximum=RIVAL_MISFIT * robot.reach)
    if reading is not None and not reading.error > found.rival_error:
        found = replace(found, rival="", rival_name="", rival_error=np.nan)
        return replace(
            found,
            mistake=reading.text,
            mistake_error=reading.error,
            headings=reading.headings,
            is_foreign=True,
        )
    if error > some * robot.reach and not found.rival and (few := _without_some(_bare(robot), data)):
        rows = few[0].row.tolist()
        text = f"{plural(len(rows), 'row')} ({ranges(rows)}) don't fit the others"
        return replace(found, mistake=text, mistake_error=few[1], is_foreign=True, rows=tuple(rows))
    much = error > FOREIGN_MISFIT * robot.reach or (
        outside > MAX_OUTSIDE_SHARE and error > 0.5 * FOREIGN_MISFIT * robot.reach
    )
    return replace(found, is_foreign=bool(found.rival) or (much and not _other_zeros(at, checked, error)))


def placed(robot: Robot, data: Dataset) -> Robot:
    """The nominal arm with the base and tool that fit its rows best; unchanged with too few points."""
    found = _aligned_to_some(robot, data) if data.joints == robot.dof else None
    return robot if found is None else replace(robot, mounting=found[0].mounting, sessions={})


@lru_cache(maxsize=4)
def _aligned_to_some(robot: Robot, data: Dataset) -> tuple[Robot, Dataset] | None:
    """The nominal arm without effects, aligned with some of the rows, and these; None with too few points."""
    checked = _some(data)
    return None if checked is None else (aligned(_bare(robot), checked), checked)


def require_same_arm(calibrated: Robot, nominal: Robot) -> None:
    """Raise if the nominal arm differs from the calibrated one in more than base, flange and joint zeros."""
    if calibrated.dof != nominal.dof:
        raise ShapeError(
            f"the calibrated arm '{calibrated.name}' has {calibrated.dof} joints, the nominal one "
            f"'{nominal.name}' {nominal.dof}; give the arm that was calibrated",
            expected=calibrated.dof,
            found=nominal.dof,
        )
    actual, planned = calibrated.bare, nominal.bare
    low, high = planned.search_limits.T
    q = np.random.default_rng(0).uniform(low, high, (MAX_CHECKED_ROWS, planned.dof))
    flange = tool_poses(actual, Motion(q))
    data = Dataset(q=q, position=flange[:, :3, 3], rotation=flange[:, :3, :3], source=calibrated.name)
    found = arm_match(planned, data, some=SAME_ARM_MISFIT)
    if found.is_foreign:
        fits = f" ({found.rival_name}: {in_mm(found.rival_error)})" if found.rival else ""
        raise RobotError(
            f"'{nominal.name}' is {in_mm(found.error)} off the calibrated '{calibrated.name}' after the best "
            f"base and tool{fits}: it is another arm; give the nominal model of the one that was calibrated"
        )


def _with_other_joints(robot: Robot, data: Dataset) -> ArmMatch:
    found = ArmMatch(
        robot=robot.name, error=np.inf, outside=0.0, is_foreign=True, joints=(data.joints, robot.dof)
    )
    checked = _some(data)
    best = found if checked is None else _with_rival(found, data, checked)
    return best if best.rival and best.rival_error < RIVAL_MISFIT * load_robot(best.rival).reach else found


def _outside(robot: Robot, data: Dataset) -> float:
    low, high = robot.limits.T
    q = data.q[data.included]
    return float(((q < low - SLACK) | (q > high + SLACK)).any(1).mean()) if len(q) else 0.0


def _some(data: Dataset) -> Dataset | None:
    """Some of the rows with points; None if there are too few."""
    located = _with_points(data)
    return None if located is None else located.take(spread_rows(located, MAX_CHECKED_ROWS))


def _with_points(data: Dataset) -> Dataset | None:
    """Rows with points, of the session that has most of them; None if there are too few."""
    if data.position is None:
        return None
    has_point = data.included & np.isfinite(data.position).all(1)
    session = max(data.sessions, key=lambda name: int((has_point & data.in_session(name)).sum()))
    rows = np.flatnonzero(has_point & data.in_session(session))
    return data.take(rows) if len(rows) >= MIN_MATCHED_ROWS else None


def _without_some(robot: Robot, data: Dataset) -> tuple[Dataset, float] | None:
    """The rows that stand off from an arm that most others fit, and what it leaves of these [m]."""
    located = _with_points(data)
    assert located is not None, "the rows were aligned to"
    off = np.zeros(len(located))
    for _ in range(TRIM_ROUNDS):
        majority = located.take(np.flatnonzero(off <= np.quantile(off, MIN_FITTING_SHARE)))
        off = distances(aligned(robot, majority.take(spread_rows(majority, MAX_CHECKED_ROWS))), located)
    fits = off < RIVAL_MISFIT * robot.reach
    error = float(np.median(off[fits])) if fits.any() else np.inf
    is_clear = MIN_FITTING_SHARE <= fits.mean() < 1.0 and error < MISREAD_MISFIT * robot.reach
    return (located.take(np.flatnonzero(~fits)), error) if is_clear else None


def _bare(robot: Robot) -> Robot:
    return replace(robot, effects=(), sessions={})


def _with_rival(found: ArmMatch, data: Dataset, checked: Dataset) -> ArmMatch:
    """The match, with the built-in arm of as many joints that fits best, if it fits far better.

    Of arms that differ only in joint limits, as FR3 and Panda, the one within whose limits more rows lie.
    """
    beyond = 0.0
    for name in built_in_robots():
        rival = load_robot(name)
        is_variant = rival.name.split(",")[0] == found.robot.split(",")[0]  # ARIA and its arm of Table 4
        if rival.dof != checked.joints or is_variant:
            continue
        if rough_error(_bare(rival), checked) > found.error:
            continue
        error = median_error(aligned(_bare(rival), checked, FRAME_STEPS), checked)
        outside = _outside(rival, data)
        is_alike = np.isclose(error, found.rival_error, rtol=SAME_GEOMETRY)
        is_better = outside < beyond if is_alike else not error >= found.rival_error
        if error < found.error / MIN_ERROR_RATIO and is_better:
            beyond = outside
            found = replace(found, rival=name, rival_name=rival.name, rival_error=error)
    return found


def _other_zeros(at: Robot, checked: Dataset, error: float) -> bool:
    """Whether joint offsets alone explain nearly all of the misfit."""
    frames = FrameFreedom(*visible_parts(checked))
    problem = Problem.build(at, checked, free=at.joint_offsets, frames=frames)
    return (
        median_error(problem.robot_at(Opt2(limit=100).search(problem).x), checked) < error / MIN_ERROR_RATIO
    )
