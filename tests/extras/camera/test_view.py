"""Poses chosen for a camera: the target in view at all of them, the derivative right, more information."""

from dataclasses import replace

import numpy as np
import pytest
from refusals import mentions, refuses

from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.base import se3
from workbench.base.errors import DataError, OptionError
from workbench.base.types import Freedom
from workbench.extras.camera.camera import Camera, Mount
from workbench.extras.camera.rig import Rig
from workbench.extras.camera.target import Charuco, charuco_target, target_toml
from workbench.extras.camera.target_in_view import TargetInView
from workbench.extras.poses.informative_poses import informative_poses
from workbench.extras.poses.pose_limits import PoseLimits
from workbench.plate.free_constants import identified_names
from workbench.plate.observability import index_named

LENS = np.array([900.0, 905.0, 640.0, 480.0, -0.1, 0.02, 1e-3, 0.0, 0.0])
CAMERA = """[[camera]]
name = "c"
size = [1280, 960]
fx = 900.0
fy = 905.0
cx = 640.0
cy = 480.0
distortion = [-0.1, 0.02, 1e-3, 0.0, 0.0]
free = false
"""
BOARD = Charuco((5, 7), 0.03, 0.022, "DICT_5X5_250")


def pose(xyz, rpy=(0.0, 0.0, 0.0)):
    return se3.pose(se3.rpy_to_matrix(np.deg2rad(rpy)), np.array(xyz, float))


def view(mounted=Mount.WORLD, **options):
    """A camera over the table looking down at a board on the tool; or on the tool, the board on the table."""
    camera = Camera(
        name="c", size=(1280, 960), intrinsics=LENS, mounted=mounted, free=Freedom.FIXED, sigma=np.ones(9)
    )
    carrier = Mount.TOOL if mounted is Mount.WORLD else Mount.WORLD
    rig = Rig((camera,), (charuco_target(BOARD, carrier),))
    if mounted is Mount.WORLD:
        eye, board = pose([0.4, 0.0, 1.1], [180, 0, 0]), pose([-0.07, 0.1, 0.02], [180, 0, 0])
    else:
        eye, board = pose([0.0, 0.0, 0.05]), pose([0.4, 0.1, 0.0], [180, 0, 0])
    return TargetInView(rig=rig, cameras=(eye,), target=board, **options)


@pytest.mark.parametrize("mounted", Mount)
def test_the_derivative_of_pixels_by_twists_is_that_of_differences(aria, mounted):
    seen = view(mounted)
    q = pose_sample(aria, seen, 4)
    poses, h = tool_poses(aria, Motion(q)), 1e-6
    root = seen._by_twist(poses)
    for k in range(6):
        step = np.zeros(6)
        step[k] = h
        moved = []
        for sign in (1.0, -1.0):
            turned = poses.copy()
            turned[:, :3, 3] += sign * step[:3]
            turned[:, :3, :3] = se3.rotvec_to_matrix(sign * step[3:]) @ poses[:, :3, :3]
            moved.append(seen.seen(turned, 0)[0])
        slope = (moved[0] - moved[1]) / (2 * h * seen.noise) * seen.seen(poses, 0)[1][..., None]
        assert root[..., k] == pytest.approx(slope.reshape(len(q), -1), rel=1e-4, abs=1e-2)


def pose_sample(robot, seen, number):
    from workbench.extras.poses.pose_limits import sample_poses

    return sample_poses(robot, number, PoseLimits(view=seen), rng=np.random.default_rng(0))


@pytest.mark.parametrize("mounted", Mount)
def test_chosen_poses_show_the_board_and_tell_more_than_random_ones(aria, mounted):
    seen = view(mounted)
    limits = PoseLimits(view=seen, clearance=0.0)
    names = identified_names(aria, base=True, tool=True)
    found = informative_poses(
        aria, 8, rng=np.random.default_rng(0), index="Ov1", names=names, limits=limits, method="greedy"
    )
    assert seen.admits(aria, found.q).all()
    assert limits.admits(aria, found.q).all()
    assert found.after > 1.2 * found.before
    pixel, sight = seen.seen(tool_poses(aria, Motion(found.q)), 0)
    assert (sight.mean(1) >= 0.9).all()
    assert (pixel[sight] > 0.0).all()


def test_what_is_out_of_sight_is_not_seen():
    seen = view()
    facing = seen.cameras[0] @ pose([0.0, 0.0, 0.6]) @ se3.inverse(seen.target)

    def shown(*turn, shift=(0.0, 0.0, 0.0), **options):
        poses = (seen.cameras[0] @ pose(shift) @ se3.inverse(seen.cameras[0]) @ facing)[None]
        turned = poses @ seen.target @ pose([0, 0, 0], turn) @ se3.inverse(seen.target)
        return bool(replace(seen, **options).shows(turned)[0])

    assert shown(0, 0, 0)
    assert shown(50, 0, 0)
    assert not shown(70, 0, 0)
    assert not shown(180, 0, 0)
    assert not shown(0, 0, 0, shift=(0.6, 0.0, 0.0))
    assert not shown(0, 0, 0, depth=(0.7, 2.0))
    assert not shown(0, 0, 0, shift=(0.0, 0.0, 3.0))


def test_a_far_picture_tells_less(aria):
    """Six rows a pose are the root of the information that its pixels have of the tool's pose."""
    seen = view()
    near, far = (seen.cameras[0] @ pose([0.0, 0.0, z]) @ se3.inverse(seen.target) for z in (0.5, 1.0))
    rows = seen._by_twist(np.stack([near, far]))
    assert np.linalg.norm(rows[0]) > 1.8 * np.linalg.norm(rows[1])


def test_the_index_needs_a_camera(aria):
    assert index_named("Ov1").name == "Ov1"
    with refuses(OptionError, option="index", found="Ov1"):
        informative_poses(aria, 8, rng=np.random.default_rng(0), index="Ov1")
    blind = replace(view(), cameras=(pose([0.4, 0.0, 1.1]),))
    with refuses(DataError, "--camera-at"):
        informative_poses(aria, 8, rng=np.random.default_rng(0), index="Ov1", limits=PoseLimits(view=blind))


def test_the_command_chooses_poses_in_view(run, tmp_path, aria):
    seen = view()
    (tmp_path / "camera.toml").write_text(CAMERA)
    (tmp_path / "target.toml").write_text(target_toml(*seen.rig.targets))
    options = ("poses", "--robot", "aria", "--number", "8", "--camera", "camera.toml", "--out", "q.csv")
    at = ("--camera-at", "0.4,0,1.1,180,0,0", "--target-at", "-0.07,0.1,0.02,180,0,0", "--method", "greedy")
    status, out, err = run(*options, "--target", "target.toml", *at)
    assert (status, err) == (0, "")
    assert mentions(out, "Ov1")
    q = np.loadtxt(tmp_path / "q.csv", delimiter=",", skiprows=1)
    assert seen.admits(aria, q).all()
    for missing in (("--target", "target.toml"), at):
        status, _, err = run(*options, *missing)
        assert status == 64
        assert mentions(err, "--camera", "--target FILE")
    status, _, err = run(*options, "--target", "target.toml", "--camera-at", "0.4,0,1")
    assert mentions(err, "--camera-at", "x,y,z,roll,pitch,yaw")
