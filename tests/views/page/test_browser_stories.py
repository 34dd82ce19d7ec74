"""Three stories on files that the package did not make, by counted clicks and with a clock."""

import shutil
import zipfile

import numpy as np
import pytest
from generator import VirtualArm
from round_trip import Saved, pose_difference, read_arm, read_rows, rows_of
from stories import Visit, own_files, own_robot, pictures, plate

from workbench.arm.built_in_arms import load_robot
from workbench.plate.plate_toml import load_plate
from workbench.views.page.app import App

pytestmark = [pytest.mark.browser, pytest.mark.slow]


@pytest.fixture
def visit(chromium):
    app = App(load_robot("aria"), load_plate("table2"), asks=True)
    with chromium.new_context(viewport={"width": 1280, "height": 800}, accept_downloads=True) as context:
        yield Visit.open(context.new_page(), app)
    app.close()


def test_own_robot_and_rows_to_a_urdf_that_leaves_the_error_shown(visit, tmp_path):
    robot, rows = own_files(tmp_path)
    urdf = own_robot(visit, robot, rows, tmp_path)
    clicks = visit.clicks
    toml = visit.save("TOML", tmp_path / "calibrated.toml")
    found = visit.app.worker.session.results.identification
    again = None if found.best.judged is None else found.best.fit.problem.data.row
    shown = visit.page.locator('[data-testid="file-errors"]:visible').first.text_content()
    Saved(toml, urdf, shown, found.held_out_data.row, again).check(read_rows(rows))
    assert clicks <= 5


def test_own_robot_to_a_plate_that_may_be_built(visit, tmp_path):
    archive = plate(visit, own_files(tmp_path)[0], tmp_path)
    assert visit.clicks <= 5
    assert all(state.measurable for state in visit.app.worker.session.states)
    assert any(name.endswith(".dxf") for name in zipfile.ZipFile(archive).namelist())


def test_pictures_to_the_zeros(visit, tmp_path, aria):
    pytest.importorskip("cv2")
    from board_on_tool import photograph, table_of

    shifts = np.deg2rad([0.0, 0.0, 0.6, 0.0, -0.4, 0.0])
    shots = tmp_path / "shots"
    shots.mkdir()
    photograph(aria, shifts, shots, count=30)
    for name in ("camera", "target"):
        (shots / f"{name}.toml").unlink()
    archive = shutil.make_archive(str(shots), "zip", tmp_path, "shots")
    urdf = pictures(visit, archive, tmp_path)
    assert visit.clicks - 2 <= 4  # the last two save
    table = table_of(aria)
    table[:, 0] += shifts
    q = np.random.default_rng(1).uniform(-1.0, 1.0, (50, 6))
    off = pose_difference(read_arm(urdf)(rows_of(q))[0], VirtualArm("hayati", table).pose(q))
    assert off[0] < 5e-4
    assert off[1] < np.deg2rad(0.05)
