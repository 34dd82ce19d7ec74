"""A folder of what a camera saw, given to the page as a ZIP, to a calibrated URDF."""

import shutil

import numpy as np
import pytest

from workbench.arm.built_in_arms import load_robot
from workbench.arm.urdf import read_urdf
from workbench.plate.plate_toml import load_plate
from workbench.views.page.app import App

cv2 = pytest.importorskip("cv2")
pytestmark = pytest.mark.browser
SHIFTS = np.deg2rad([0.0, 0.0, 0.6, 0.0, -0.4, 0.0])


@pytest.fixture
def app():
    """An app of its own: what it loads and where it leaves its pages is nobody else's."""
    running = App(load_robot("aria"), load_plate("table2"))
    yield running
    running.close()


def test_a_folder_in_an_archive_is_identified_and_saved(app, look, aria, tmp_path):
    """As a file manager packs it; a broken archive is one sentence, and what was there stays."""
    from board_on_tool import photograph

    folder = tmp_path / "knocked"
    folder.mkdir()
    photograph(aria, SHIFTS, folder, count=16, fine=1)
    packed = shutil.make_archive(str(tmp_path / "shots"), "zip", tmp_path, "knocked")
    broken = tmp_path / "broken.zip"
    broken.write_bytes(b"no archive")
    screen = look()
    screen.tab("Measure")
    for path, message in ((packed, "16 pictures read from shots"), (broken, "as a ZIP archive")):
        screen.give("Pictures in a folder (ZIP)", path)
        screen.page.get_by_text(message).first.wait_for()
    session = screen.until(lambda s: s.page.job is None)
    assert session.measurements.loaded.name == "shots"
    screen.shoot("pictures-loaded")
    screen.press("Identify the geometry")
    screen.until(lambda s: s.results.identification is not None and s.page.job is None, timeout=120.0)
    screen.wait_text("joint-zeros", "joint3")
    lines = screen.text("joint-zeros").splitlines()
    assert "joint1, joint6 at nominal:" in lines[-1]
    change, error = (float(cell.strip("± °").replace("−", "-")) for cell in lines[2].split("\t")[1:3])
    assert abs(change - 0.6) < 5.0 * error < 0.3
    screen.tab("Export")
    with screen.page.expect_download() as saved:
        screen.press("URDF")
    saved.value.save_as(tmp_path / "arm.urdf")
    q = np.random.default_rng(1).uniform(-1.0, 1.0, (20, 6))
    turns = [arm.predict(q)[:, :3, :3] for arm in (read_urdf(tmp_path / "arm.urdf"), aria)]
    off = np.swapaxes(turns[0], 1, 2) @ turns[1]
    assert 0.3 < np.rad2deg(np.arccos((np.trace(off, axis1=1, axis2=2).mean() - 1.0) / 2.0)) < 1.0
