"""Check before a fit, which would distort any arm to match any rows, whether the rows are its own.

The nominal arm is brought to the rows with the best base and tool. An arm's own rows are then off by its
errors of making, a hundredth of its reach, and inside its joint limits. Rows of another arm are off by a
twentieth of it or more (seen: rows of UR5, UR10, WAM, Panda and iiwa on each other), and often a built-in arm
fits them. Joints whose zero is elsewhere do the same to an arm's own rows; where offsets of the joints mend
it, they are its own. So they are where a mistake in the file explains the misfit, such as joints exchanged.
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
from workbench.base.wording import in_mm
from workbench.data.dataset import Dataset
from workbench.identification.algorithms.opt2_levenberg_marquardt import Opt2
from workbench.identification.alignment import spread_rows
from workbench.identification.frames import visible_parts
from workbench.identification.likely_mistakes import (
    BETTER,
    FRAME_STEPS,
    aligned,
    explained,
    median_error,
    rough_error,
)
from workbench.identification.problem import FrameFreedom, Problem

LOOKED_AT = 60
"""Rows that are looked at, and …"""
MIN_ROWS = 10
"""… how many with a measured point tell anything."""
SOME, MUCH = 0.045, 0.12
"""Shares of the reach: from the first on other arms are tried, beyond the second the rows are not its own."""
MISREAD = 0.01
"""Share of the reach from which on mistakes in the file are looked for."""
OUTSIDE = 0.2
"""Share of rows outside the joint limits from which on half as much is too much."""
SLACK = 0.05
"""How far beyond a limit a joint may be [rad or m]."""
SAME_GEOMETRY = 1e-3
"""Relative difference of what two arms of the same geometry leave."""
CLOSE = 0.004
"""Share of the reach from which on other arms are tried for a calibrated arm, which has no noise."""


@dataclass(frozen=True, kw_only=True)
class ArmMatch:
    """How well rows match a nominal arm.

    Args:
        robot: Name of the arm.
        error: Median distance of measured from predicted points with the best base and tool [m]; NaN where
            too few tell, infinite for rows of an arm with another number of joints.
        outside: Share of the rows in which a joint is beyond its limits.
        rival: Built-in arm that fits far better, as `load_robot` takes it; empty if there is none.
        rival_name: What that arm is called.
        rival_error: What it leaves [m].
        mistake: What was mistaken in the file, where that alone explains the rows; empty if nothing.
        headings: What the file's columns are without it, as `with_headings_corrected` takes them; empty: no
            heading mends it.
        mistake_error: What is left of them without it [m].
        is_foreign: Whether these are clearly not the arm's rows, or not as they stand in the file.
        joints: Joints of the rows and of the arm, where they differ.
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

    @property
    def text(self) -> str:
        """The finding as a sentence."""
        rows, arm = self.joints
        found = [f"{in_mm(self.error)} off after the best base and tool"]
        if rows != arm:
            found = [f"{rows} joints in the file, {arm} in the arm"]
        if self.outside >= 0.005:
            found.append(f"{100 * self.outside:.0f} % of the rows outside the joint limits")
        sentence = ", ".join(found)
        if self.mistake:
            return f"{sentence}: {self.mistake} ({in_mm(self.mistake_error)} off without that)"
        own = "these rows are not" if self.is_foreign else "these rows may be"
        sentence += f": {own} {self.robot}'s"
        if self.rival:
            sentence += f"; {self.rival_name} fits to {in_mm(self.rival_error)}"
        elif self.is_foreign and rows == arm:
            sentence += "; no joints exchanged, sign or unit explains it"
        return sentence

    @property
    def remedy(self) -> str:
        """What to do about rows that are foreign."""
        if self.mistake:
            return "correct the file's headings"
        return f"choose the robot '{self.rival}'" if self.rival else "choose the robot that was measured"


def arm_match(robot: Robot, data: Dataset, *, some: float = SOME) -> ArmMatch:
    """Compare rows with the arm that they are said to be of; quick, unless something is wrong.

    Args:
        data: Rows; of another number of joints it is asked only which built-in arm they fit.
        some: Share of the reach from which on other arms are tried.
    """
    if data.joints != robot.dof:
        return _with_other_joints(robot, data)
    outside = _outside(robot, data)
    if (aligned_to := _aligned_to_some(robot, data)) is None:
        return ArmMatch(robot=robot.name, error=np.nan, outside=outside)
    at, seen = aligned_to
    error = median_error(at, seen)
    found = ArmMatch(robot=robot.name, error=error, outside=outside)
    if error < min(some, MISREAD) * robot.reach:
        return found
    if error > some * robot.reach:
        found = _with_rival(found, data, seen)
    reading = explained(_bare(robot), seen, error, maximum=SOME * robot.reach)
    if reading is not None and not reading.error > found.rival_error:
        found = replace(found, rival="", rival_name="", rival_error=np.nan)
        return replace(
            found,
            mistake=reading.text,
            mistake_error=reading.error,
            headings=reading.headings,
            is_foreign=True,
        )
    much = error > MUCH * robot.reach or (outside > OUTSIDE and error > 0.5 * MUCH * robot.reach)
    return replace(found, is_foreign=bool(found.rival) or (much and not _other_zeros(at, seen, error)))


def placed(robot: Robot, data: Dataset) -> Robot:
    """The nominal arm on the base, and with the tool, that fit its rows best; as it is where too few tell."""
    found = _aligned_to_some(robot, data) if data.joints == robot.dof else None
    return robot if found is None else replace(robot, mounting=found[0].mounting, sessions={})


@lru_cache(maxsize=4)
def _aligned_to_some(robot: Robot, data: Dataset) -> tuple[Robot, Dataset] | None:
    """The nominal arm, without effects, where rows fit it best, and these; None where too few tell."""
    seen = _some(data)
    return None if seen is None else (aligned(_bare(robot), seen), seen)


def require_same_arm(calibrated: Robot, nominal: Robot) -> None:
    """Refuse a nominal arm that is not the calibrated one's; base, flange and joint zeros may differ."""
    if calibrated.dof != nominal.dof:
        raise ShapeError(
            f"the calibrated arm '{calibrated.name}' has {calibrated.dof} joints, the nominal one "
            f"'{nominal.name}' {nominal.dof}; give the arm that was calibrated",
            expected=calibrated.dof,
            found=nominal.dof,
        )
    actual, planned = calibrated.bare, nominal.bare
    low, high = planned.search_limits.T
    q = np.random.default_rng(0).uniform(low, high, (LOOKED_AT, planned.dof))
    flange = tool_poses(actual, Motion(q))
    rows = Dataset(q=q, position=flange[:, :3, 3], rotation=flange[:, :3, :3], source=calibrated.name)
    found = arm_match(planned, rows, some=CLOSE)
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
    seen = _some(data)
    best = found if seen is None else _with_rival(found, data, seen)
    return best if best.rival and best.rival_error < SOME * load_robot(best.rival).reach else found


def _outside(robot: Robot, data: Dataset) -> float:
    """Share of the rows in which a joint is beyond its limits."""
    low, high = robot.limits.T
    q = data.q[data.included]
    return float(((q < low - SLACK) | (q > high + SLACK)).any(1).mean()) if len(q) else 0.0


def _some(data: Dataset) -> Dataset | None:
    """Rows with points of the session that has most of them; None where too few tell."""
    if data.position is None:
        return None
    has_point = data.included & np.isfinite(data.position).all(1)
    session = max(data.sessions, key=lambda name: int((has_point & data.in_session(name)).sum()))
    rows = np.flatnonzero(has_point & data.in_session(session))
    if len(rows) < MIN_ROWS:
        return None
    return data.take(rows[spread_rows(data.take(rows), LOOKED_AT)])


def _bare(robot: Robot) -> Robot:
    return replace(robot, effects=(), sessions={})


def _with_rival(found: ArmMatch, data: Dataset, seen: Dataset) -> ArmMatch:
    """The match with the built-in arm of the rows' joints that fits best, if it does so far better.

    Of arms alike but for joint limits, as FR3 and Panda, it is the one within whose limits more rows are.
    """
    beyond = 0.0
    for name in built_in_robots():
        rival = load_robot(name)
        is_variant = rival.name.split(",")[0] == found.robot.split(",")[0]  # ARIA and its arm of Table 4
        if rival.dof != seen.joints or is_variant:
            continue
        if rough_error(_bare(rival), seen) > found.error:
            continue
        error = median_error(aligned(_bare(rival), seen, FRAME_STEPS), seen)
        outside = _outside(rival, data)
        is_alike = np.isclose(error, found.rival_error, rtol=SAME_GEOMETRY)
        is_better = outside < beyond if is_alike else not error >= found.rival_error
        if error < found.error / BETTER and is_better:
            beyond = outside
            found = replace(found, rival=name, rival_name=rival.name, rival_error=error)
    return found


def _other_zeros(at: Robot, seen: Dataset, error: float) -> bool:
    """Whether offsets of the joints alone explain nearly everything."""
    frames = FrameFreedom(*visible_parts(seen))
    problem = Problem.build(at, seen, free=at.joint_offsets, frames=frames)
    return median_error(problem.robot_at(Opt2(limit=100).search(problem).x), seen) < error / BETTER
