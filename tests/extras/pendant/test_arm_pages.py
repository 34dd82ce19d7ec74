"""Each arm's page, as its reader would follow it: on virtual displays, trackers and sockets."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from displays import fill_in, hidden, model_error, poses
from documented_commands import commands, run_lines
from round_trip import aligned, placed, read_arm, rows_of
from scipy.spatial.transform import Rotation

import workbench as wb

ARMS = Path(__file__).resolve().parents[3] / "assets" / "docs" / "arms"
Makers = dict[str, Callable[[], object]]
HIDDEN = Path("hidden.toml")
REFLECTOR = placed([0.05, 0.12, 0.08], [0.0, 0.0, 0.0])
STATION = placed([2.1, -0.4, 0.3], [0.01, 0.02, 1.2])
UR5E = [
    (0.1625, 0, np.pi / 2),
    (0, -0.425, 0),
    (0, -0.3922, 0),
    (0.1333, 0, np.pi / 2),
    (0.0997, 0, -np.pi / 2),
    (0.0996, 0, 0),
]
"""d, a [m] and alpha [rad] of Universal Robots' table."""
KUKA = [
    (0, 400, 25, -90),
    (0, 0, 455, 0),
    (-90, 0, 35, -90),
    (0, 420, 0, 90),
    (0, 0, 0, -90),
    (180, 80, 0, 0),
]
"""theta [deg], d, a [mm] and alpha [deg] of the page's arm, whose axes 1, 4 and 6 turn the other way."""
WELD = "DEF weld()\nPTP {A1 10.00,A2 -80.00,A3 95.00,A4 15.00,A5 40.00,A6 20.00} ; seam\nEND\n"
PICK = "def pick():\n  movej([0.1, -1.2, 1.5, -1.9, -1.5, 0.3], a=1.4, v=1.0)  # above\nend\n"


def follow(page: str, run, makers: Makers) -> None:
    """Run a page's commands; what the reader provides is made before the first command that reads it."""
    text = (ARMS / f"{page}.md").read_text(encoding="utf-8")
    waiting = dict(makers)
    if table := re.search(r"```text\n((?:type|theta).*?)```", text, re.DOTALL):
        Path({"cobot": "cobot.csv", "industrial": "kr6.csv"}[page]).write_text(table[1])
    for line in commands(text):
        parts = line.split()
        for name in [name for name in waiting if name in parts and parts[parts.index(name) - 1] != "--out"]:
            waiting.pop(name)()
        run_lines(run, [line])
    assert not waiting


def chain(rows) -> np.ndarray:
    """Product of standard Denavit–Hartenberg matrices of theta, d, a, alpha [rad, m]."""
    pose = np.eye(4)
    for theta, d, a, alpha in rows:
        step = np.eye(4)
        step[:3, :3] = Rotation.from_euler("ZX", [theta, alpha]).as_matrix()
        step[:3, 3] = a * np.cos(theta), a * np.sin(theta), d
        pose = pose @ step
    return pose


def display(robot: str, style: str) -> Makers:
    """The planned form as the controller of a calibrated arm fills it in."""
    return {"form.csv": lambda: fill_in(Path("form.csv"), hidden(robot, HIDDEN, seed=3), style=style)}


def joints(count: int, seed: int) -> np.ndarray:
    low, high = np.deg2rad([[-120, -130, 30, -150, -100, -170], [120, -40, 130, 150, 100, 170]])
    return np.random.default_rng(seed).uniform(low, high, (count, 6))


def seen(q: np.ndarray) -> np.ndarray:
    """Places of the reflector on the hidden arm in the tracker's frame [m]."""
    return (STATION @ poses(HIDDEN, q, REFLECTOR))[:, :3, 3]


def track(robot: str) -> None:
    """60 rows of a tracker with 0.02 mm of noise, and a hidden arm with errors of 0.5 mm and 1 mrad."""
    hidden(robot, HIDDEN, seed=5, length=5e-4, angle=1e-3)
    q = joints(60, 1)
    places = seen(q) + np.random.default_rng(2).normal(0.0, 2e-5, (60, 3))
    head = ",".join([*(f"q{k}[deg]" for k in range(1, 7)), "x[mm]", "y[mm]", "z[mm]"])
    np.savetxt(
        "tracker.csv", np.hstack([np.rad2deg(q), 1e3 * places]), delimiter=",", header=head, comments=""
    )


def off(calibrated: str) -> float:
    """Mean distance of the reflector from where a calibrated arm expects it, at fresh poses [m]."""
    q = joints(40, 9)
    return float(np.linalg.norm(read_arm(Path(calibrated))(rows_of(q))[1][:, :3, 3] - seen(q), axis=1).mean())


@pytest.mark.parametrize(
    ("page", "robot", "style", "saved"),
    [
        ("franka", "fr3", "x y z", "mine.toml"),
        pytest.param("xarm", "xarm6", "x y z", "mine.toml", marks=pytest.mark.slow),
        pytest.param("cobot", "cobot.toml", "z y' z''", "mine.toml", marks=pytest.mark.slow),
    ],
)
def test_the_controller_is_asked_for_its_model(page, robot, style, saved, run):
    follow(page, run, display(robot, style))
    assert model_error(Path(saved), HIDDEN, joints_of(saved)).mean() < 5e-5
    assert model_error(Path("mine.urdf"), HIDDEN, joints_of(saved)).mean() < 5e-5


def joints_of(robot: str) -> np.ndarray:
    """Joint positions anywhere within an arm's limits."""
    low, high = wb.load_robot(robot).search_limits.T
    return np.random.default_rng(8).uniform(low, high, (200, len(low)))


@pytest.mark.slow
def test_ur_by_file_by_pendant_and_by_tracker(run):
    deltas = np.random.default_rng(4).normal(0.0, [1e-3, 5e-4, 5e-4, 1e-3], (6, 4))
    deltas[2:3, 2] = 0.0
    names = ("theta", "d", "a", "alpha")
    conf = [
        f"delta_{n} = [ {', '.join(map(repr, map(float, c)))}]" for n, c in zip(names, deltas.T, strict=True)
    ]
    Path("calibration.conf").write_text("\n".join(["[mounting]", *conf, ""]))
    pendant: list[float] = []

    def script() -> None:
        pendant.append(
            float(model_error(Path("pendant.toml"), Path("pendant-hidden.toml"), joints_of("ur5e")).mean())
        )
        Path("pick.script").write_text(PICK)

    def form() -> None:
        fill_in(Path("form.csv"), hidden("ur5e", Path("pendant-hidden.toml"), seed=3))

    makers = {"form.csv": form, "tracker.csv": lambda: track("factory.toml"), "pick.script": script}
    follow("ur", run, makers)
    table = np.column_stack([np.zeros(6), UR5E]) + deltas
    for q in joints(5, 3):
        expected = chain([(t + v, d, a, alpha) for (t, d, a, alpha), v in zip(table, q, strict=True)])
        np.testing.assert_allclose(poses(Path("factory.toml"), q[None])[0], expected, atol=1e-9)
        np.testing.assert_allclose(poses(Path("factory.urdf"), q[None])[0], expected, atol=1e-6)
    assert pendant[0] < 5e-5
    assert off("measured.toml") < 5e-5
    assert Path("pick_corrected.script").read_text() != PICK


@pytest.mark.slow
def test_an_industrial_arm_with_a_tracker(run):
    makers = {"tracker.csv": lambda: track("kr6.toml"), "weld.src": lambda: Path("weld.src").write_text(WELD)}
    follow("industrial", run, makers)
    signs = np.array([-1, 1, 1, -1, 1, -1])
    scale = np.array([np.pi / 180, 1e-3, 1e-3, np.pi / 180])
    for q in joints(5, 3):
        rows = np.array(KUKA) * scale + np.outer(signs * q, [1, 0, 0, 0])
        np.testing.assert_allclose(poses(Path("kr6.toml"), q[None])[0], chain(rows), atol=1e-9)
    assert off("calibrated.toml") < 5e-5
    number = r"-?\d+\.\d+"
    corrected = Path("weld_corrected.src").read_text()
    assert re.split(number, corrected) == re.split(number, WELD)
    assert corrected != WELD


def reached(tip: Callable[[np.ndarray], np.ndarray], q: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Joint positions nearby that bring a tip to a place: Newton steps of least norm, all rows at once."""
    for _ in range(30):
        columns = [(tip(q + 1e-6 * axis) - tip(q - 1e-6 * axis)) / 2e-6 for axis in np.eye(q.shape[1])]
        step = np.linalg.pinv(np.stack(columns, axis=2)) @ (tip(q) - place)[..., None]
        q = q - np.clip(step[..., 0], -0.2, 0.2)
    np.testing.assert_allclose(tip(q), place, atol=1e-9)
    return q


def put_into_sockets() -> None:
    """A ball in two sockets 50 mm apart, at three placements of their plate, 20 postures each."""
    arm = read_arm(hidden("panda", HIDDEN, seed=6, length=1e-3, angle=4e-3))
    ball = placed([0.02, 0.01, 0.12], [0.0, 0.0, 0.0])
    rng, lines = np.random.default_rng(3), []
    start = np.array([0.0, 0.3, 0.0, -2.0, 0.0, 2.3, 0.8])
    placements = {
        "front": placed([0.5, 0.0, 0.1], [0.0, 0.0, 0.3]),
        "left": placed([0.35, 0.4, 0.3], [0.3, 0.0, 1.5]),
        "low": placed([0.45, -0.35, 0.0], [0.0, 0.3, -0.8]),
    }
    for name, plate in placements.items():
        for x in (0.0, 0.05):
            place = plate[:3] @ [x, 0.0, 0.0, 1.0] + rng.normal(0.0, 3e-5, (20, 3))
            q = start + rng.normal(0.0, 0.4, (20, 7))
            for row in reached(lambda q: (arm(rows_of(q))[1] @ ball)[:, :3, 3], q, place):
                lines.append([*map(repr, map(float, row)), str(1e3 * x), "0", "0", name])
    head = ",".join([*(f"q{k}[rad]" for k in range(1, 8)), "x[mm]", "y[mm]", "z[mm]", "session"])
    Path("sockets.csv").write_text("\n".join([head, *map(",".join, lines)]) + "\n")


@pytest.mark.slow
def test_a_ball_in_two_sockets_calibrates_a_panda(run):
    follow("panda-sockets", run, {"sockets.csv": put_into_sockets})
    q = np.array([0.0, 0.3, 0.0, -2.0, 0.0, 2.3, 0.8]) + np.random.default_rng(4).normal(0.0, 0.3, (50, 7))
    ball = placed([0.02, 0.01, 0.12], [0.0, 0.0, 0.0])
    actual = poses(HIDDEN, q, ball)[:, :3, 3]
    found, nominal = (
        distance(points[:, :3, 3], actual)
        for points in (poses(Path("calibrated.toml"), q), wb.tool_poses(wb.load_robot("panda"), q) @ ball)
    )
    assert found < 0.1 * nominal


def distance(points: np.ndarray, actual: np.ndarray) -> float:
    """Mean distance after the best rigid motion [m]."""
    motion = aligned(points, actual)
    return float(np.linalg.norm(points @ motion[:3, :3].T + motion[:3, 3] - actual, axis=1).mean())
