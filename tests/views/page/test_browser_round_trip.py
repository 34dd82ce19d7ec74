"""A person with the page, a robot's file and a file of rows ends with files that a stranger finds right."""

import numpy as np
import pytest
from round_trip import Saved, pose_difference, read_arm, read_rows, toml_arm

from workbench.arm.built_in_arms import load_robot
from workbench.plate.plate_toml import load_plate
from workbench.views.page.app import App

pytestmark = [pytest.mark.browser, pytest.mark.data, pytest.mark.slow]


@pytest.fixture
def app():
    running = App(load_robot("aria"), load_plate("table2"), asks=True)
    yield running
    running.close()


def test_a_real_arm_from_its_file_to_files_that_are_right(app, chromium, shared_data, tmp_path):
    """Identify, find the cause, add; of each the files, evaluated from their own numbers."""
    robot = shared_data / "ur5_jacobi" / "robot.toml"
    path = shared_data / "ur5_jacobi" / "measurements.csv"
    rows = read_rows(path)
    with chromium.new_context(viewport={"width": 1280, "height": 900}, accept_downloads=True) as context:
        page = context.new_page()
        page.goto(f"{app.url}/?fixedDpr=0.25")

        def press(label: str) -> None:
            page.get_by_role("button", name=label, exact=True).first.click(timeout=300_000)

        def saved(name: str) -> Saved:
            """What the two buttons download, and what stands below them."""
            paths = {}
            for label in ("TOML", "URDF"):
                paths[label.lower()] = tmp_path / f"{name}.{label.lower()}"
                with page.expect_download(timeout=120_000) as download:
                    press(label)
                download.value.save_as(paths[label.lower()])
            shown = page.locator('[data-testid="file-errors"]:visible').first.inner_text()
            found = app.worker.session.results.identification
            run = found.runs[app.worker.session.results.fit]
            again = None if run.judged is None else run.fit.problem.data.row
            return Saved(**paths, shown=shown, held_out=found.held_out_data.row, refitted=again)

        press("A robot and measurements")
        files = page.locator(".mantine-Modal-body input[type=file]")
        files.nth(0).set_input_files(robot)
        page.locator(
            '[data-testid="start"]', has_text=f"Robot: {toml_arm(robot.read_text()).table['name']}"
        ).wait_for(timeout=60_000)
        app.worker.wait()
        files.nth(1).set_input_files(path)
        page.locator('[data-testid="hint"]', has_text="1020 rows").wait_for(timeout=120_000)
        press("Identify the geometry")
        page.locator('[data-testid="file-errors"]:visible').first.wait_for(timeout=300_000)
        geometry = saved("geometry")
        press("Find the cause")
        press("Add what was found")
        page.locator('[data-testid="file-errors"]:visible', has_text="fitted again").first.wait_for(
            timeout=300_000
        )
        added = saved("added")
    for each in (geometry, added):
        each.check(rows)
        wrists = (read_arm(each.urdf)(rows)[0], toml_arm(robot.read_text())(rows)[0])
        assert pose_difference(*wrists)[1] < np.deg2rad(2.0)
