"""From a folder of pictures to a calibrated arm, and every way in which a folder can be wrong."""

import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from board_on_tool import photograph
from documented_commands import run_lines
from PIL import Image
from refusals import mentions

cv2 = pytest.importorskip("cv2")
SHIFTS = np.deg2rad([0.0, 0.0, 0.6, 0.0, -0.4, 0.0])
WITH = ("--camera", "camera.toml", "--target", "target.toml")


@pytest.fixture(scope="module")
def pictures(tmp_path_factory, aria):
    folder = tmp_path_factory.mktemp("pictures")
    photograph(aria, SHIFTS, folder, count=10)
    return folder


@pytest.fixture
def here(pictures, tmp_path):
    shutil.copytree(pictures, tmp_path, dirs_exist_ok=True)
    return tmp_path


@pytest.mark.slow
def test_the_commands_of_the_page_on_cameras(run, here):
    """As they are shown, on this folder; its table of corners is not here."""
    text = (Path(__file__).parents[3] / "assets/docs/camera.md").read_text(encoding="utf-8")
    text = text.replace("\\\n", " ").replace("PICTURES", ".").replace("--robot R ", "--robot aria ")
    lines = re.findall(r"^workbench .*", text, re.MULTILINE)
    assert len(lines) == 6
    photographed = (here / "target.toml").read_bytes()
    (here / "target.toml").unlink()  # that of another target is not written over
    run_lines(run, (line for line in lines if "board" in line))
    (here / "target.toml").write_bytes(photographed)  # `board` wrote that of the print
    run_lines(run, (line for line in lines if "--joints" in line))
    assert (here / "board.pdf").is_file()
    assert (here / "arm.toml").is_file()


def test_the_joints_that_moved_are_named_from_pictures(run, here):
    options = ("--robot", "aria", *WITH, "--joints", "joints.csv", "--json", "r.json")
    status, _, err = run("rezero", ".", *options)
    assert (status, err) == (0, "")
    joints = json.loads((here / "r.json").read_text())["joints"]
    assert [j["joint"] for j in joints if j["moved"]] == [3, 5]
    assert [j["joint"] for j in joints if j["interval"] is None] == [1, 6]
    for joint, shift in ((3, SHIFTS[2]), (5, SHIFTS[4])):
        low, high = joints[joint - 1]["interval"]
        assert low - 1e-4 < shift < high + 1e-4


def _drop_joints(folder):
    lines = (folder / "joints.csv").read_text().splitlines()
    (folder / "joints.csv").write_text("\n".join(lines[:-2]) + "\n")


def _half(folder):
    for path in folder.glob("*.png"):
        cv2.imwrite(str(path), cv2.imread(str(path), 0)[::2, ::2])


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (_drop_joints, "have no joints"),
        (_half, "the picture has 320 x 240 px, camera 'cell' has size = [640, 480]"),
        (lambda f: [p.write_text("no picture") for p in f.glob("*.png")], "can't be read as a picture"),
        (lambda f: [(f / f"{k}.png").unlink() for k in range(6)], "6 of 10 rows of joints.csv"),
    ],
)
def test_what_is_wrong_with_pictures_is_said_in_one_sentence(run, here, spoil, message):
    spoil(here)
    options = ("--robot", "aria", *WITH, "--joints", "joints.csv", "--save", "arm.toml")
    status, _, err = run("identify", ".", *options)
    assert status == 1
    assert message in err
    assert err.count("\n") == 1
    assert not (here / "arm.toml").exists()


def test_what_a_folder_may_be(run, here):
    """One picture is broken, one has an EXIF orientation, all are a folder down."""
    (here / "3.png").write_text("no picture")
    inside = here / "all" / "shots"
    inside.mkdir(parents=True)
    for path in here.glob("*.png"):
        path.rename(inside / path.name)
    turned = Image.open(inside / "5.png")
    turned.getexif()[0x0112] = 3
    turned.save(inside / "5.png", exif=turned.getexif())
    shutil.copy(here / "joints.csv", here / "all")
    options = ("--robot", "aria", *WITH, "--algorithm", "opt2", "--json", "r.json")
    status, out, err = run("identify", "all", *options)
    out = " ".join(out.split())
    assert (status, err) == (0, "")
    assert mentions(out, "9 pictures")
    assert re.search(r"1 picture left out, '?3\.png'?: can't be read", out)
    found = json.loads((here / "r.json").read_text())["algorithms"]["opt2"]["parameters"]
    moved = [p["name"] for p in found if ".theta" in p["name"] and abs(p["value"] - p["nominal"]) > 1e-3]
    assert moved == ["joint3.theta", "joint5.theta"]
