"""Joint zeros after a knock, in a real browser."""

import numpy as np
import pytest

from workbench.arm.motion import Motion
from workbench.data.simulation.instruments import instrument_named
from workbench.data.simulation.simulate import simulate
from workbench.data.writer import write_measurements

pytestmark = pytest.mark.browser


def test_the_card_names_the_joint_that_moved(app, look, tmp_path, aria):
    rng = np.random.default_rng(8)
    zeros = aria.values(("joint3.theta", "joint5.theta")) + np.deg2rad([0.5, -0.2])
    actual = aria.with_values(dict(zip(("joint3.theta", "joint5.theta"), zeros, strict=True)))
    q = rng.uniform(*np.clip(aria.limits, -2.0, 2.0).T, (8, 6))
    rows = simulate(actual, Motion(q), instrument=instrument_named("tracker-6d"), rng=rng)
    path = write_measurements(rows, tmp_path / "knock.csv")
    screen = look()
    screen.tab("Measure")
    screen.give("Load measurements", path)
    screen.wait_text("preview", path.name)
    screen.tab("Identify")
    screen.page.get_by_text("Joint zeros after a knock").click()
    screen.wait_text("rezero", "After a knock or a new motor")
    screen.press("Find moved joints")
    screen.wait_text("rezero", "Joint 3 by", timeout=60_000)
    assert screen.text("rezero").count("Moved") == 1
    assert "joint 5 by −0.2" in screen.text("rezero")
    screen.page.get_by_test_id("zeros").scroll_into_view_if_needed()
    screen.shoot("zeros")
