"""What is said of a path outside the measured poses is what the arm leaves there; of one inside, nothing."""

import re

import numpy as np
import pytest
from checks import with_errors

import workbench as wb
from tests.exports.test_unmeasured_orientation import flanges
from workbench.arm.calibrated_region import region_text
from workbench.base.errors import OptionError, RobotError
from workbench.data.dataset import Dataset

OUTWARDS = np.array([2.0, -1.0, -0.9, -2.0, 1.2, 2.0])
CENTRE = np.array([0.0, -1.2, 1.2, -1.0, 1.0, 0.0])


@pytest.fixture(scope="module")
def arms():
    rng = np.random.default_rng(0)
    nominal = wb.load_robot("ur5e").bare
    actual = with_errors(nominal, 1e-3 * rng.normal(size=len(nominal.default_free)))
    q = CENTRE + rng.uniform(-0.35, 0.35, (40, 6))
    points = actual.predict(q)[:, :3, 3] + rng.normal(0.0, 5e-5, (40, 3))
    return actual, wb.identify(wb.load_robot("ur5e"), Dataset(q=q, position=points)).robot


def test_a_path_that_leaves_the_region_is_told_what_to_expect(arms):
    actual, calibrated = arms
    path = CENTRE + np.linspace(0.4, 1.0, 50)[:, None] * OUTWARDS
    (text,) = region_text(calibrated, path)
    assert "leaves the calibrated region by" in text
    stated = float(re.search(r"expect ([0-9.]+) mm", text)[1])
    off = 1e3 * np.linalg.norm((calibrated.predict(path) - actual.predict(path))[:, :3, 3], axis=1)
    assert 0.3 < np.sqrt((off**2).mean()) / stated < 3.0


def test_a_path_among_the_measured_poses_needs_no_warning(arms):
    _, calibrated = arms
    assert region_text(calibrated, CENTRE + np.linspace(-0.3, 0.3, 20)[:, None]) == ()
    assert "elsewhere within the joint limits" in region_text(calibrated)[0]
    assert region_text(wb.load_robot("ur5e")) == ()


def test_where_parallel_joints_alone_moved_base_and_tool_are_open_along_their_axes():
    rng = np.random.default_rng(2)
    q = CENTRE + rng.uniform(-0.6, 0.6, (40, 6)) * [0, 1, 1, 1, 0, 0]
    turned = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    place, tool = np.array([0.9, -0.4, 0.25]), np.array([0.03, -0.02, 0.11, 1.0])
    points = (flanges(q) @ tool)[:, :3] @ turned.T + place + rng.normal(0.0, 3e-5, (40, 3))
    found = (result := wb.identify("ur5", Dataset(q=q, position=points))).best
    assert any("open by any amount" in text for text in result.warnings)
    own = {p.name: (x, s) for p, x, s in zip(found.fit.parameters, found.fit.x, found.fit.std, strict=True)}
    for name, true in zip(("base.x", "base.y", "base.z"), place, strict=True):
        assert abs(own[name][0] - true) < 3.0 * own[name][1]
    far = rng.uniform(-2.0, 2.0, (200, 6))
    seen = found.calibrated.predict(far)[:, :3, 3] - (flanges(far) @ tool)[:, :3] @ turned.T - place
    assert 0.2 < np.sqrt((seen**2).sum(1).mean()) / found.transfer.anywhere.position < 5.0


@pytest.mark.extra("trajectories")
def test_the_warning_survives_in_what_leaves(arms, tmp_path):
    _, calibrated = arms
    calibrated.save(tmp_path / "mine.toml")
    mine = wb.load_robot(tmp_path / "mine.toml")
    path = CENTRE + np.linspace(0.4, 0.6, 10)[:, None] * OUTWARDS
    for way in (path, mine.predict(path)):
        found = wb.compensate(mine, way, nominal="ur5e")
        assert any("leaves the calibrated region" in note for note in found.notes)
    done = wb.export(mine, "mjcf", tmp_path / "mine.xml")
    assert done.path.is_file()
    assert any("elsewhere within the joint limits" in note for note in done.notes)
    refused = mine.recorded(refused={"URDF": "the URDF is worse"})
    with pytest.raises(RobotError):
        wb.export(refused, "mjcf", tmp_path / "worse.xml")
    assert wb.export(refused, "mjcf", tmp_path / "worse.xml", force=True).path.is_file()


def test_noise_without_a_unit_is_metres_or_refused(arms):
    with pytest.raises(OptionError, match=r"write '0[.]05mm'"):
        wb.identify("ur5e", Dataset(q=np.zeros((8, 6)), position=np.zeros((8, 3))), noise=0.05)
