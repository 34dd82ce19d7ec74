"""workbench: the same arm, measurements and start, through the search alone and through the whole run."""

import numpy as np
import task

from workbench.arm.built_in_arms import load_robot
from workbench.arm.frame import FRAME_PARTS, Frame
from workbench.arm.kinematics.forward import identification_jacobian, tool_poses
from workbench.arm.motion import Motion
from workbench.base.types import Freedom
from workbench.data.dataset import Dataset
from workbench.identification.algorithms.ols import Ols
from workbench.identification.algorithms.opt2_levenberg_marquardt import Opt2
from workbench.identification.identify import identify
from workbench.identification.problem import FrameFreedom, Noise, Problem

NOISE = Noise(task.SIGMA_POSITION, task.SIGMA_ROTATION)
FREE = FrameFreedom(base=FRAME_PARTS, tool=FRAME_PARTS)
PER_REPEAT = 20
ROWS, BLOCK = 100_000, 1024


def nominal():
    """The built-in ARIA with the task's tool; base and tool unknown."""
    tool = Frame.from_pose(task.four(np.eye(3), task.TOOL), Freedom.FREE)
    return load_robot("aria").with_frames(base=Frame(free=Freedom.FREE), tool=tool)


def between_the_frames(robot):
    """The arm's constants that neither base nor tool repeats."""
    repeated = ("joint1.theta", "joint1.d", "joint6.theta", "joint6.d", "joint6.a", "joint6.alpha")
    return tuple(name for name in robot.default_free if name not in repeated)


def table(q, poses):
    """Measurements in memory."""
    rows = np.arange(len(q))
    return Dataset(q=q, row=rows, position=poses[:, :3, 3].copy(), rotation=poses[:, :3, :3].copy())


def searched(robot, data, names, algorithm):
    """Problem and search, as the peers' searches are counted."""
    problem = Problem.build(robot, data, free=names, frames=FREE, noise=NOISE)
    return problem, algorithm.search(problem)


def body(arrays, folder, repeats):
    robot = nominal()
    names = between_the_frames(robot)
    q = np.ascontiguousarray(arrays["q"])
    arms = {"OLS": {}, "OPT2": {}, "whole": {}}
    for arm in task.ARMS:
        data = table(q, arrays[arm])
        held_out = table(arrays["q_held_out"], arrays[f"{arm}_held_out"])
        for algorithm in (Ols(), Opt2()):
            seconds, (problem, search) = task.repeat(
                lambda a=algorithm, d=data: searched(robot, d, names, a), PER_REPEAT * repeats
            )
            poses = tool_poses(problem.robot_at(search.x), Motion(arrays["q_held_out"]))
            evaluations = len(search.history)
            arms[algorithm.title][arm] = {
                "seconds": seconds,
                "predicted": poses.tolist(),
                "evaluations": evaluations,
            }
        seconds, run = task.repeat(
            lambda d=data, h=held_out: identify(robot, d, held_out=h, algorithms=("opt2",), noise=NOISE),
            repeats,
        )
        poses = tool_poses(run.best.calibrated, Motion(arrays["q_held_out"]))
        evaluations = run.best.fit.iterations + 1
        arms["whole"][arm] = {"seconds": seconds, "predicted": poses.tolist(), "evaluations": evaluations}
    many = np.tile(q, (ROWS // len(q), 1))

    def derivative():
        for start in range(0, len(many), BLOCK):
            identification_jacobian(robot, Motion(many[start : start + BLOCK]), problem.names)

    count = len(problem.names)
    whole = len(run.best.fit.problem.names)
    how = "problem built and searched from nominal"
    return {
        "package": "workbench",
        "paths": [
            task.path("OLS", how, count, arms["OLS"]),
            task.path("OPT2", how, count, arms["OPT2"]),
            task.path(
                "identify", "the whole run: checks, frames, search, held-out errors", whole, arms["whole"]
            ),
        ],
        "rates": [
            task.rate(
                "identification_jacobian", f"{count} columns", len(many), task.repeat(derivative, repeats)[0]
            )
        ],
    }


if __name__ == "__main__":
    task.worker(body)
