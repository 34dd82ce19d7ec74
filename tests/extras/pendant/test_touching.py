"""A user with a pointed tool: its tip, its axes, and frames of tables and fixtures, from joints alone."""

import tomllib
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from displays import hidden, poses, random_joints
from refusals import mentions
from round_trip import angle, inverse, placed, read_arm, rows_of, write_table
from scipy.spatial.transform import Rotation

import workbench as wb

TIP = np.array([0.012, -0.034, 0.151])
POINT = np.array([0.45, 0.1, 0.2])
FRAME = placed([0.4, 0.15, 0.05], [0.02, -0.03, 0.6])
NOISE = 3e-5


@pytest.fixture(scope="module")
def arm(tmp_path_factory) -> Path:
    """A UR5e as it is."""
    return hidden("ur5e", tmp_path_factory.mktemp("arm") / "actual.toml")


model = cache(read_arm)
"""A saved arm in plain numpy."""


def tip_at(arm: Path, place, *, seed: int = 0, turn=None, tilt: float = 0.6) -> np.ndarray:
    """Joints with the tip at a place; turned at random, or as given."""
    return solved(arm, tuple(map(float, place)), seed, turn, tilt).copy()


@cache
def solved(arm: Path, place, seed: int, turn, tilt: float) -> np.ndarray:
    """Once for all tests: Newton's steps by differences."""
    rng = np.random.default_rng(seed)
    while True:
        drawn = Rotation.from_rotvec([np.pi, 0, 0]) * Rotation.from_rotvec(rng.normal(0, tilt, 3))
        wanted = drawn if turn is None else turn
        q = np.array([0.3, -1.4, 1.8, -1.9, -1.5, 0.2]) + rng.normal(0, 0.2, 6)
        for _ in range(30):
            pose = model(arm)(rows_of(q + 1e-6 * np.eye(7, 6, -1)))[1]
            turned = (Rotation.from_matrix(pose[:, :3, :3]) * wanted.inv()).as_rotvec()
            off = np.column_stack([pose[:, :3, :3] @ TIP + pose[:, :3, 3] - place, 0.3 * turned])
            if np.linalg.norm(off[0]) < 1e-10:
                return q
            step = np.linalg.solve((off[1:] - off[0]).T / 1e-6, off[0])
            q = q - step * min(1.0, 0.5 / np.linalg.norm(step))


def table(q, contact=None, path: str = "touches.csv") -> Path:
    head = [f"q{k + 1}[deg]" for k in range(len(q[0]))] + (["contact"] if contact else [])
    rows = ([*np.rad2deg(row).round(6), *([contact[k]] if contact else [])] for k, row in enumerate(q))
    return write_table(path, head, rows)


def pivot(arm, count: int, *, seed: int = 1, noise: float = NOISE) -> list[np.ndarray]:
    rng = np.random.default_rng(seed)
    return [tip_at(arm, POINT + rng.normal(0, noise, 3), seed=100 * seed + k) for k in range(count)]


@pytest.mark.parametrize("again", [0, 3])
def test_six_touches_of_a_nail_give_the_tip(told, arm, again):
    """The first is recorded four times, the encoders read to 0.001°: it is one touch."""
    q = pivot(arm, 6)
    table([*q, *(q[0] + 1e-5 * k for k in range(1, 1 + again))])
    Path("touches.csv").write_text(Path("touches.csv").read_text().replace("q", "Motor "))
    options = ("--columns", "q[deg]", "--save", "with_tool.toml")
    found, out = told("tcp", "touches.csv", "--robot", arm, *options)
    assert (found["message"] in " ".join(out.split()), found["reading"]) == (True, "as given")
    off = np.abs(np.array(found["xyz"]) - TIP)
    assert (off < 2.0 * np.array(found["half_width"])).all()
    assert (max(found["half_width"]) < 3e-4, len(found["touches"])) == (True, 6)
    tool = tomllib.loads(Path("with_tool.toml").read_text())["tool"]
    assert tool["xyz"] == pytest.approx(found["xyz"], abs=1e-9)


def test_intervals_hold_the_tip_as_often_as_they_say(arm, tmp_path, monkeypatch):
    """The pivot of plain numpy, 200 times: 95 % of the intervals of each axis hold it."""
    monkeypatch.chdir(tmp_path)
    robot, q = wb.load_robot(arm), np.array([tip_at(arm, POINT, seed=k) for k in range(5)])
    jacobians, rng, inside = [_jacobian(arm, row) for row in q], np.random.default_rng(0), []
    for _ in range(200):
        slack = rng.normal(0, 1e-4, (5, 3, 1))
        moved = q + (np.linalg.pinv(jacobians) @ slack)[..., 0]
        tip = wb.tcp(robot, wb.Dataset(moved, contact=["nail"] * 5))
        if not tip.of.slipped:
            inside.append(np.abs(tip.xyz - TIP) < tip.half)
    assert len(inside) > 190
    assert 0.92 < np.mean(inside) < 0.98


def test_a_tip_in_an_uncertain_flange_says_so(arm):
    """Its interval was 20 times smaller than what the model's own flange was off."""
    rng, robot = np.random.default_rng(0), wb.load_robot(arm)
    robot = robot.with_frames(tool=replace(robot.tool, free="free"))
    q = rng.uniform(-1.0, 1.0, (40, 6))
    at = wb.tool_poses(robot, q)
    rows = wb.Dataset(q=q, position=at[:, :3, 3] + 1e-3 * rng.normal(size=(40, 3)), rotation=at[:, :3, :3])
    touches = wb.Dataset(np.array([tip_at(arm, POINT, seed=k) for k in range(5)]))
    arms = wb.identify(robot, rows).robot, robot
    found = [wb.tcp(each, touches, wanted=1.1 * wb.tcp(each, touches).half.max()) for each in arms]
    assert ["this file only" in each.sentence for each in found] == [True, False]
    assert ["the flange itself is known to" in each.doubt for each in found] == [True, False]


def test_a_scara_tells_where_its_tip_is_across_the_axis_that_it_keeps():
    """It was told to tilt."""
    table = [(0.3, 0.35, 0.0), (0.0, 0.25, np.pi), (0.1, 0.0, 0.0), (0.0, 0.0, 0.0)]
    rows = [{"theta": 0.0, "d": d, "a": a, "alpha": alpha} for d, a, alpha in table]
    robot = wb.Robot.from_dh([*rows[:2], {"type": "prismatic", **rows[2]}, rows[3]], name="scara")
    tool, place, q = np.array([0.05, 0.02, 0.12]), np.array([0.4, 0.1, 0.05]), []
    for turn in np.linspace(-1.2, 1.2, 6):  # the wrist's turn, and joints that reach with it
        c, s = np.cos(turn), np.sin(turn)
        x, y = place[:2] - np.array([[c, s], [s, -c]]) @ tool[:2]
        elbow = np.arccos((x * x + y * y - 0.35**2 - 0.25**2) / (2 * 0.35 * 0.25))
        first = np.arctan2(y, x) - np.arctan2(0.25 * np.sin(elbow), 0.35 + 0.25 * np.cos(elbow))
        q.append([first, elbow, 0.3 - 0.1 - place[2] - tool[2], first + elbow - turn])
    robot = robot.with_frames(tool=replace(robot.tool, xyz=np.array([0.0, 0.0, 0.12])))
    found = wb.tcp(robot, wb.Dataset(np.array(q)))
    np.testing.assert_allclose(found.xyz, tool, atol=1e-9)
    assert np.isnan(found.half).tolist() == [False, False, True]
    assert mentions(found.sentence, "z stays 120.000 mm", "can't tilt")


def _jacobian(arm, q):
    step = 1e-6 * np.eye(6)
    tips = poses(arm, np.concatenate([q + step, q - step]))
    places = tips[:, :3, :3] @ TIP + tips[:, :3, 3]
    return (places[:6] - places[6:]).T / 2e-6


@pytest.mark.parametrize(("count", "slipped", "said"), [(6, [3], "touch 4"), (12, [2, 5, 9], "touches")])
def test_the_touches_that_slipped_are_named_and_left_out(told, arm, count, slipped, said):
    """Three of twelve hid each other, and more touches were asked for."""
    q = pivot(arm, count)
    for k, way in zip(slipped, ([0.0, 0.0015, 0.0], [-5e-3, 2e-3, 0.0], [3e-3, 0.0, -6e-3]), strict=False):
        q[k] = tip_at(arm, POINT + np.array(way), seed=100 + k)
    found, out = told("tcp", table(q), "--robot", arm)
    assert [t["row"] for t in found["touches"] if t["slipped"]] == slipped
    assert mentions(out, said)
    assert np.abs(np.array(found["xyz"]) - TIP).max() < 2e-4


def downwards(*yaws):
    return Rotation.from_euler("zx", [(yaw, np.pi) for yaw in yaws])


@pytest.mark.parametrize(
    ("q", "text", "status"),
    [
        (lambda arm: pivot(arm, 3), "3 touches", 1),
        (lambda arm: [tip_at(arm, POINT, turn=turn) for turn in downwards(0, 0.4, 0.8, 1.2)], "one axis", 1),
        (lambda arm: [tip_at(arm, POINT, turn=turn) for turn in downwards(0, 0, 0, 0)], "kept its orient", 1),
        (lambda arm: np.rad2deg(np.angle(np.exp(1j * np.array(pivot(arm, 6))))), "degrees labelled rad", 1),
        (lambda arm: list(random_joints("ur5e", 6)), "choose the robot", 2),
        (lambda arm: pivot(arm, 4, noise=2e-3), "different orientations", 2),
        (
            lambda arm: pivot(arm, 6) + [q + np.eye(6)[5] for q in pivot(arm, 4, seed=2)],
            "from 7 on are of another tool",
            2,
        ),
        (
            lambda arm: pivot(arm, 6) + [tip_at(arm, 1.01 * POINT, seed=k) for k in range(4)],
            "7 on are of another point",
            2,
        ),
    ],
    ids=[
        "few",
        "turned about one axis",
        "not turned",
        "other units",
        "another arm",
        "loose",
        "two tools",
        "two points",
    ],
)
def test_touches_that_give_no_tip_say_why(run, arm, q, text, status):
    ended, _, err = run("tcp", table(q(arm)), "--robot", arm, "--save", "tool.toml")
    assert ended == status
    assert text in err
    assert len(err.strip().splitlines()) == 1
    assert not Path("tool.toml").exists()


def test_what_is_asked_for_decides_and_says_how_many_more(run, told, arm):
    table(pivot(arm, 5, noise=2e-4))
    found, said = told("tcp", "touches.csv", "--robot", arm, "--wanted", "0.1mm", status=2)
    assert f"add {found['more']} touches" in said or "tilt the tool more" in said
    assert run("tcp", "touches.csv", "--robot", arm, "--wanted", "0mm")[0] == 64
    assert run("tcp", "touches.csv", "--robot", "iiwa7")[0] == 1
    status, _, err = run("tcp", table(pivot(arm, 4), ["a", "b", "a", "b"]), "--robot", arm)
    assert (status, mentions(err, "of 2 points")) == (1, True)
    q = [*pivot(arm, 3), *(tip_at(arm, POINT + 0.02, seed=seed) for seed in (7, 8, 9))]
    found, _ = told("tcp", table(q, [*"aaabbb"]), "--robot", arm)
    assert np.abs(np.array(found["xyz"]) - TIP).max() < 2e-4


# Frames -------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def pointer(arm, tmp_path_factory) -> Path:
    """The arm with its tool's tip."""
    path = tmp_path_factory.mktemp("arm") / "pointer.toml"
    wb.load_robot(arm).with_frames(tool=wb.Frame(TIP)).save(path)
    return path


def touched(arm, places, *, seed: int = 5, noise: float = NOISE) -> list[np.ndarray]:
    """Joints with the tip at places of the frame."""
    rng = np.random.default_rng(seed)
    at = [FRAME[:3, :3] @ np.asarray(p, float) + FRAME[:3, 3] + rng.normal(0, noise, 3) for p in places]
    return [tip_at(arm, place, seed=seed + k, tilt=0.1) for k, place in enumerate(at)]


def frame_of(path: Path) -> np.ndarray:
    found = tomllib.loads(path.read_text())["frame"]
    return placed(found["xyz"], found["rpy"])


METHODS = {
    "three points": (["origin", "x", "xy"], [[0, 0, 0], [0.2, 0, 0], [0.1, 0.15, 0]]),
    "three points, more": (
        ["origin", "x", "xy", "origin", "x", "xy", "xy"],
        [[0, 0, 0], [0.2, 0, 0], [0.1, 0.15, 0], [0, 0, 0], [0.1, 0, 0], [0, 0.2, 0], [0.15, 0.1, 0]],
    ),
    "3-2-1": (
        ["plane", "plane", "plane", "line", "line", "end"],
        [[0.02, 0.03, 0], [0.2, 0.02, 0], [0.1, 0.15, 0], [0.02, 0, -0.01], [0.2, 0, -0.01], [0, 0.1, -0.01]],
    ),
}  # fmt: skip


@pytest.mark.parametrize("method", METHODS)
def test_a_frame_from_touches(told, arm, pointer, method):
    names, places = METHODS[method]
    table(touched(arm, places), names)
    found, _ = told("frame", "touches.csv", "--robot", pointer, "--save", "frame.toml")
    pose = frame_of(Path("frame.toml"))
    assert np.linalg.norm(pose[:3, 3] - FRAME[:3, 3]) < 2e-4
    assert angle(pose[None], FRAME[None])[0] < 1e-3
    assert (found["half_width"][0] is not None) == (method == "three points, more")


CAD = {"A": [0, 0, 0], "B": [0.2, 0, 0], "C": [0.2, 0.12, 0.0], "D": [0, 0.12, 0.02], "E": [0.1, 0.06, 0.04]}


def drawing() -> str:
    rows = (f"{name},{','.join(f'{1e3 * v:g}' for v in place)}" for name, place in CAD.items())
    Path("cad.csv").write_text("\n".join(["point,x[mm],y[mm],z[mm]", *rows]))
    return "cad.csv"


def test_a_fixture_by_the_points_of_its_drawing(told, arm, pointer):
    table(touched(arm, CAD.values()), list(CAD))
    options = ("--cad", drawing(), "--save", "frame.toml")
    found, _ = told("frame", "touches.csv", "--robot", pointer, *options)
    pose = frame_of(Path("frame.toml"))
    local = inverse(pose) @ FRAME
    twist = np.abs([*local[:3, 3], *Rotation.from_matrix(local[:3, :3]).as_rotvec()])
    assert (twist < 2.0 * np.array(found["half_width"])).all()
    tips = [p[:3, :3] @ TIP + p[:3, 3] for p in poses(arm, np.array(touched(arm, CAD.values())))]
    distance = [
        np.linalg.norm((inverse(pose) @ [*tip, 1.0])[:3] - CAD[n]) for tip, n in zip(tips, CAD, strict=True)
    ]
    assert [t["error"] for t in found["touches"]] == pytest.approx(distance, abs=1e-6)


def test_a_point_that_slipped_is_left_out_two_exchanged_and_other_units_are_refused(run, told, arm, pointer):
    places = [*CAD.values(), *CAD.values()]
    q = touched(arm, places)
    q[6] = touched(arm, [[0.2, 0.003, 0.0]])[0]
    table(q, list(CAD) * 2)
    found, _ = told("frame", "touches.csv", "--robot", pointer, "--cad", drawing())
    assert [t["row"] for t in found["touches"] if t["slipped"]] == [6]
    table(touched(arm, CAD.values()), ["A", "C", "B", "D", "E"])
    assert run("frame", "touches.csv", "--robot", pointer, "--cad", drawing())[0] == 2
    table(touched(arm, CAD.values()), list(CAD))
    cad = Path(drawing())
    cad.write_text(cad.read_text().replace("[mm]", "[m]"))
    assert "check the units" in run("frame", "touches.csv", "--robot", pointer, "--cad", cad)[2]


@pytest.mark.parametrize(
    ("names", "text"),
    [
        (["origin", "x", "xy"], "has no tool"),
        (["A", "B", "C"], "name the touches"),
        (None, "name the touches"),
        (["origin", "x", "x"], "do not make a frame"),
    ],
)
def test_touches_that_give_no_frame_say_why(run, arm, pointer, names, text):
    table(touched(arm, METHODS["three points"][1]), names)
    status, _, err = run("frame", "touches.csv", "--robot", arm if "tool" in text else pointer)
    assert (status, len(err.strip().splitlines())) == (1, 1)
    assert text in err


def test_points_on_one_line_are_refused(run, arm, pointer):
    line = table(touched(arm, [[0, 0, 0], [0.1, 0, 0], [0.2, 0, 0]]), ["origin", "x", "xy"])
    assert "one line" in run("frame", line, "--robot", pointer)[2]
    table(touched(arm, METHODS["three points"][1]), ["origin", "x", "xy"])
    assert run("frame", "touches.csv", "--robot", pointer, "--wanted", "0.1mm")[0] == 2
