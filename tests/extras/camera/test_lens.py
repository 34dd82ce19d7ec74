"""Lenses that no camera.toml describes, started from pixel tables and from pictures made by other code."""

import shutil

import board_on_tool
import camera_arms as virtual
import numpy as np
import pytest
from refusals import refuses
from slow import slow
from test_camera_fit import check_zeros, filed, true_errors

import workbench as wb
from workbench.base.errors import DataError
from workbench.extras.camera.camera import Mount
from workbench.extras.camera.folder import packed, read_folder
from workbench.extras.camera.rig import rig_of
from workbench.extras.camera.session_commands import LoadPictures
from workbench.extras.camera.target import Charuco, charuco_target, target_toml

cv2 = pytest.importorskip("cv2")
PARTS = ("fx", "fy", "cx", "cy", "k1", "k2")


def unlensed(folder, shots, *, on_tool=False):
    """The arm of a scene whose files are written, without a camera.toml."""
    robot = filed(folder, "hobby", shots, mounted="tool" if on_tool else "world")
    (folder / "camera.toml").unlink()
    return robot


def read(folder, source="pixels.csv"):
    rig = wb.read_rig(None, folder / "target.toml")
    return wb.read_pixels(folder / source, rig, joints=folder / "joints.csv")


def check_lens(fit, owner, truth):
    """fx fy cx cy k1 k2 lie within four standard errors, and the focal length is known to half a percent."""
    place = [fit.problem.names.index(f"{owner}.{part}") for part in PARTS]
    assert (np.abs(fit.x[place] - truth) < 4.0 * fit.std[place]).all()
    assert fit.std[place[0]] < 0.005 * truth[0]


LENSES = {
    "usual": (1.0, (0.0, 0.0), False),
    "wide and bent": (0.5, (-0.25, 0.1), False),
    "long": (2.8, (0.0, 0.0), False),
    "on the tool": (0.8, (-0.1, 0.03), True),
}


@pytest.mark.parametrize("case", [slow("usual"), slow("long"), slow("wide and bent"), "on the tool"])
def test_a_table_of_pixels_starts_any_lens(tmp_path, case):
    """Corners that are wrong among them; the arm ends as well as with a lens that was given."""
    scale, (k1, k2), on_tool = LENSES[case]
    rng, arm = virtual.made(6, "hobby", zeros=virtual.MIDDLE)
    k = virtual.K * [scale, scale, 1.0, 1.0]
    shots = virtual.scene(rng, arm, 25, on_tool=on_tool, distortion=(k1, k2, 0.0, 0.0, 0.0), k=k)
    for i in range(3, len(shots.rows), 40):
        image, camera, tag, corner, u, v = shots.rows[i]
        shots.rows[i] = image, camera, tag, corner, u + 25.0, v - 15.0
    robot = unlensed(tmp_path, shots, on_tool=on_tool)
    data = read(tmp_path)
    camera = rig_of(data).cameras[0]
    assert (camera.name, camera.mounted) == ("c0", Mount.TOOL if on_tool else Mount.WORLD)
    assert sum("no camera.toml" in note for note in data.notes) == 1
    assert abs(camera.intrinsics[0] / k[0] - 1.0) < 0.15  # a start
    run = wb.identify(robot, data, algorithms=("opt2",))
    check_lens(run.best.fit, "camera[c0]", [*k, k1, k2])
    check_zeros(run.best.fit, arm)
    before, after = true_errors(arm, (robot, run.robot))
    assert after < 0.2 * before


@pytest.mark.slow
def test_two_cameras_of_one_table(tmp_path):
    rng, arm = virtual.made(8, "hobby")
    shots = virtual.scene(rng, arm, 20, eyes=[(0.9, -0.6, 0.5), (0.8, 0.7, 0.6)])
    robot = unlensed(tmp_path, shots)
    fit = wb.identify(robot, read(tmp_path), algorithms=("opt2",), free=()).best.fit
    for camera in ("c0", "c1"):
        check_lens(fit, f"camera[{camera}]", [*virtual.K, 0.0, 0.0])


def test_pictures_joints_and_a_board_lead_to_the_zeros(aria, first, tmp_path):
    """Nothing is known of the lens, whose focal length is 780 px in pictures of 640 px."""
    board_on_tool.photograph(aria, np.deg2rad([0.0, 0.0, 0.6, 0.0, -0.4, 0.0]), tmp_path, count=16)
    (tmp_path / "camera.toml").unlink()
    session, command = first, LoadPictures("shots.zip", packed(tmp_path))
    data = command.finish(session, command.compute(session)).measurements.loaded.dataset
    assert any("lens is identified" in note for note in data.notes)
    found = wb.identify(aria, data)
    assert found.identifiability.title == "joint zeros"
    moved = found.best.fit.calibrated.values(("joint3.theta", "joint5.theta"))
    moved = np.rad2deg(moved - aria.values(("joint3.theta", "joint5.theta")))
    assert moved == pytest.approx([0.6, -0.4], abs=0.01)
    assert found.identifiability.doubts == ()


@pytest.mark.data
def test_poses_of_the_tool_in_place_of_joints_give_camera_and_board_alone(first, tmp_path, shared_data):
    """Real pictures, of whose lens nothing is known: 1.10 px is what OpenCV comes to with poses and lens."""
    shutil.copytree(shared_data / "charuco_poses", tmp_path, dirs_exist_ok=True)
    board = Charuco((5, 7), 0.036195, 0.018256, "DICT_6X6_250")
    (tmp_path / "target.toml").write_text(target_toml(charuco_target(board, "tool")))
    found = wb.identify(None, read_folder(tmp_path))
    assert found.best.train.spreads["pixel_px"].rms < 1.3
    poses = found.identifiability.json(found.best.fit)["camera"]["poses"]
    assert poses["camera[camera]"]["mounted"] == "world"
    with refuses(DataError, "give the joints"):
        LoadPictures("pics.zip", packed(tmp_path)).compute(first)
