"""Printed boards are as large as they say; their corners are found in pictures, other boards are named."""

import re
from dataclasses import replace

import numpy as np
import pytest
from refusals import mentions
from rendered_boards import looking_at, render

from workbench.base.errors import DataError
from workbench.base.types import Freedom
from workbench.extras.camera.camera import Camera, Mount, project
from workbench.extras.camera.corner_detection import BoardFinder, find_corners, printed_sheet
from workbench.extras.camera.rig import Rig
from workbench.extras.camera.target import Charuco, PictureTarget, charuco_target, read_targets

cv2 = pytest.importorskip("cv2")
BOARD = Charuco((5, 7), 0.03, 0.022, "DICT_5X5_250")
LENS = np.array([520.0, 522.0, 318.0, 242.0, -0.12, 0.03, 1e-3, -5e-4, 0.0])
CAMERA = Camera(name="cell", size=(640, 480), intrinsics=LENS, free=Freedom.FIXED, sigma=np.ones(9))
VIEWS = [((0.02, 0.05, -0.3), 0.0), ((0.2, 0.1, -0.28), 0.2), ((0.07, 0.32, -0.26), -0.4)]
DOT = 0.25e-3


def printed(board=BOARD, *, older=False):
    """The board as OpenCV itself draws it, at DOT a dot, or as it did before 4.6."""
    drawn = cv2.aruco.CharucoBoard(
        *(board.squares, board.square, board.marker),
        *(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_250), np.array(board.markers)),
    )
    drawn.setLegacyPattern(older)
    return drawn.generateImage(tuple(round(n * board.square / DOT) for n in board.squares))


def view(paper, k, eye, at, roll):
    pose = looking_at(np.array(eye), np.array(at), roll)
    return pose, render(paper, DOT, pose, LENS, CAMERA.size, rng=np.random.default_rng(k))


def test_boards_that_older_programs_printed_are_read():
    """43 pictures of such a board were said to show the markers of another one."""
    board = Charuco((5, 6), 0.03, 0.022, "DICT_5X5_250")
    for older in (True, False):
        finder = BoardFinder.of([charuco_target(board, "world")], [paper := printed(board, older=older)])
        assert len(finder.find(paper)[0]) == 20
        assert len(finder.notes) == older


@pytest.fixture(scope="module")
def pictures():
    return [view(printed(), k, eye, (0.075, 0.105, 0.0), roll) for k, (eye, roll) in enumerate(VIEWS)]


def test_corners_are_found_to_a_tenth_of_a_pixel(pictures, tmp_path):
    for k, (_, picture) in enumerate(pictures):
        cv2.imwrite(str(tmp_path / f"{k}.png"), picture)
    target = charuco_target(BOARD, "tool")
    found, _ = find_corners(tmp_path, Rig((CAMERA,), (target,)))
    assert found.rows > 60
    assert found.notes[0] == f"{found.rows} corners in 3 pictures"
    poses = np.stack([pictures[int(name[0])][0] for name in found.values["image"]])
    points = target.points[found.values["id"].astype(int)]
    there = np.einsum("nij,nj->ni", poses[:, :3, :3], points) + poses[:, :3, 3]
    off = found.stacked(("u", "v")) - project(there, LENS).pixel
    assert np.sqrt((off**2).mean()) < 0.12
    assert np.abs(off.mean(0)).max() < 0.05


@pytest.mark.parametrize(
    ("spoil", "reason"),
    [
        (lambda p: cv2.GaussianBlur(p, (0, 0), 5.0), "in view, sharp, lit"),
        (lambda p: p[:, ::-1].copy(), "0 markers of DICT_5X5_250: .* not mirrored"),
    ],
)
def test_pictures_without_the_board_say_why(pictures, tmp_path, spoil, reason):
    rig = Rig((CAMERA,), (charuco_target(BOARD, "tool"),))
    cv2.imwrite(str(tmp_path / "9.png"), spoil(pictures[0][1]))
    with pytest.raises(DataError, match=reason):
        find_corners(tmp_path, rig)
    cv2.imwrite(str(tmp_path / "10.png"), pictures[0][1])
    notes = find_corners(tmp_path, rig)[0].notes
    assert any(re.search(reason, note) and "'9.png'" in note for note in notes)


@pytest.mark.parametrize(
    ("board", "reason"),
    [
        (replace(BOARD, squares=(6, 7)), "6 x 7"),
        (replace(BOARD, dictionary="DICT_6X6_250"), "markers? of DICT_6X6_250 and more of DICT_5X5_250"),
    ],
)
def test_another_board_is_named(pictures, tmp_path, board, reason):
    cv2.imwrite(str(tmp_path / "0.png"), pictures[0][1])
    with pytest.raises(DataError, match=reason):
        find_corners(tmp_path, Rig((CAMERA,), (charuco_target(board, "tool"),)))


def test_several_boards_are_told_apart_by_their_markers(tmp_path):
    """Two of the same size side by side; the third is not in view, and that is said."""
    markers, inner = 17, 24
    boards = [replace(BOARD, first_marker=k * markers) for k in range(3)]
    targets = tuple(
        charuco_target(board, "tool", name=name, first=k * inner)
        for k, (board, name) in enumerate(zip(boards, "ABC", strict=True))
    )
    gap = 60
    left, right = printed(boards[0]), printed(boards[1])
    paper = np.hstack([left, np.full((len(left), gap), 255, np.uint8), right])
    pose, picture = view(paper, 0, (0.17, 0.3, -0.32), (0.17, 0.105, 0.0), 0.1)
    cv2.imwrite(str(tmp_path / "0.png"), picture)
    rig = Rig((CAMERA,), targets)
    found, _ = find_corners(tmp_path, rig)
    ids, corners = (found.values[key].astype(int) for key in ("id", "corner"))
    points = np.concatenate([t.points for t in targets])[rig.points_named(ids, corners)]
    points = points + (ids >= inner)[:, None] * [0.15 + gap * DOT, 0.0, 0.0]
    there = points @ pose[:3, :3].T + pose[:3, 3]
    off = np.linalg.norm(project(there, LENS).pixel - found.stacked(("u", "v")), axis=1)
    assert np.sqrt((off**2).mean()) < 0.15
    assert any("'C'" in note for note in found.notes)
    both, _ = BoardFinder.of(targets[1:2]).find(picture)
    assert set(both[:, 0].tolist()) <= set(range(inner, 2 * inner))


def test_the_sheet_is_the_board_at_its_true_size():
    page, (name, width, _) = printed_sheet(BOARD)
    dots = 25.4 * page.width / width / 3.0
    picture = np.asarray(page.convert("L").reduce(3))
    target = charuco_target(BOARD, "tool")
    found, _ = BoardFinder.of([target]).find(picture)
    assert len(found) == len(target)
    mm = found[:, 2:] * 25.4 / dots
    drawn = 1e3 * target.points[Rig((), (target,)).points_named(*found[:, :2].astype(int).T), :2]
    assert mm - mm[0] == pytest.approx(drawn - drawn[0], abs=0.03)
    assert name == "A4"


def test_tags_are_found_by_their_points_and_by_any_dictionary():
    """Three side by side, their corners clockwise from the upper left one."""
    square = np.array([[0.0, 0.0, 0.0], [0.03, 0.0, 0.0], [0.03, 0.03, 0.0], [0.0, 0.03, 0.0]])
    points = np.concatenate([square + np.array([x, 0.0, 0.0]) for x in (0.01, 0.06, 0.11)])
    names = {"ids": np.repeat(np.arange(3), 4), "corners": np.tile(np.arange(4), 3)}
    target = PictureTarget(mounted=Mount.TOOL, points=points, dictionary="DICT_5X5_250", **names)
    paper = np.full((200, 600), 255, np.uint8)
    tags = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_250)
    for k, x in enumerate((0.01, 0.06, 0.11)):
        left = round(x / DOT)
        paper[40:160, left : left + 120] = cv2.aruco.generateImageMarker(tags, k, 120)
    found, _ = BoardFinder.of([target]).find(paper)
    drawn = 1e3 * target.points[Rig((), (target,)).points_named(*found[:, :2].astype(int).T), :2]
    assert len(found) == 12
    assert 1e3 * DOT * (found[:, 2:] - found[0, 2:]) == pytest.approx(drawn - drawn[0], abs=0.1)
    finder = BoardFinder.of([replace(target, dictionary="")], [paper])
    assert finder.targets[0].dictionary.startswith("DICT_5X5")


def test_the_command_writes_board_and_target(run, tmp_path):
    options = ("--squares", "6x4", "--square", "25mm", "--mounted", "world")
    status, out, _ = run("board", "--out", "b.pdf", *options)
    assert status == 0
    assert mentions(out, "6 × 4", "25 mm")
    (target,) = read_targets(tmp_path / "target.toml")
    assert target.charuco == Charuco((6, 4), 0.025, 0.0188, "DICT_6X6_250")
    assert (tmp_path / "b.pdf").stat().st_size > 2000
    status, _, message = run("board", "--out", "c.pdf", "--squares", "5x7")
    assert status != 0
    assert "describes another target" in message
    assert read_targets(tmp_path / "target.toml")[0].charuco == target.charuco


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--squares", "5"], "squares must be like 5x7"),
        (["--squares", "40x40", "--square", "8mm", "--dictionary", "DICT_4X4_50"], "needs 800 markers"),
        (["--square", "300mm"], "larger than A1"),
        (["--marker", "40mm"], "markers smaller than its squares"),
    ],
)
def test_impossible_boards_are_refused_in_a_sentence(run, tmp_path, options, message):
    status, _, err = run("board", "--out", "b.pdf", *options)
    assert status == 64
    assert message in err
    assert err.count("\n") == 1
    assert not list(tmp_path.glob("*.pdf"))
