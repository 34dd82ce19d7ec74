"""Trajectory tracking of the Katana thesis done again (chapter 5): a circle and lines on virtual arms.

The nominal arm plans the paths; the virtual arm of `katana_generator`, with the pencil holder at its tool,
runs them. From some samples of the circle alone the constants of (5.11) are identified (5.20), after what is
known of the joints has been taken off; then the joints are corrected (5.22), and all paths are run again:

    geometry             the joints taken as stiff and tight
    stiffness first      the compliance of the joints taken off
    tilting first        clearance and backlash, too: the thesis's order (Fig. 4.9)
    ours                 geometry and tilting found together from 118 poses, corrected until nothing is left

The thesis prints its circle and not its line, which is chosen here on the same plane, near to the circle's
posture. A third path is the circle's upright diameter, the pencil held level in another posture: what was
identified on one trajectory is judged there.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.interpolate import make_interp_spline

from studies import katana_printed as printed
from studies.katana_generator import VirtualKatana, draw_arm
from studies.katana_paths import Path, circle_through, plan
from studies.katana_study import EACH_DIRECTION, REMAINDER, Spread, point_problem, read_tilting, spread
from workbench import Frame, Motion, Robot, load_robot, tool_poses
from workbench.arm.effects import AbstractEffect
from workbench.arm.inverse.damped_newton import refine
from workbench.arm.inverse.follow import rigid_targets
from workbench.arm.inverse.reduced_arm import compile_arm
from workbench.base.progress import cancelled, progress, running
from workbench.base.types import JointRows, Poses
from workbench.data.simulation.instruments import INSTRUMENTS
from workbench.extras.trajectories.correction import correct
from workbench.extras.trajectories.path import Commanded, command_joints
from workbench.identification.algorithms.ols import Ols
from workbench.plate.poses.iso_cube import iso_cube_poses

LINE = np.array([[0.09, -0.3, 0.1392893], [-0.09, -0.3353553, 0.1746446]])
"""Ends of the line [m]."""
LEVEL = np.array([0.0, -1.0, 0.0])
"""How the pencil is held where the arm takes another posture."""
PATHS = ("circle", "line", "diameter in another posture")
"""Paths of all results."""
CIRCLE, LINE_NEAR, LINE_FAR = range(3)
"""Their places."""
DURATIONS = (20.0, 10.0, 10.0)
"""Time of each path [s]."""
ROWS, SAMPLES, POSES = 200, 24, 118
"""Rows of a path; samples of the circle that identify; poses of our way."""
STEPS = ("before", "geometry", "stiffness first", "tilting first", "ours")
"""Columns of all results."""
BEFORE, GEOMETRY, STIFFNESS, TILTING, OURS = range(5)
"""Their places."""


@dataclass(frozen=True, eq=False, kw_only=True)
class TrackingStudy:
    """Errors of many arms along the paths.

    Args:
        paths: As planned, in the order of `PATHS`.
        mean: Mean distance from the path, arm by arm, by column of `STEPS` and path [mm].
        alone: What the joints' compliance alone, and all of their tilting, would do to the nominal arm along
            the circle [mm].
    """

    paths: tuple[Path, ...]
    mean: Float[np.ndarray, "arms 5 3"]
    alone: Float[np.ndarray, "2 rows"]

    def spread(self, step: int, path: int = CIRCLE) -> Spread:
        """Mean error over the arms [mm]."""
        return spread(self.mean[:, step, path])

    def reduction(self, step: int, path: int = CIRCLE) -> Spread:
        """How many times smaller than before."""
        return spread(self.mean[:, BEFORE, path] / self.mean[:, step, path])


def tracking_study(*, arms: int, seed: int = 0) -> TrackingStudy:
    """Let virtual Katanas follow the paths, with the 130 mm of the pencil holder (Table 5.1)."""
    tool = Frame(xyz=np.array([0.0, 0.0, printed.PENCIL_HOLDER]))
    robot = load_robot("katana450-three-rotation").with_frames(tool=tool)
    paths = tracked_paths(robot)
    cube = iso_cube_poses(robot, POSES, rng=np.random.default_rng(seed)).q
    errors: list[np.ndarray] = []
    for number in range(arms):
        if errors and cancelled():
            break
        rng = np.random.default_rng([seed, 5, number])
        actual = draw_arm(rng, play=EACH_DIRECTION, remainder=REMAINDER)
        with running():  # an arm is done or not
            errors.append(tracked(actual, robot, read_tilting(rng, EACH_DIRECTION), paths, cube, rng))
        progress((number + 1) / arms, "paths followed")
    found = np.array(errors)
    return TrackingStudy(
        paths=paths, mean=np.moveaxis(found.mean(axis=-1), 1, 2), alone=_alone(robot, paths[0])
    )


def tracked_paths(robot: Robot) -> tuple[Path, ...]:
    """Those of `PATHS`, the pencil as upright on their plane as the arm can hold it; level on the last."""
    circle, normal = circle_through(printed.POINTS)
    lines = (make_interp_spline([0.0, 1.0], ends, k=1) for ends in (LINE, printed.POINTS[[1, 3]]))
    curves = zip((circle, *lines), (normal, normal, LEVEL), strict=True)
    return tuple(
        plan(robot, *curve, duration=duration, rows=ROWS)
        for curve, duration in zip(curves, DURATIONS, strict=True)
    )


def tracked(
    actual: VirtualKatana,
    robot: Robot,
    tilting: tuple[AbstractEffect, ...],
    paths: tuple[Path, ...],
    cube: JointRows,
    rng: np.random.Generator,
) -> Float[np.ndarray, "paths 5 samples"]:
    """Distances of one arm from all paths by column of `STEPS` [mm]."""
    compliance = tuple(e for e in tilting if e.name == "joint-compliance")
    samples = paths[0].motion.q[np.linspace(0, ROWS - 1, SAMPLES, endpoint=False).astype(int)]
    methods = [(effects, samples, False) for effects in ((), compliance, tilting)]
    models = [
        identified(robot.with_effects(*effects), actual, q, rng, together=together)
        for effects, q, together in (*methods, (tilting, cube, True))
    ]
    out = np.zeros((len(paths), len(STEPS), ROWS))
    for k, path in enumerate(paths):
        out[k, BEFORE] = missed(actual, robot, path.motion.q, path.poses)
        for step, model in enumerate(models, start=1):
            commanded = command_joints(model, robot, path.motion.q, positions_only=True)
            q = correct(commanded).q if step == OURS else one_step(commanded)
            out[k, step] = missed(actual, robot, q, path.poses)
    return out


def one_step(commanded: Commanded) -> JointRows:
    """Joints after the step of eq. (5.22), damped, in the rows that it makes better."""
    robot, q, task = commanded.calibrated, commanded.q, commanded.task
    arm, off = compile_arm(robot), list[np.ndarray]()
    aims = rigid_targets(robot, commanded.poses, Motion(q))
    step = refine(arm, aims, q, task=task, limits=robot.limits, iterations=1).q
    for x in (q, step):
        aims = rigid_targets(robot, commanded.poses, Motion(x))
        off.append(refine(arm, aims, x, task=task, iterations=0).position_error)
    return np.where((off[1] > off[0])[:, None], q, step)


def identified(
    robot: Robot, actual: VirtualKatana, q: JointRows, rng: np.random.Generator, *, together: bool = False
) -> Robot:
    """The model whose twists and offsets of (5.11) fit measured positions, eq. (5.20) iterated."""
    noise = INSTRUMENTS["optotrak"].deviations[0]
    seen = reached(actual, robot, q)[:, :3, 3] + noise * rng.standard_normal((len(q), 3))
    effects = tuple(robot.coefficients) if together else ()
    problem = point_problem(robot, q, seen, noise, robot.default_free, effects)
    return problem.robot_at(Ols().search(problem).x)


def reached(actual: VirtualKatana, robot: Robot, q: JointRows) -> Poses:
    """Where the tip of the virtual arm's pencil really is, seen from the reference corner."""
    return actual.poses(q) @ robot.tool.pose


def missed(actual: VirtualKatana, robot: Robot, q: JointRows, wanted: Poses) -> Float[np.ndarray, " rows"]:
    """Distance of the virtual arm from poses in the robot's base [mm], eq. (5.21)."""
    away = reached(actual, robot, q) - robot.base.pose @ wanted
    return 1e3 * np.linalg.norm(away[:, :3, 3], axis=1)


def _alone(robot: Robot, path: Path) -> Float[np.ndarray, "2 rows"]:
    """Fig. 5.10: the nominal geometry with the joints of Table 5.2, in motion."""
    exact = read_tilting(np.random.default_rng(0), EACH_DIRECTION)
    arms = (robot.with_frames(base=Frame()).with_effects(*e) for e in (exact[2:], exact))
    away = np.array([tool_poses(arm, path.motion) - path.poses for arm in arms])
    return 1e3 * np.linalg.norm(away[..., :3, 3], axis=-1)
