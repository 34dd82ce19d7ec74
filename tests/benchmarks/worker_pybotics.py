"""pybotics: modified DH chain, `OptimizationHandler`, SciPy's least squares with finite differences.

The package's own example gives `optimize_accuracy` (distances of positions) to `least_squares`. The second
path keeps handler and forward kinematics but compares full poses, whitened, as the other packages do.
Lengths are in mm, as in its predefined models.
"""

import numpy as np
import task
from pybotics.optimization import OptimizationHandler, optimize_accuracy
from pybotics.robot import Robot
from pybotics.tool import Tool
from scipy.optimize import least_squares
from scipy.optimize._numdiff import approx_derivative

MM = np.array([1.0, 1e3, 1.0, 1e3])
ROWS = 100
LIMIT = 40  # evaluations; without it a tilted arm is searched for minutes


def handler(rotations):
    """World and tool frames and the links between them, each twist once: 29, or 26 for positions alone."""
    robot = Robot.from_parameters(task.NOMINAL * MM)
    robot.tool = Tool(task.four(np.eye(3), task.TOOL * 1e3))
    links = np.ones((task.JOINTS, 4), bool)
    links[0] = False  # the world frame moves the first link
    links[5, 2] = rotations  # else the tool's x and y are the same as the last theta
    links[2, 3] = False  # d along parallel axes repeats the one before
    tool = [True, True, False, rotations, rotations, False]
    # pybotics writes a frame's vector as x, y, z and Euler angles
    return OptimizationHandler(robot, links.ravel().tolist(), tool, [True] * 6)


def pose_residual(vector, handler, q, measured):
    """Whitened difference of full poses: position, and rotation vector to first order."""
    handler.apply_optimization_vector(vector)
    poses = np.array([handler.robot.fk(row) for row in q])
    place = (measured[:, :3, 3] * 1e3 - poses[:, :3, 3]) / (1e3 * task.SIGMA_POSITION)
    turn = measured[:, :3, :3] @ poses[:, :3, :3].transpose(0, 2, 1)
    skew = np.stack(
        [turn[:, 2, 1] - turn[:, 1, 2], turn[:, 0, 2] - turn[:, 2, 0], turn[:, 1, 0] - turn[:, 0, 1]]
    )
    return np.concatenate([place.ravel(), (skew / (2 * task.SIGMA_ROTATION)).ravel()])


def predicted(handler, x, q):
    """Held-out poses in m."""
    handler.apply_optimization_vector(x)
    poses = np.array([handler.robot.fk(row) for row in q])
    poses[:, :3, 3] *= 1e-3
    return poses.tolist()


def body(arrays, folder, repeats):
    q = arrays["q"]
    searches = {"positions": (optimize_accuracy, False), "poses": (pose_residual, True)}
    arms, rates = {name: {} for name in searches}, []
    for name, (residual, rotations) in searches.items():
        for arm in task.ARMS:
            poses = arrays[arm]
            measured = poses if rotations else poses[:, :3, 3] * 1e3

            def search(h, residual=residual, measured=measured):
                start = h.generate_optimization_vector()
                return least_squares(residual, start, args=(h, q, measured), max_nfev=LIMIT)

            seconds, answer = task.repeat(search, repeats, lambda r=rotations: handler(r))
            held_out = predicted(handler(rotations), answer.x, arrays["q_held_out"])
            arms[name][arm] = {"seconds": seconds, "predicted": held_out, "evaluations": int(answer.nfev)}
        h = handler(rotations)
        x, rows = h.generate_optimization_vector(), (h, q[:ROWS], measured[:ROWS])
        seconds, _ = task.repeat(
            lambda f=residual, x=x, rows=rows: approx_derivative(f, x, method="2-point", args=rows), repeats
        )
        how = f"{len(x)} + 1 calls of fk a pose, as least_squares does"
        rates.append(task.rate(f"finite differences, {name}", how, ROWS, seconds))
    return {
        "package": "pybotics",
        "paths": [
            task.path("optimize_accuracy", "positions only, least_squares", 26, arms["positions"], False),
            task.path("full poses", "own residual on its handler, least_squares", 29, arms["poses"]),
        ],
        "rates": rates,
    }


if __name__ == "__main__":
    task.worker(body)
