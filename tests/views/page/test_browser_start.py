"""A new user's way on the page, with files of their own: the card, the strip's buttons, a calibrated URDF."""

from dataclasses import replace

import pytest
from driven_effects import driven_file
from round_trip import Saved, read_rows

from workbench import load_plate, load_robot, write_urdf
from workbench.session.page_state import Tab
from workbench.views.page.app import App

pytestmark = pytest.mark.browser


@pytest.fixture
def app():
    running = App(load_robot("aria"), load_plate("table2"), asks=True)
    yield running
    running.close()


def test_from_own_files_to_a_cause_and_a_calibrated_urdf_in_six_clicks(app, chromium, tmp_path):
    robot = write_urdf(replace(load_robot("aria"), name="own"), tmp_path / "own.urdf")
    rows, _ = driven_file("payload", tmp_path)
    with chromium.new_context(viewport={"width": 390, "height": 844}, accept_downloads=True) as context:
        page = context.new_page()
        page.goto(f"{app.url}/?fixedDpr=0.25")

        def press(label: str) -> None:
            page.get_by_role("button", name=label, exact=label != "Save as URDF").click(timeout=120_000)

        def opened(tab: Tab) -> None:
            page.wait_for_function(
                "name => document.querySelector('[role=tab][aria-selected=true]')?.innerText === name",
                arg=str(tab),
                timeout=60_000,
            )

        def says(text: str) -> None:
            page.locator('[data-testid="hint"]', has_text=text).wait_for(timeout=120_000)

        press("A robot and measurements")
        page.get_by_label("… or built in", exact=True).click()
        page.keyboard.type("ur5e")  # in place of what stands there
        page.get_by_role("option", name="ur5e", exact=True).click()
        page.locator('[data-testid="start"]', has_text="Robot: UR5e").wait_for(timeout=60_000)
        files = page.locator(".mantine-Modal-body input[type=file]")
        files.nth(0).set_input_files(robot)
        page.locator('[data-testid="start"]', has_text="Robot: own").wait_for(timeout=60_000)
        app.worker.wait()
        files.last.set_input_files(rows)
        says("Geometry can't explain the rest")  # identified by itself
        opened(Tab.CALIBRATE)
        page.wait_for_function("() => !document.querySelector('.mantine-Notification-loader')")
        page.wait_for_selector('[data-testid="start"]', state="detached")
        page.wait_for_selector('[data-testid="requirement"]', state="detached")
        press("Find the cause")
        says("gives under load")
        opened(Tab.CALIBRATE)
        page.mouse.wheel(0, 2000)  # the strip stays where it is
        box = page.locator('[data-testid="hint"]').evaluate("e => e.getBoundingClientRect().toJSON()")
        assert 0 < box["y"] < 844 - box["height"]
        assert box["width"] > 300
        press("Add the effects found")
        says(" → ")
        opened(Tab.CALIBRATE)
        paths = [tmp_path / f"calibrated.{kind}" for kind in ("toml", "urdf")]
        for label, path in zip(("Save as URDF", "TOML"), reversed(paths), strict=True):
            with page.expect_download(timeout=120_000) as download:
                press(label)
            download.value.save_as(path)
            opened(Tab.EXPORT)
        shown = page.locator('[data-testid="file-errors"]:visible').first.text_content()
    found = app.worker.session.results.identification
    refitted = None if found.best.before_refit is None else found.best.fit.problem.data.row
    saved = Saved(*paths, shown=shown, held_out=found.held_out_data.row, refitted=refitted)
    saved.check(read_rows(rows))
