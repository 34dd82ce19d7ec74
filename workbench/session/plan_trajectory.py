"""A trajectory to be played: what the controller sends, and where nominal and calibrated tool then are.

The default ones are a circle and a straight line in the region that matters; the Katana's are those of its
thesis (§5.5.1), the line being a diameter of the circle.
"""

from collections.abc import Mapping

import numpy as np

from workbench.arm.inverse.damped_newton import Task
from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base.types import frozen
from workbench.paths.correction import compensate
from workbench.paths.curves import Circle, Curve, circle_through, line
from workbench.paths.path import command_joints
from workbench.paths.planning import plan
from workbench.session.bending import bending_robot
from workbench.session.planned_trajectory import Place, Track
from workbench.session.state import Session

CIRCLE, LINE = "circle", "line"
_X, _Y, _Z = np.eye(3)
PLANES = {
    "horizontal": (_X, _Y),
    "upright along x": (_X, _Z),
    "upright along y": (_Y, _Z),
    "tilted by 45°": (_X, (_Z - _Y) / np.sqrt(2.0)),
}
"""Two axes of each plane, base frame: a line runs along the first."""
ROWS = 240
"""Rows of a trajectory."""
SHARE = 0.3
"""Radius of the default circle, as a share of the region's smaller horizontal edge."""
KATANA = 1e-3 * np.array(
    [
        [100.0, -300.0, 139.2893],
        [0.0, -370.7107, 210.0],
        [-100.0, -300.0, 139.2893],
        [0.0, -229.2893, 68.5786],
    ]
)
"""Four points of the Katana thesis's circle on the plane at 45° (§5.5.1) [m]."""


def erring_robot(session: Session) -> Robot | None:
    """The arm that does not do what the nominal one would: the shown fit, or the opened arm's own effects."""
    return session.calibrated or bending_robot(session)


def curves(session: Session) -> Mapping[str, Curve]:
    """The trajectories that this arm can be sent along, by kind."""
    if session.robot.name.startswith("Katana"):
        return {CIRCLE: circle_through(KATANA), LINE: line(KATANA[0], KATANA[2])}
    region = session.plate.region
    middle, size = 0.5 * (region.min + region.max), region.max - region.min
    radius = SHARE * float(size[:2].min())
    round_ = middle + radius * np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    half = SHARE * size * [1.0, 1.0, 0.0]
    return {CIRCLE: circle_through(round_), LINE: line(middle - half, middle + half)}


def usual_circle(session: Session) -> Circle:
    """The circle that this arm is sent along unless another one is asked for."""
    found = curves(session)[CIRCLE]
    assert isinstance(found, Circle)
    return found


def chosen_curve(kind: str, place: Place) -> Curve:
    """The curve of a kind about a centre: a circle, or a straight line through it, in a plane."""
    along, across = PLANES[place.plane]
    centre = np.array(place.centre)
    if kind == CIRCLE:
        return Circle(centre=frozen(centre), along=along, across=across, radius=place.radius)
    return line(centre - place.radius * along, centre + place.radius * along)


def make_track(
    session: Session, kind: str, *, duration: float, is_corrected: bool, place: Place | None = None
) -> Track:
    """Plan a trajectory, and see where the tools go.

    Args:
        session: Arm, region and fit.
        kind: `circle` or `line`.
        duration: Time from beginning to end [s].
        is_corrected: Whether the joints are corrected with the erring arm.
        place: Where; as usual for the arm and its region if None.

    Raises:
        DataError: the path can't be followed; names time and joint.
    """
    curve = curves(session)[kind] if place is None else chosen_curve(kind, place)
    planned = plan(session.robot, curve, duration=duration, rows=ROWS)
    erring, nominal = erring_robot(session), session.robot.with_effects()
    before, actual, q = None, None, planned.q
    wanted = reached = planned.poses[:, :3, 3]
    if erring is not None:
        is_place = planned.task is Task.POSITION
        sent = command_joints(erring, nominal, planned.q, positions_only=is_place, time=planned.time)
        actual, wanted = sent.calibrated, sent.poses[:, :3, 3]
        before = frozen(np.linalg.norm(tool_poses(actual, Motion(planned.q))[:, :3, 3] - wanted, axis=1))
        q = compensate(sent).q if is_corrected else planned.q
        reached = tool_poses(actual, Motion(q))[:, :3, 3]
    return Track(
        kind=kind,
        robot=session.robot,
        actual=actual,
        is_corrected=is_corrected and actual is not None,
        time=planned.time,
        q=frozen(q),
        wanted=frozen(wanted),
        reached=frozen(reached),
        before=before,
        notes=planned.notes,
    )
