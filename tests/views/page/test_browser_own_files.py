"""A user's own robot and a file with headings of its own, put right on the page, in a real browser."""

import re

import numpy as np
import pytest
from playwright.sync_api import expect

from workbench import Motion, load_robot, tool_poses
from workbench.arm.robot_toml import read_toml, robot_to_table
from workbench.base import se3
from workbench.session.commands.arm import LoadModel

pytestmark = pytest.mark.browser


def pendant(arm, poses: int) -> tuple[str, tuple[str, ...], np.ndarray]:
    """A table in mm and degrees, and typed poses: joint 2 counts the other way, joint 4 from −90°."""
    rows = robot_to_table(arm)["joint"]
    cells = [[np.rad2deg(r["theta"]), 1e3 * r["d"], 1e3 * r["a"], np.rad2deg(r["alpha"])] for r in rows]
    table = "theta,d,a,alpha\n" + "\n".join(",".join(f"{v:.4f}" for v in row) for row in cells)
    shown = np.random.default_rng(3).uniform(-2.0, 2.0, (poses, 6))
    tools = tool_poses(arm, Motion(plural(shown)))
    angles = np.rad2deg(se3.matrix_to_rpy(tools[:, :3, :3]))
    typed = tuple(
        " = ".join(", ".join(f"{v:.3f}" for v in part) for part in (np.rad2deg(q), [*(1e3 * p[:3, 3]), *a]))
        for q, p, a in zip(shown, tools, angles, strict=True)
    )
    return table, typed, shown


def plural(shown: np.ndarray) -> np.ndarray:
    """Joint positions as the table counts them, from what the pendant shows."""
    return shown * [1, -1, 1, 1, 1, 1] + np.deg2rad([0, 0, 0, 90, 0, 0])


def test_a_robot_from_its_table_and_a_file_without_units(app, look, tmp_path):
    arm = load_robot("ur10e")
    table, typed, shown = pendant(arm, 3)
    screen = look()
    screen.tab("Robot")
    screen.page.get_by_text("Your own robot", exact=True).click()
    app.worker.submit(LoadModel("dropped.csv", b"theta,d,a,alpha\n" + 6 * b"0,0,30,-90\n"))
    field = screen.page.get_by_label("DH table", exact=True)
    expect(field).to_have_value(re.compile("0,0,30,-90"))  # refused, but there to say its convention
    for label, words in (("DH table", table), ("Poses", "\n".join(typed))):
        screen.page.get_by_label(label, exact=True).fill(words)
    screen.press("By poses")
    screen.until(lambda session: session.robot.name != "ARIA", timeout=120.0)
    screen.page.get_by_text("joint 2 = -q2").first.wait_for()
    with screen.page.expect_download() as download:
        screen.press("This robot (TOML)")
    download.value.save_as(tmp_path / "mine.toml")
    found = tool_poses(read_toml(tmp_path / "mine.toml"), Motion(shown))
    wanted = tool_poses(arm, Motion(plural(shown)))
    assert np.abs(found - wanted)[:, :3, 3].max() < 1e-4

    q = np.random.default_rng(4).uniform(-2.0, 2.0, (5, 6))  # too few to tell the units
    place = 1e3 * tool_poses(app.worker.session.robot, Motion(q))[:, :3, 3]
    rows = ["A1,A2,A3,A4,A5,A6,X,Y,Z,hall"]
    rows += [",".join(f"{v:.5f}" for v in (*np.rad2deg(a), *p, 0.3)) for a, p in zip(q, place, strict=True)]
    (tmp_path / "log.csv").write_text("\n".join(rows))
    screen.tab("Measure")
    screen.give("Load measurements", tmp_path / "log.csv")
    screen.until(lambda session: session.measurements.unread is not None)
    screen.page.locator('[data-testid="columns"]', has_text="hall").wait_for()
    for column, meaning in (("A1", "q1[deg]"), ("X", "x[mm]")):
        screen.choose("Column", column)
        screen.choose("is", meaning)
        read_as = screen.page.locator('[data-testid="columns"] td', has_text=meaning)
        read_as.first.wait_for()  # not as the problem above proposes
    session = screen.until(lambda session: session.measurements.loaded is not None)
    np.testing.assert_allclose(session.measurements.loaded.dataset.q, q, atol=1e-6)
    np.testing.assert_allclose(session.measurements.loaded.dataset.position, 1e-3 * place, atol=1e-7)
