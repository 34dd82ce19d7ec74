"""Files made from a board: what they say comes back; pictures with their joints alone lead to the zeros."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from refusals import refuses

from workbench.base.errors import DataError
from workbench.extras.camera.findings import Identifiability
from workbench.extras.camera.folder import packed
from workbench.extras.camera.markers import likely_board
from workbench.extras.camera.panels import _identified, camera_json
from workbench.extras.camera.picture_html import thumbnails
from workbench.extras.camera.printed import Board
from workbench.extras.camera.session_commands import CameraAlone, LoadPictures, Previews
from workbench.extras.camera.target import prints_of
from workbench.identification.identify import identify
from workbench.session.journal.codec import decode, encode
from workbench.session.judgement import Tone
from workbench.session.next_step import next_step
from workbench.views.page.html import BAD

cv2 = pytest.importorskip("cv2")


def test_pictures_and_joints_alone_lead_to_the_zeros(aria, first, tmp_path):
    """Nothing is known of the lens, whose focal length is 780 px in pictures of 640 px."""
    from board_on_tool import photograph

    shots = tmp_path / "shots"
    shots.mkdir()
    photograph(aria, np.deg2rad([0.0, 0.0, 0.6, 0.0, -0.4, 0.0]), shots, count=16)
    for name in ("camera", "target"):
        (shots / f"{name}.toml").unlink()
    content = Path(shutil.make_archive(str(tmp_path / "shots"), "zip", tmp_path, "shots")).read_bytes()
    session = first
    with refuses(DataError, "shots", "target.toml"):
        LoadPictures("shots.zip", content).compute(session)
    command = LoadPictures("shots.zip", content, Board(square=0.030))
    assert decode("LoadPictures", *_written(command)) == command
    session = command.finish(session, command.compute(session))
    assert any("lens is identified" in note for note in session.measurements.loaded.notes)
    shown = thumbnails(session.measurements.loaded.dataset, session.part(Previews))
    assert len(shown) == 16
    found = identify(aria, session.measurements.loaded.dataset)
    assert isinstance(found.identifiability, Identifiability)
    assert found.identifiability.title == "joint zeros"
    moved = found.best.fit.calibrated.values(("joint3.theta", "joint5.theta"))
    moved = np.rad2deg(moved - aria.values(("joint3.theta", "joint5.theta")))
    assert moved == pytest.approx([0.6, -0.4], abs=0.01)
    assert found.identifiability.doubts == ()


@pytest.mark.parametrize("legacy", [False, True])
@pytest.mark.parametrize(
    ("squares", "dictionary", "marker"),
    [((5, 7), "DICT_6X6_250", 0.75), ((8, 6), "DICT_4X4_50", 0.5), ((9, 14), "DICT_5X5_100", 0.6)],
)
def test_squares_and_markers_are_counted_in_pictures(squares, dictionary, marker, legacy):
    found = likely_board(Board(square=0.02).charuco, [*_pictures(squares, dictionary, marker, legacy)])
    assert (found.squares, found.square) == (squares, 0.02)
    assert prints_of(found.dictionary) == prints_of(dictionary)
    assert found.marker / found.square == pytest.approx(marker, abs=0.05)


def test_a_board_of_which_one_row_is_seen_is_not_guessed(tmp_path):
    row = [picture[:205] for picture in _pictures((14, 9), "DICT_6X6_250", 0.75, False, around=0.0)]
    for k, picture in enumerate(row):
        cv2.imwrite(str(tmp_path / f"{k}.png"), picture)
    with pytest.raises(DataError, match="how many squares"):
        Board().fill_in(tmp_path)
    assert not (tmp_path / "target.toml").exists()


def _pictures(squares, dictionary, marker, legacy, around=0.1):
    """Three of a board, each from another side."""
    prints = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, dictionary))
    board = cv2.aruco.CharucoBoard(squares, 1.0, marker, prints)
    board.setLegacyPattern(legacy)
    sheet = cv2.copyMakeBorder(
        board.generateImage((60 * squares[0], 60 * squares[1])), *4 * [60], 0, value=255
    )
    size, rng = np.array(sheet.shape[::-1]), np.random.default_rng(3)
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) * size
    for _ in range(3):
        seen = 80 + corners + around * rng.uniform(-1.0, 1.0, (4, 2)) * size
        turn = cv2.getPerspectiveTransform(corners.astype(np.float32), seen.astype(np.float32))
        yield cv2.warpPerspective(sheet, turn, tuple(int(n) + 160 for n in size), borderValue=127)


def _written(command):
    fields, files = encode(command)
    return fields, files.__getitem__


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
    command = LoadPictures("pics.zip", packed(tmp_path), Board(9, 9, 0.036195))  # 5 × 7 are counted
    result = command.compute(first)
    session = command.finish(first, result)
    alone = session.part(CameraAlone)
    assert session.measurements.loaded is None
    assert len(thumbnails(alone.data, alone.previews)) == 16
    assert alone.found.best.train.own.rms < 1.3
    shown = _identified(alone.found, is_alone=True)
    assert "camera[camera] on the world" in shown
    assert BAD not in shown  # poses of the tool were given: nothing has failed
    name, content = camera_json(session)
    assert name == "camera.json"
    assert json.loads(content)["camera"]["poses"]["camera[camera]"]["mounted"] == "world"
    assert next_step(session).tone is Tone.GOOD
