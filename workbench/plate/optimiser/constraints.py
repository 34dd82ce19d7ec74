"""Constraints of a fixture, and messages for infeasible ones."""

from collections import Counter
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from workbench.arm.inverse.branch import LIMIT_MARGIN
from workbench.arm.joint import NotNegative
from workbench.arm.robot import Robot
from workbench.base.arguments import Length, LengthAndAngle, admit
from workbench.base.errors import DataError, OptionError
from workbench.data.simulation.simulate import LIKELY_ERRORS
from workbench.plate.optimiser.meshes import arm_shape
from workbench.plate.optimiser.shapes import ON_THE_TABLE, ArmShape, plate_hull
from workbench.plate.optimiser.target_blocks import SIDE
from workbench.plate.plate import Plate

OWN_BLOCK = "clearance from its own block"
"""The constraint violated by a flange without a probe: it touches its own block."""
DENSEST = np.pi / np.sqrt(12.0)
"""Maximum share of the plane that equal circles can cover (Thue)."""


@dataclass(frozen=True, kw_only=True)
class Constraints:
    """Margins that every target of a fixture keeps.

    Args:
        clearance: Minimum distance of the arm from blocks, plate, table and itself [m].
        limit_margin: Minimum distance of every joint from its limits [rad or m].
        errors: Maximum manufacturing errors, length [m] and angle [rad], of arms that reach every target.
        spacing: Minimum distance of two targets on the plate [m].
        edge: Minimum distance of a target from the plate's edge [m].
        retreat: Distance over which the probe must be able to retract along its axis with the same clearance
            [m].
        floor: Height of the table in the robot's base [m]; None if there is none.
    """

    clearance: Length = 0.010
    limit_margin: NotNegative = LIMIT_MARGIN
    errors: LengthAndAngle = LIKELY_ERRORS
    spacing: Length = 0.08
    edge: Length = float(0.5 * np.sqrt(2.0) * SIDE)
    retreat: Length = 0.05
    floor: float | None = 0.0

    def __post_init__(self):
        admit(self)


def check_room(plate: Plate, number: int, half: Float[np.ndarray, "2"], spacing: float) -> None:
    """Refuse more targets than fit: circles of the spacing's diameter, packed as densely as can be."""
    if number < 1:
        raise OptionError(f"the number of targets must be at least 1, got {number}")
    room = float(np.prod(2.0 * half + spacing))
    fits = int(DENSEST * room / (0.25 * np.pi * spacing**2)) if spacing > 0.0 else number
    if number > fits:
        raise OptionError(
            f"plate size and spacing conflict: {number} targets {1e3 * spacing:.0f} mm apart don't fit on "
            f"plate '{plate.name}', at most {fits} do; use fewer targets or less spacing"
        )


def check_base(arm: ArmShape, plate: Plate, clearance: float) -> None:
    """Refuse a plate that stands in the robot's base."""
    fixed = arm.bodies <= ON_THE_TABLE
    if plate.size is None or not fixed.any():
        return
    placements = arm.placements(np.zeros((1, arm.robot.dof)))
    gap = float(arm.hull_distances(placements, [plate_hull(plate.pose, plate.size)], checked=fixed)[0])
    if gap <= 0.0:
        raise OptionError(
            f"plate '{plate.name}' overlaps the base of robot '{arm.robot.name}' by {-1e3 * gap:.0f} mm; "
            "move it away"
        )
    if gap < clearance:
        raise OptionError(
            f"clearance and the plate's place conflict: plate '{plate.name}' is {1e3 * gap:.0f} mm from the "
            f"base of robot '{arm.robot.name}', {1e3 * clearance:.0f} mm are required; change one of them"
        )


def is_clear_of(robot: Robot, plate: Plate) -> bool:
    """Whether a plate is outside the robot's base, so that it can be optimised."""
    clearance = Constraints().clearance
    try:
        check_base(arm_shape(robot, clearance), plate, clearance)
    except OptionError:
        return False
    return True


def conflict(plate: Plate, number: int, kept: int, missed: Counter[str]) -> DataError:
    """The error for a plate with too few targets that keep all constraints: names those most often missed.

    Args:
        number: Number of targets required.
        kept: How many of the solutions tried, targets in one branch each, keep all constraints on their own.
        missed: How many others miss each constraint.
    """
    solutions = kept + missed.total()
    if not solutions:
        return DataError(
            f"no pose on plate '{plate.name}' is reachable within the joint limits; move the plate nearer"
        )
    if kept:
        return DataError(
            f"spacing and clearance from other blocks conflict: {kept} of {solutions} solutions on plate "
            f"'{plate.name}' keep all constraints, but not {number} of them together; relax one of the two"
        )
    most = " and ".join(f"{what} ({count})" for what, count in missed.most_common(2) if count)
    probe = ", or give the robot the probe that touches the targets as its tool" if OWN_BLOCK in most else ""
    return DataError(
        f"none of {solutions} solutions on plate '{plate.name}' keeps all constraints: most miss {most}; "
        f"relax one of them{probe}"
    )
