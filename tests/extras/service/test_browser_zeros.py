"""Joint zeros after a knock, in a real browser."""

from dataclasses import replace

import numpy as np
import pytest
from driven_effects import tracked_file

from workbench.arm.built_in_arms import load_robot
from workbench.arm.robot_toml import write_toml
from workbench.plate.plate_toml import load_plate
from workbench.views.page.app import App

pytestmark = pytest.mark.browser


def knocked(aria, folder):
    """Rows of an arm whose joints 3 and 5 are off by 0.5° and −0.2°."""
    zeros = aria.values(("joint3.theta", "joint5.theta")) + np.deg2rad([0.5, -0.2])
    actual = aria.with_values(dict(zip(("joint3.theta", "joint5.theta"), zeros, strict=True)))
    return tracked_file(actual, folder / "knock.csv", np.random.default_rng(8), rows=8, reach=2.0)


def test_a_knocked_arm_has_a_door_on_the_start_card(chromium, tmp_path, aria):
    """Robot and rows are dropped, and the joint is named: one click."""
    path = knocked(aria, tmp_path)
    app = App(load_robot("aria"), load_plate("table2"), asks=True)
    try:
        with chromium.new_context(viewport={"width": 1280, "height": 800}) as context:
            page = context.new_page()
            page.goto(f"{app.url}/?fixedDpr=0.25")
            page.get_by_role("button", name="An arm after a collision", exact=True).click(timeout=120_000)
            files = page.locator(".mantine-Modal-body input[type=file]")
            files.nth(0).set_input_files(write_toml(replace(aria, name="mine"), tmp_path / "calibrated.toml"))
            page.locator('[data-testid="start"]', has_text="Robot: mine").wait_for(timeout=120_000)
            app.worker.wait()
            files.nth(1).set_input_files(path)
            found = page.locator('[data-testid="rezero"]', has_text="moved: joint 3 by").first
            found.wait_for(timeout=120_000)
            assert "joint 5 by −0.2" in found.inner_text()
    finally:
        app.close()
