"""The low-cost check of the Katana thesis done again (§5.5.2): pencil, paper, potentiometer, one virtual arm.

The arm draws the circle as it comes; once more after it was led by hand to the four printed points and its
controller took the circle through where it believed to be; and with its joints corrected as in
`katana_tracking`. Each sheet is scanned and read, and what was read stands beside where the tip really was.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from studies import katana_printed as printed
from studies.finding import Finding, judged
from studies.katana_generator import VirtualKatana, draw_arm
from studies.katana_study import EACH_DIRECTION, REMAINDER, read_tilting
from studies.katana_tracking import ROWS, SAMPLES, drawing_katana, identified, reached
from studies.pencil_scan import draw, scan
from workbench.arm.frame import Frame
from workbench.arm.kinematics.forward import geometric_jacobian, tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.types import JointRows, Poses, Positions
from workbench.extras.katana.pencil import plotted_errors, plotted_profile
from workbench.extras.trajectories.correction import CorrectionMethod, correct
from workbench.extras.trajectories.curves import Circle, circle_through
from workbench.extras.trajectories.path import command_joints
from workbench.extras.trajectories.planning import Planned, plan

DOTS = 200.0
"""Of the scan, to an inch."""
BY_HAND = 1e-4
"""How near a hand leads the pencil to a printed point, each axis [m]."""
LED = 12
"""Rounds in which the hand arrives."""


@dataclass(frozen=True, eq=False, kw_only=True)
class PencilCheck:
    """Distances from the printed circle across the path: as it comes, taught at its four points, corrected.

    Args:
        read: From the scan and the potentiometer [mm].
        actual: Of the virtual arm [mm].
    """

    read: Float[np.ndarray, "3 rows"]
    actual: Float[np.ndarray, "3 rows"]


def pencil_check(path: Planned, *, seed: int = 0) -> PencilCheck:
    """Let one virtual Katana draw the circle and read its sheets."""
    robot, circle, rng = drawing_katana(), circle_through(printed.POINTS), np.random.default_rng([seed, 13])
    actual = draw_arm(rng, play=EACH_DIRECTION, remainder=REMAINDER)
    model = robot.with_effects(*read_tilting(rng, EACH_DIRECTION))
    samples = path.q[np.linspace(0, ROWS - 1, SAMPLES, endpoint=False).astype(int)]
    calibrated = identified(model, actual, samples, rng)
    command = command_joints(calibrated, robot, path.q, positions_only=True)
    believed = robot.with_effects().with_frames(base=Frame())
    points = tool_poses(believed, Motion(led_by_hand(actual, robot, path, rng)))[:, :3, 3]
    taught = circle_through(points)
    again = plan(robot, taught, duration=float(path.time[-1]), rows=ROWS, axis=path.axis)
    drawn = ((path, path.q), (again, again.q), (path, correct(command, method=CorrectionMethod.ONE_STEP).q))
    pairs = [_checked(circle, planned, in_base(actual, robot, q), rng) for planned, q in drawn]
    read, real = (np.array(part) for part in zip(*pairs, strict=True))
    return PencilCheck(read=read, actual=real)


def led_by_hand(
    actual: VirtualKatana, robot: Robot, path: Planned, rng: np.random.Generator
) -> Float[np.ndarray, "4 5"]:
    """What the encoders show when the pencil has been led to the four printed points [rad]."""
    away = np.linalg.norm(path.poses[:, None, :3, 3] - printed.POINTS, axis=2)
    q = path.q[away.argmin(axis=0)]
    wanted = printed.POINTS + BY_HAND * rng.standard_normal(printed.POINTS.shape)
    for _ in range(LED):
        missed = wanted - in_base(actual, robot, q)[:, :3, 3]
        q = q + np.einsum("rij,rj->ri", np.linalg.pinv(geometric_jacobian(robot, q)[:, :3]), missed)
    return q


def in_base(actual: VirtualKatana, robot: Robot, q: JointRows) -> Poses:
    """Poses of the virtual arm's pencil in the robot's base."""
    return se3.inverse(robot.base.pose) @ reached(actual, robot, q)


def _checked(
    circle: Circle, planned: Planned, real: Poses, rng: np.random.Generator
) -> tuple[Float[np.ndarray, " rows"], Float[np.ndarray, " rows"]]:
    """Distances read from one drawing, and real ones [mm]."""
    drawn = draw(real, circle.centre, circle.along, circle.across)
    clockwise = float(planned.axis @ np.cross(circle.along, circle.across)) > 0.0
    image = scan(drawn, circle.radius, clockwise=clockwise, rng=rng, dpi=DOTS, turned=0.02)
    errors = plotted_errors(
        plotted_profile(image, circle.radius),
        planned.poses[:, :3, 3],
        planned.poses[:, :3, 2],
        drawn.extension,
        centre=circle.centre,
        along=circle.along,
        across=circle.across,
    )
    return 1e3 * errors.distance, 1e3 * _off(circle, real[:, :3, 3])


def _off(circle: Circle, points: Positions) -> Float[np.ndarray, " rows"]:
    """Distances of points from a circle [m]."""
    away = points - circle.centre
    flat = away @ np.stack([circle.along, circle.across], 1)
    above = away @ np.cross(circle.along, circle.across)
    return np.hypot(np.linalg.norm(flat, axis=1) - circle.radius, above)


def pencil_finding(found: PencilCheck) -> Finding:
    """§5.5.2: the set-up shows an improvement without costly instruments."""
    read, actual = found.read.mean(axis=1), found.actual.mean(axis=1)
    return judged(
        "§5.5.2",
        "pencil and potentiometer tell before from after, mean distance [mm]",
        "visually",
        f"{read[0]:.3f} → {read[2]:.3f} read, {actual[0]:.3f} → {actual[2]:.3f} in truth",
        bool((np.abs(read - actual) < 0.1 * actual[0]).all() and read[2] < read[0] / 2.0),
        "a drawn line does not show where along the path the pencil was",
    )
