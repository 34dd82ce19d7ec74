"""Whether rows belong to an arm, for the page's loading gate and for arms that are compared.

A fit would distort any arm to match any rows. The nominal arm with the best base and tool differs from its
own rows by its manufacturing errors, well below 2 % of its reach; else `meaning/` is asked what the rows
mean.
"""

from dataclasses import dataclass

import numpy as np

from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base.errors import RobotError, ShapeError
from workbench.base.wording import in_mm
from workbench.data.dataset import Dataset
from workbench.identification.meaning.as_read import understood
from workbench.identification.meaning.meaning import RowMeaning
from workbench.identification.meaning.placement import place
from workbench.identification.meaning.read_rows import SISTER_MOVED, other_arm
from workbench.identification.meaning.search import CLEAR

COMPARED_POSES = 60
"""Number of postures at which two arms are compared."""
SAME_ARM, SAME_ARM_SHARE = 0.015, 0.05
"""Distances [m, and share of the reach] of an arm from its nominal model beyond which it is another one: if a
third arm fits, and anyhow."""


@dataclass(frozen=True, kw_only=True)
class ArmMatch:
    """How well rows match a nominal arm.

    Args:
        robot: Name of the arm.
        meaning: What the rows mean; None where they fit at a glance, or too few have a point.
        joints: Number of joints of the rows and of the arm.
    """

    robot: str
    meaning: RowMeaning | None
    joints: tuple[int, int]

    @property
    def rival(self) -> str:
        """Built-in arm that fits far better, as `load_robot` takes it; empty if there is none."""
        return self.meaning.best.other if self.meaning and self.meaning.is_found else ""

    @property
    def is_foreign(self) -> bool:
        """Whether the rows clearly belong to another arm, or need another reading."""
        if self.joints[0] != self.joints[1] or self.meaning is None:
            return self.joints[0] != self.joints[1]
        is_off = self.meaning.is_far or bool(self.meaning.cure)
        return self.meaning.is_misread or (not self.meaning.is_found and is_off)

    @property
    def readings(self) -> tuple[str, ...]:
        """Other readings that make the rows this arm's: `found`, or each by name, mirrored frames last."""
        found = self.meaning.choices if self.meaning and not self.rival and self.meaning.is_misread else {}
        return tuple(sorted(found, key=lambda how: found[how].mirrored))

    @property
    def text(self) -> str:
        """What is wrong, what to do, and last the numbers that tell it."""
        rows, arm = self.joints
        has = f", which has {arm} joints, not {rows}" if rows != arm else ""
        fit = f"fit {self.robot} only if read otherwise" if self.readings else f"don't fit {self.robot}{has}"
        what = f"'{self.rival}'" if self.rival else "that was measured"
        do = self.meaning.remedy if self.meaning and rows == arm else f"choose the robot {what}"
        return f"these rows {fit}: {do}{f'; {self.meaning.text()}' if self.meaning else ''}"


def arm_match(robot: Robot, data: Dataset) -> ArmMatch:
    """Compare rows with the arm to which they are said to belong; fast unless something is wrong.

    Args:
        data: Rows; if their number of joints differs, built-in arms and choices of columns are searched.
    """
    return ArmMatch(robot=robot.name, meaning=understood(robot, data)[1], joints=(data.joints, robot.dof))


def sister(nominal: Robot, found: Robot) -> str:
    """That the lengths that a fit found are another built-in arm's rather than this one's."""
    lengths = tuple(e.name for e in nominal.elements if e.unit == "m")
    if not np.abs(found.values(lengths) - nominal.values(lengths)).max(initial=0.0) > SISTER_MOVED:
        return ""
    data, off = misfit(found, nominal)
    if (rival := other_arm(nominal, data, off / CLEAR)) is None:
        return ""
    sizes = f"those of '{rival.other}' to {in_mm(rival.position)}, this arm's to {in_mm(off)}"
    return f"the lengths found are {sizes}: choose the robot '{rival.other}' if it was measured"


def require_same_arm(calibrated: Robot, nominal: Robot) -> None:
    """Raise if the nominal arm differs from the calibrated one in more than base, flange and joint zeros."""
    if calibrated.dof != nominal.dof:
        given = f"'{calibrated.name}' has {calibrated.dof} joints, the nominal one"
        text = f"the calibrated arm {given} '{nominal.name}' {nominal.dof}; give the arm that was calibrated"
        raise ShapeError(text, expected=calibrated.dof, found=nominal.dof)
    data, off = misfit(calibrated, nominal)
    rival = other_arm(nominal, data, off / CLEAR) if off > SAME_ARM else None
    if rival or off > SAME_ARM_SHARE * nominal.reach:
        fits = f" ({rival.robot.name} fits)" if rival else ""
        where = f"'{nominal.name}' is {in_mm(off)} off the calibrated '{calibrated.name}'"
        how = "it is another arm; give the nominal model of the one that was calibrated"
        raise RobotError(f"{where} after the best base, tool and joint zeros{fits}: {how}")


def misfit(calibrated: Robot, nominal: Robot) -> tuple[Dataset, float]:
    """Poses of an arm, and its distance [m] there from another with the best base, tool and joint zeros."""
    low, high = nominal.bare.search_limits.T
    q = np.random.default_rng(0).uniform(low, high, (COMPARED_POSES, nominal.dof))
    flange = tool_poses(calibrated.bare, Motion(q))
    rows, inner = (q, flange[:, :3, 3], flange[:, :3, :3]), range(1, nominal.dof - 1)
    at = place(nominal.bare, *(part[None] for part in rows), zeros=inner, robust=False)
    return Dataset(*rows, source=calibrated.name), float(np.sqrt((at.error**2).mean()))
