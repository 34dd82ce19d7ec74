"""A camera's projection against a plain one, and the files of cameras and targets."""

import camera_arms as virtual
import numpy as np
import pytest
from refusals import refuses

from workbench.base.errors import DataError, FileError
from workbench.extras.camera.camera import project, read_cameras
from workbench.extras.camera.pixel_table import read_pixels
from workbench.extras.camera.rig import Rig
from workbench.extras.camera.target import Charuco, charuco_target, read_targets, target_toml

K = np.array([900.0, 905.0, 640.0, 500.0, -0.12, 0.05, 0.002, -0.001, 0.01])
CAMERA = """[[camera]]
name = "cell"
size = [1280, 1000]
fx = 900.0
fy = 905.0
cx = 640.0
cy = 500.0
distortion = [-0.12, 0.05, 0.002, -0.001, 0.01]
mounted = "world"
free = "auto"
"""
POINTS = np.random.default_rng(0).uniform([-0.3, -0.3, 0.7], [0.3, 0.3, 1.5], (20, 3))
BOARD = Charuco((5, 4), 0.03, 0.02, "DICT_6X6_250")


def camera(tmp_path, text=CAMERA):
    (tmp_path / "camera.toml").write_text(text)
    return read_cameras(tmp_path / "camera.toml")


def table(tmp_path, rows, name="pixels.csv"):
    (tmp_path / name).write_text("\n".join(rows) + "\n")
    return tmp_path / name


def test_projection_is_that_of_the_formula():
    assert project(POINTS, K).pixel == pytest.approx(virtual.pixels(POINTS, K[:4], K[4:]), abs=1e-9)
    assert project(POINTS[:0], K).by_intrinsics.shape == (0, 2, 9)


def targets(tmp_path, text):
    (tmp_path / "target.toml").write_text(text)
    return read_targets(tmp_path / "target.toml")


BOARDS = """mounted = "world"
[[board]]
charuco = { squares = [5, 4], square = 0.03, marker = 0.02 }
[[board]]
name = "right"
charuco = { squares = [4, 4], square = 0.03, marker = 0.02 }
scale_sigma = 0.001
[[board]]
name = "tag"
point = [
    { id = 40, corner = 0, xyz = [0, 0, 0] }, { id = 40, corner = 1, xyz = [0.1, 0, 0] },
    { id = 40, corner = 2, xyz = [0.1, 0.1, 0] }, { id = 40, corner = 3, xyz = [0, 0.1, 0] },
]
"""


def test_boards_of_one_file_have_numbers_of_their_own(tmp_path):
    found = targets(tmp_path, BOARDS)
    assert [t.owner for t in found] == ["target[board1]", "target[right]", "target[tag]"]
    assert [t.ids[0] for t in found] == [0, 12, 40]
    assert [t.charuco.first_marker for t in found[:2]] == [0, 10]
    assert [t.scale_sigma for t in found] == [0.002, 0.001, 0.0005]
    (again,) = targets(tmp_path, target_toml(found[1]))
    assert again.charuco == found[1].charuco


def board(name, more="", head=""):
    return (
        f'[[board]]\nname = "{name}"\n{head}'
        f"charuco = {{ squares = [4, 4], square = 0.03, marker = 0.02{more} }}\n"
    )


def tag(number, dictionary="DICT_6X6_1000"):
    corners = (f"{{ id = {number}, corner = {k}, xyz = [{k % 2}, {k // 2}, 0] }}" for k in range(4))
    return f'[[board]]\nname = "tag"\ndictionary = "{dictionary}"\npoint = [{", ".join(corners)}]\n'


@pytest.mark.parametrize(
    ("tables", "firsts", "named"),
    [
        (board("A", ", first_marker = 20") + board("B", ", first_marker = 0"), [20, 0], ""),
        (board("A", ", first_marker = 9") + board("B", ", first_marker = 3"), None, "marker 9 is of"),
        (tag(5) + board("A", ", first_marker = 0"), None, "marker 5 is of"),
        (board("A") + tag(8, "DICT_5X5_50"), None, "tags first"),
    ],
)
def test_markers_of_one_dictionary_are_counted_over_boards_and_tags(tmp_path, tables, firsts, named):
    """Whatever its size: DICT_6X6_250 and DICT_6X6_1000 print a number alike."""
    text = f'mounted = "world"\ndictionary = "DICT_6X6_250"\n{tables}'
    if firsts is None:
        with pytest.raises(FileError, match=named):
            targets(tmp_path, text)
    else:
        found = [t for t in targets(tmp_path, text) if t.charuco is not None]
        assert [t.charuco.first_marker for t in found] == firsts
        assert found[0].charuco.dictionary == "DICT_6X6_250"


@pytest.mark.parametrize(
    ("text", "old", "new", "named"),
    [
        (BOARDS, 'name = "right"', 'name = "board1"', "'board1'"),
        (BOARDS, "id = 40, corner = 1", "id = 3, corner = 0", "id 3 corner 0 is of 'board1' and 'tag'"),
        (BOARDS, 'name = "tag"', "colour = 3", "colour"),
        (CAMERA, "fx = 900.0\n", "", "fx"),
        (CAMERA, '"world"', '"ceiling"', "mounted"),
        (CAMERA, CAMERA, "image_width: 640\ncamera_name: head\n", "size, fx, fy, cx, cy, distortion"),
    ],
)
def test_cameras_and_targets_that_can_not_be_are_refused(tmp_path, text, old, new, named):
    with pytest.raises(FileError, match=named):
        (targets if text is BOARDS else camera)(tmp_path, text.replace(old, new))


def test_a_table_of_pixels_becomes_a_row_a_picture(tmp_path):
    rig = Rig(camera(tmp_path), (charuco_target(BOARD, "tool"),))
    pixels = [f"shots/{i:02}.png,{k},{100 + 9 * k},{200.5 + k}" for i in (2, 10) for k in range(6)]
    source = table(tmp_path, ["image,id,u[px],v[px]", *pixels])
    joints = table(tmp_path, ["image,q1[deg],q2[deg]", "10,90,0", "2,45,10", "3,1,1"], "joints.csv")
    data = read_pixels(source, rig, joints=joints)
    assert data.readings.image.tolist() == ["10", "2", "3"]
    assert np.rad2deg(data.q[0]) == pytest.approx([90.0, 0.0])
    assert np.isfinite(data.readings.pixels[..., 0]).sum((1, 2)).tolist() == [6, 6, 0]
    assert data.readings.pixels[1, 0, 3] == pytest.approx([127.0, 203.5])
    assert data.included.tolist() == [True, True, False]
    assert any("1 of 3" in note and "'3'" in note for note in data.notes)
    more = table(tmp_path, ["image,q1[deg],q2[deg]", *(f"{k},{k},{k}" for k in range(2, 12))], "more.csv")
    with refuses(DataError, "8 of 10 rows of more.csv", "'3', '4', '5', '6', '7' and 3 more"):
        read_pixels(source, rig, joints=more)


POSE = "x[m],y[m],z[m],rx[rad],ry[rad],rz[rad]"


@pytest.mark.parametrize("given", [POSE, "x[m],y[m],z[m]", "x[m]", "m1x[mm],m1y[mm],m1z[mm]"])
def test_pixels_are_what_was_measured_whatever_stands_beside_the_joints(tmp_path, given):
    """Logs have the controller's own pose there."""
    rig, cells = Rig(camera(tmp_path), (charuco_target(BOARD, "tool"),)), ",1" * (1 + given.count(","))
    pixels = [f"{i},{k},{100 + 9 * k},{200.5 + k}" for i in (2, 10) for k in range(6)]
    source = table(tmp_path, ["image,id,u[px],v[px]", *pixels])
    joints = table(tmp_path, [f"image,q1[deg],{given}", f"10,90{cells}", f"2,45{cells}"], "joints.csv")
    rows = [f"{row},{90 if row[0] == '1' else 45}{cells}" for row in pixels]
    whole = table(tmp_path, [f"image,id,u[px],v[px],q1[deg],{given}", *rows], "whole.csv")
    for data in (read_pixels(source, rig, joints=joints), read_pixels(whole, rig)):
        assert data.position is data.rotation is data.markers is data.written is None
        assert data.readings.seen.any((1, 2)).all()
        assert sum(given.split(",")[0] in note and "left out" in note for note in data.notes) == 1


def test_pictures_and_joints_that_do_not_belong_together_are_refused(tmp_path):
    rig = Rig(camera(tmp_path), (charuco_target(BOARD, "tool"),))
    source = table(tmp_path, ["image,id,u[px],v[px]", "1,0,5,6", "2,0,5,6"])
    with refuses(DataError, found=(1, 2)):
        read_pixels(source, rig, joints=table(tmp_path, ["q1[deg]", "3"], "a.csv"))
    huge = table(tmp_path, ["image,id,u[px],v[px]", f"1,{10**30},5,6"], "huge.csv")
    with refuses(FileError, 10**30, line=2, column="id"):
        read_pixels(huge, rig)
    with refuses(DataError, column="image", found=("2",)):
        read_pixels(source, rig, joints=table(tmp_path, ["image,q1[deg]", "1,3"], "b.csv"))
    strange = table(tmp_path, ["image,id,u[px],v[px]", "1,57,1,1"], "strange.csv")
    with refuses(DataError, "12 inner corners", column="id", found=57):
        read_pixels(strange, rig, joints=table(tmp_path, ["image,q1[deg]", "1,3"], "c.csv"))
    with refuses(DataError, column="mounted", found="world"):
        Rig(camera(tmp_path), (charuco_target(BOARD, "world"),))
