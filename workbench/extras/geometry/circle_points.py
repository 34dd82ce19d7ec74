"""Circle-point analysis: the actual axis of each joint, from circles traced by a point of the tool.

Rows in which one joint alone turned are found in the data. Their points lie on a circle; its plane's normal
is the axis's direction and its centre a point of the axis (Katana §2.2.4). Against the model's axis stand the
angle between the two and the distance of the centre from the model's axis, in the posture that was measured.

The circle is that of `circles.fit_circle`.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Int

from workbench.arm import chain as chains
from workbench.arm.robot import Robot
from workbench.base.circles import fit_circle
from workbench.base.errors import DataError
from workbench.base.threads import one_thread
from workbench.base.types import Vector3, frozen
from workbench.data.dataset import Dataset

MIN_CIRCLE_POINTS = 5
"""Points of a circle at least."""
STILL = 1e-9
"""Joints that differ by less have not moved [rad]."""
MIN_RADIUS = 1e-3
"""Radius below which the point lies on the axis and there is no circle to fit [m]."""


@dataclass(frozen=True, eq=False, kw_only=True)
class CircleAxis:
    """A joint's axis as its circle shows it.

    Args:
        joint: Counted from 0.
        rows: Rows of the data on the circle.
        centre: Of the circle, in the measuring frame [m].
        direction: Unit vector along the axis, such that the joint turns about it.
        radius: Of the circle [m].
        rms: Root mean square distance of the points from the circle [m].
        angle: Between this axis and the model's [rad].
        distance: Of the centre from the model's axis [m].
    """

    joint: int
    rows: Int[np.ndarray, " k"]
    centre: Vector3
    direction: Vector3
    radius: float
    rms: float
    angle: float
    distance: float


@one_thread()
def circle_axes(robot: Robot, data: Dataset) -> tuple[CircleAxis, ...]:
    """The axes of all joints that have a circle in the data, in the order of the joints.

    Args:
        robot: Model whose axes are compared.
        data: Rows with positions.
    """
    robot.check_joints(data.q, data.source)
    found = tuple(
        axis
        for joint in range(robot.dof)
        if (axis := _axis(robot, data, joint, _turned_alone(data, joint))) is not None
    )
    if not found:
        raise DataError(
            f"{data.source}: no joint was moved alone through {MIN_CIRCLE_POINTS} poses or more; measure "
            "circle points (workbench simulate --index circle-points shows how)"
        )
    return found


def _turned_alone(data: Dataset, joint: int) -> Int[np.ndarray, " k"]:
    """The most rows with a position in which this joint differs and all others stand still."""
    if data.position is None:
        return np.arange(0)
    usable = np.flatnonzero(np.isfinite(data.position).all(axis=1) & data.included)
    others = np.round(np.delete(data.q[usable], joint, axis=1) / STILL).astype(np.int64)
    _, group = np.unique(others, axis=0, return_inverse=True)
    group = group.ravel()
    rows = usable[group == np.argmax(np.bincount(group))] if len(usable) else usable
    return rows if len(np.unique(np.round(data.q[rows, joint] / STILL))) >= MIN_CIRCLE_POINTS else rows[:0]


def _axis(robot: Robot, data: Dataset, joint: int, rows: np.ndarray) -> CircleAxis | None:
    """The circle of some rows against the model; None where there is none."""
    if len(rows) < MIN_CIRCLE_POINTS:
        return None
    rows = rows[np.argsort(data.q[rows, joint], kind="stable")]
    points = np.asarray(data.position)[rows]
    circle = fit_circle(points)
    if circle.radius < MIN_RADIUS:
        return None
    arms = points - circle.centre
    normal = circle.axes[2] * np.sign(circle.axes[2] @ np.cross(arms[:-1], arms[1:]).sum(axis=0))
    direction, foot = _model_axis(robot, data.q[rows[0]], joint)
    offset = circle.centre - foot
    return CircleAxis(
        joint=joint,
        rows=rows,
        centre=circle.centre,
        direction=frozen(normal),
        radius=circle.radius,
        rms=circle.rms,
        angle=float(np.arctan2(np.linalg.norm(np.cross(normal, direction)), normal @ direction)),
        distance=float(np.linalg.norm(offset - (offset @ direction) * direction)),
    )


def _model_axis(robot: Robot, q: np.ndarray, joint: int) -> tuple[Vector3, Vector3]:
    """Direction of a joint's axis in the model and a point of it, in the measuring frame."""
    element = int(robot.chain.driven[joint])
    frame = chains.frames(robot.chain, q[None], np.array([element]))[0, 0]
    return frame[:3, int(robot.chain.axes[element]) % 3], frame[:3, 3]
