"""The page in a real Chromium: what a user does, with the mouse, and what is then on the screen."""

import json
import os
from pathlib import Path

import numpy as np
import pytest
from driven_effects import tracked_file
from playwright.sync_api import expect

from workbench import load_robot
from workbench.arm.robot_toml import read_toml
from workbench.data.simulation.simulate import virtual_arm
from workbench.report.numbers import compared as as_shown
from workbench.session.commands.compare import ShowRow
from workbench.session.comparison import ModelStage
from workbench.session.page_state import Tab
from workbench.views.drawables.scene_contents import first_view
from workbench.views.page.scene.scene import aim

pytestmark = pytest.mark.browser

LOOKS = Path(__file__).with_name("looks.json")
"""How the scene looks; what is meant to be another one is kept anew by a run with WORKBENCH_LOOKS=keep."""
CELLS, CELL = (12, 16), 10
"""Rows and columns of the coarse picture, and pixels of a cell."""
ON_AVERAGE, ANYWHERE = 4.0, 60.0
"""How far colours may be off, of 255."""
NEVER_SAID = ("traceback", "error:", "nan", "undefined", "none", "[object")


def off(now: np.ndarray, then: np.ndarray) -> tuple[float, float]:
    """Mean and greatest distance of two pictures' colours."""
    distance = np.abs(now - then)
    return float(distance.mean()), float(distance.max())


def test_every_tab_has_words_and_the_scene_looks_as_it_was_kept(look):
    """A broken page is noticed."""
    screen = look(new=True)
    lines = {}
    for tab in Tab:
        screen.tab(tab)
        screen.settle()
        words = screen.page.locator("body").inner_text().splitlines()
        lines[tab] = [line.strip() for line in words if line.strip() and "WebGL" not in line]
    assert min(map(len, lines.values())) > 12
    assert len({*map(tuple, lines.values())}) == len(Tab)
    said = {word for part in lines.values() for line in part for word in line.lower().split()}
    assert not said.intersection(NEVER_SAID)
    aim(screen.client, *first_view(screen.app.worker.session))
    screen.page.wait_for_timeout(500)
    pixels = screen.client.get_render(CELLS[0] * CELL, CELLS[1] * CELL, timeout=30.0)[..., :3].astype(float)
    now = pixels.reshape(CELLS[0], CELL, CELLS[1], CELL, 3).mean((1, 3))  # mean colours of its parts
    if os.environ.get("WORKBENCH_LOOKS") == "keep":
        rows = (json.dumps(row) for row in now.round().astype(int).tolist())
        LOOKS.write_text("[\n" + ",\n".join(rows) + "\n]\n", encoding="utf-8")
    known = json.loads(LOOKS.read_text(encoding="utf-8"))
    mean, maximum = off(now, np.array(known))
    assert mean < ON_AVERAGE, f"the scene looks otherwise; see {__file__}"
    assert maximum < ANYWHERE, f"a part of the scene looks otherwise; see {__file__}"


def test_drag_changes_numbers_and_arm(app, look):
    screen = look()
    page = screen.page
    assert "Drag an arrow" in screen.text("hint")
    before = {name: screen.text(name) for name in ("O", "predicted")}
    before["arm"] = screen.node("/arm/nominal/body2")
    start = np.array(app.worker.session.plate.targets[0].xyz)

    at, metre = screen.grab(1)  # across: along x the error hardly changes
    changed = "old => ![undefined, old].includes(document.querySelector('[data-testid=index]')?.innerText)"
    for k in range(1, 5):  # how soon: `tests/benchmarks/drag.py`
        shown = screen.text("index")
        page.mouse.move(*(at - metre * 0.016 * k))
        page.wait_for_function(changed, arg=shown)
    screen.wait_text("hint", "Release")
    page.mouse.up()
    screen.wait_text("hint", "Predicted error")
    app.worker.wait()

    moved = np.array(app.worker.session.plate.targets[0].xyz) - start
    assert np.allclose(moved, [0, -0.064, 0], atol=0.012)
    assert app.worker.session.drag is None
    assert screen.text("O") != before["O"]
    assert screen.text("predicted") != before["predicted"]
    assert not np.allclose(screen.node("/arm/nominal/body2"), before["arm"], atol=1e-3)
    screen.press("Undo: move target 1")
    screen.wait_text("O", before["O"])
    assert np.allclose(screen.node("/arm/nominal/body2"), before["arm"], atol=1e-6)


def test_file_identify_overlay_save(app, look, tmp_path):
    robot, rng = load_robot("aria"), np.random.default_rng(4)
    actual = virtual_arm(robot, rng=rng, errors=(1e-3, 0.01))
    path = tracked_file(actual, tmp_path / "arm <b>7</b>.csv", rng, rows=60, reach=2.5)

    screen = look()
    page = screen.page
    screen.tab("Measure")
    screen.give("Load measurements", path)
    screen.wait_text("preview", "60")
    assert "rotation" in screen.text("preview")
    screen.tab("Calibrate")
    screen.press("Identify")
    screen.wait_text("result", "held-out poses")
    assert "joint2.alpha" in screen.text("parameters")
    found = app.worker.session.results.identification
    assert found.best.held_out.position_mm.mean < 0.05 * found.nominal.held_out.position_mm.mean
    screen.tab("Compare")
    rows, worst = (results := app.worker.session.results).comparison, results.comparison.number[results.row]
    screen.wait_text("row-errors", f"Data row {worst} ")
    assert screen.node("/arm/calibrated/body3")
    slider = page.get_by_role("slider").first
    slider.focus()
    slider.press("ArrowLeft")
    screen.wait_text("row-errors", f"Data row {worst - 1} ")
    assert f"{as_shown(1e3 * rows.stage_errors[rows.number == worst - 1, 1][0])} mm geometry" in screen.text(
        "row-errors"
    )
    residuals_are_where_they_are(screen)

    screen.tab("Export")
    with page.expect_download() as download:
        screen.press("TOML")
    saved = tmp_path / "saved.toml"
    download.value.save_as(saved)
    names = robot.default_free
    wanted = found.best.calibrated.values(names)
    assert np.allclose(read_toml(saved).values(names), wanted, atol=1e-12)

    screen.tab("Measure")
    for answer in ("Cancel", "Read two.csv"):
        assert app.worker.session.results.identification is found
        screen.give(
            "Load measurements", {"name": "two.csv", "mimeType": "text/csv", "buffer": path.read_bytes()}
        )
        screen.wait_text("question", "the results based on them will be removed")
        screen.press(answer)
    screen.until(lambda session: session.measurements.loaded.name == "two.csv")


def residuals_are_where_they_are(screen):
    """All rows are in the picture, have one scale of colours in mm, and answer to a click."""
    assert screen.node("/errors/sample_words")
    assert "mm" in screen.text("colour-bar")
    rows = screen.app.worker.session.results.comparison
    places = np.array([screen.pixel(place) for place in rows.measured])
    box = screen.page.locator("canvas").first.bounding_box()
    assert (places > [box["x"], box["y"]]).all()
    assert (places < [box["x"] + box["width"], box["y"] + box["height"]]).all()
    screen.page.get_by_role("link", name="nominal").click()
    screen.until(lambda session: session.choices.overlay.stage is ModelStage.NOMINAL)
    distance = np.linalg.norm(places[:, None] - places, axis=2) + 1e9 * np.eye(len(places))
    free = np.where(places[:, 0] > 400, distance.min(1), 0.0)  # beside the window with the scale
    row = int(free.argmax())
    screen.page.mouse.click(*places[row])
    screen.until(lambda session: session.results.row == row)
    screen.wait_text("row-errors", f"Data row {rows.number[row]} ")


def test_a_click_on_a_row_of_the_chart_puts_the_arm_there(app, look):
    screen = look()
    screen.tab("Measure")
    screen.press("Measure a virtual arm")
    screen.wait_text("preview", "10 of 10")
    screen.tab("Calibrate")
    screen.press("Identify")
    screen.wait_text("result", "40 held-out poses")
    screen.wait_text("hint", "Geometry can't explain the rest")
    assert app.worker.session.measurements.loaded.actual.effects  # there is something to find
    dots = screen.page.locator('[data-testid="row-chart"] svg a')
    expect(dots).to_have_count(len(app.worker.session.results.comparison))
    dots.nth(7).locator("circle").dispatch_event("click")
    number = int(np.sort(app.worker.session.results.comparison.number)[7])
    screen.until(lambda session: session.results.comparison.number[session.results.row] == number)
    screen.wait_text("row-errors", f"Data row {number}")
    assert [type(entry.command) for entry in app.worker.journal][-1] is ShowRow


def test_who_drags_holds_the_target(app, look):
    """Another page can't move it meanwhile, and a page that goes away lets go."""
    first, second = look(), look()
    at, metre = first.grab(0)
    first.page.mouse.move(*(at - 0.03 * metre), steps=4)
    second.wait_text("hint", "Release")
    first.page.wait_for_timeout(400)
    held = first.until(lambda session: session.drag is not None)

    at2, metre2 = second.grab(1)
    second.page.mouse.move(*(at2 + 0.1 * metre2), steps=4)
    second.page.mouse.up()
    put_back = held.plate.targets[0].xyz.tolist()
    second.page.wait_for_function(
        "p => window.__viserMutable.nodePoseData['/handles/arrows'].position"
        ".every((v, i) => Math.abs(v - p[i]) < 2e-3)",
        arg=put_back,
    )
    app.worker.wait()
    assert app.worker.session.plate is held.plate

    first.page.context.close()
    second.wait_text("hint", "Predicted error")
    assert app.worker.session.drag is None
    assert np.allclose(app.worker.session.plate.targets[0].xyz, held.plate.targets[0].xyz)


def test_reload_keeps_everything(app, look):
    screen = look()
    position = screen.page.get_by_role("textbox").first
    position.fill("540")
    position.press("Tab")
    screen.wait_text("hint", "Predicted error")
    assert app.worker.session.plate.targets[0].xyz.tolist() == pytest.approx([0.54, 0.354, 0.235], abs=1e-12)
    shown = screen.text("O")
    screen.reload()
    screen.wait_text("O", shown)
    expect(screen.page.get_by_role("textbox").first).to_have_value("540")
