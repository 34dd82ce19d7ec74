"""Pictures with their joints, or poses of the tool, on the page."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from workbench.extras.camera.findings import Identifiability
from workbench.extras.camera.folder import packed
from workbench.extras.camera.panels import _identified, camera_json, thumbnails
from workbench.extras.camera.session_commands import CameraAlone, LoadPictures, Previews
from workbench.extras.camera.target import Charuco, charuco_target, target_toml
from workbench.identification.identify import identify
from workbench.session.judgement import Tone
from workbench.session.next_step import next_step
from workbench.views.page.html import BAD

cv2 = pytest.importorskip("cv2")


def test_pictures_joints_and_a_board_lead_to_the_zeros(aria, first, tmp_path):
    """Nothing is known of the lens, whose focal length is 780 px in pictures of 640 px."""
    from board_on_tool import photograph

    shots = tmp_path / "shots"
    shots.mkdir()
    photograph(aria, np.deg2rad([0.0, 0.0, 0.6, 0.0, -0.4, 0.0]), shots, count=16)
    (shots / "camera.toml").unlink()
    content = Path(shutil.make_archive(str(tmp_path / "shots"), "zip", tmp_path, "shots")).read_bytes()
    session, command = first, LoadPictures("shots.zip", content)
    session = command.finish(session, command.compute(session))
    assert any("lens is identified" in note for note in session.measurements.loaded.notes)
    shown = thumbnails(session.measurements.loaded.dataset, session.part(Previews).by_image)
    assert shown.count("<img") == 16
    found = identify(aria, session.measurements.loaded.dataset)
    assert isinstance(found.identifiability, Identifiability)
    assert found.identifiability.title == "joint zeros"
    moved = found.best.fit.calibrated.values(("joint3.theta", "joint5.theta"))
    moved = np.rad2deg(moved - aria.values(("joint3.theta", "joint5.theta")))
    assert moved == pytest.approx([0.6, -0.4], abs=0.01)
    assert found.identifiability.doubts == ()


@pytest.mark.data
def test_poses_of_the_tool_in_place_of_joints_give_camera_and_board_alone(first, tmp_path, shared_data):
    """Real pictures, of whose lens nothing is known: 1.10 px is what OpenCV comes to with poses and lens."""
    source, keys = shared_data / "charuco_poses", ("x", "y", "z", "qw", "qx", "qy", "qz")
    lines = ["image,x[m],y[m],z[m],qw,qx,qy,qz"]
    for k in range(16):
        text = (source / f"poses/{k}.yaml").read_text().strip()
        pairs = dict(line.split(": ") for line in text.split("\n"))
        lines.append(",".join([f"{k}.jpg", *(pairs[key].strip() for key in keys)]))
    (tmp_path / "poses.csv").write_text("\n".join(lines) + "\n")
    for path in (source / "images").iterdir():
        shutil.copy(path, tmp_path)
    board = Charuco((5, 7), 0.036195, 0.018256, "DICT_6X6_250")
    (tmp_path / "target.toml").write_text(target_toml(charuco_target(board, "tool")))
    command = LoadPictures("pics.zip", packed(tmp_path))
    result = command.compute(first)
    session = command.finish(first, result)
    alone = session.part(CameraAlone)
    assert session.measurements.loaded is None
    assert thumbnails(alone.data, session.part(Previews).by_image).count("<img") == 16
    assert alone.found.best.train.own.rms < 1.3
    shown = _identified(alone.found, is_alone=True)
    assert "camera[camera] on the world" in shown
    assert BAD not in shown  # poses of the tool were given: nothing has failed
    name, content = camera_json(session)
    assert name == "camera.json"
    assert json.loads(content)["camera"]["poses"]["camera[camera]"]["mounted"] == "world"
    assert next_step(session).tone is Tone.GOOD
