"""The observation of pictures, and their likelihood, against central differences."""

import numpy as np
import pytest
from checks import check_jacobian, check_problem

from workbench import Dataset, Motion, load_robot, tool_poses
from workbench.arm.frame import FRAME_PARTS
from workbench.base import se3
from workbench.base.types import Freedom
from workbench.extras.camera.camera import Camera, project
from workbench.extras.camera.likelihood import Likelihood, Pictures
from workbench.extras.camera.rig import PictureReadings, Rig
from workbench.extras.camera.target import Charuco, charuco_target
from workbench.identification.problem import FrameFreedom, Noise, Problem

ROWS = 6


def pictures(robot, rng, sessions):
    """Two cameras in the world, one of them of unknown intrinsics, and two boards on the tool."""
    q = rng.uniform(-1.0, 1.0, (ROWS, robot.dof))
    poses = tool_poses(robot, Motion(q))
    sigma = np.array([5.0, 5.0, 5.0, 5.0, 0.1, 0.1, 0.01, 0.01, 0.1])
    k = np.array([900.0, 910.0, 640.0, 500.0, -0.1, 0.02, 0.001, 0.002, 0.01])
    kind = {"size": (1280, 1000), "intrinsics": k, "sigma": sigma}
    cameras = (Camera(name="a", **kind), Camera(name="b", free=Freedom.FIXED, **kind))
    board = Charuco((4, 3), 0.04, 0.03, "DICT_6X6_250")
    targets = tuple(charuco_target(board, "tool", name=name) for name in ("left", "right"))
    boards = np.stack([np.eye(4), se3.pose(se3.rotvec_to_matrix(np.array([0.2, 0.4, 0.1])), np.full(3, 0.2))])
    eyes = np.stack([np.eye(4), se3.pose(se3.rotvec_to_matrix(np.array([0.1, 0.2, 0.3])), np.full(3, 0.1))])
    eyes[:, 2, 3] -= 2.5
    sight = se3.inverse(eyes)[None, :, None] @ poses[:, None, None] @ boards
    seen = [se3.apply(sight[:, :, b, None], target.points) for b, target in enumerate(targets)]
    pixels = project(np.concatenate(seen, axis=2), k).pixel
    pixels += rng.normal(0.0, 3.0, pixels.shape)
    pixels[3, 1, 2] = np.nan
    readings = PictureReadings(pixels, np.array([str(k) for k in range(ROWS)]), Rig(cameras, targets), sight)
    return Dataset(q=q, session=sessions, readings=readings)


@pytest.mark.parametrize("per_session", [False, True])
@pytest.mark.parametrize("joints", [(), (0.5, 0.0, 1.0, 0.2, 2.0, 0.5)], ids=["exact", "noisy readings"])
def test_every_jacobian_column_is_the_derivative(per_session, joints):
    rng = np.random.default_rng(7)
    robot = load_robot("aria")
    sessions = np.array(["front", "left"])[np.arange(ROWS) % 2] if per_session else None
    own = {"base_per_session": per_session, "tool_per_session": per_session}
    frames = FrameFreedom(FRAME_PARTS, FRAME_PARTS, **own)
    noise = Noise(1.0, 1.0, joints)
    check_problem(Problem.build(robot, pictures(robot, rng, sessions), frames=frames, noise=noise), rng)


def test_the_slope_of_the_likelihood_is_its_derivative():
    rng, unknowns = np.random.default_rng(1), 4
    residual, by_twist, jacobian = (rng.normal(size=(8, 20, *n)) for n in ((), (6,), (unknowns,)))
    pictures = Pictures.of(residual, by_twist, np.ones((8, 20), bool), jacobian)
    x, groups = rng.normal(size=unknowns), {"a": np.array([1.0, 2, 0, 0]), "b": np.array([0.0, 0, 1, 0])}
    likelihood = Likelihood(pictures, x, x, 1e-2 * np.eye(unknowns), np.zeros(unknowns), groups)
    logs = np.log([0.7, 0.3, 0.1, 0.2, 0.5])
    check_jacobian(lambda v: np.array(likelihood.cost(np.exp(v))[0]), likelihood.cost(np.exp(logs))[3], logs)
