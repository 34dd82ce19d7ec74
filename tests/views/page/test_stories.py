"""A plate that may be built, by counted clicks; the story with own files is in `test_browser_start.py`."""

import zipfile

import pytest
from stories import Visit, plate

from workbench.arm.built_in_arms import load_robot
from workbench.plate.plate_toml import load_plate
from workbench.views.page.app import App

pytestmark = [pytest.mark.browser, pytest.mark.slow]


def test_from_an_arm_to_a_plate_that_may_be_built_in_ten_clicks_without_scrolling(chromium, tmp_path):
    app = App(load_robot("aria"), load_plate("table2"), asks=True)
    try:
        with chromium.new_context(viewport={"width": 1280, "height": 800}, accept_downloads=True) as context:
            visit = Visit.open(context.new_page(), app)
            archive = plate(visit, "ur5", "0.5", tmp_path)
            assert all(state.measurable for state in app.worker.session.states)
    finally:
        app.close()
    assert visit.clicks <= 10
    assert any(name.endswith(".dxf") for name in zipfile.ZipFile(archive).namelist())
