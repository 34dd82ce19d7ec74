"""Rows without a measured position are not verified: a table of points and inclinometers mixed."""

import json

import numpy as np
import pytest
from points_and_tilts import DH, frames, points, robot_file, write_mixed
from refusals import mentions

import workbench as wb
from workbench.base.errors import DataError
from workbench.data.accuracy_requirement import Wanted
from workbench.extras.service.verification.certificate import write_certificate


@pytest.fixture
def mixed(tmp_path):
    return write_mixed(tmp_path)


def test_verify_judges_the_measured_positions_alone(mixed, run, tmp_path):
    """All ten points within a limit: 0.05^(1/10) = 74.1 % of all poses, whatever 30 inclinometer rows say."""
    q, xyz, _ = mixed
    off = 1e3 * np.linalg.norm(points(DH, q) - xyz, axis=1)[:10]
    options = ("verify", "mixed.csv", "--robot", "arm.toml", "--json", "r.json")
    status, out, err = run(*options, "--wanted", f"{1.01 * off.max()}mm", "--report", "out")
    assert status == 0, err
    found = json.loads((tmp_path / "r.json").read_text())
    assert (found["rows"], found["poses"]) == (10, 10)
    assert found["share_within_at_least"] == pytest.approx(0.05**0.1, rel=1e-6)
    assert found["errors"]["position_mm"]["mean"] == pytest.approx(off.mean(), rel=1e-6)
    assert found["errors"]["orientation_deg"] is None
    assert found["intervals"]["orientation_deg"] is None
    low, high = found["intervals"]["position_mm"]["mean"]
    assert off.min() < low < off.mean() < high < off.max()
    assert any("10 of 40" in text for text in found["warnings"])
    assert mentions(out, "10 of 40")
    assert mentions((tmp_path / "out" / "certificate.html").read_text(), "10 measurements of 10")
    status, _, _ = run(*options, "--wanted", f"{0.99 * off.max()}mm")
    assert status == 2
    assert json.loads((tmp_path / "r.json").read_text())["failed_rows"] == [int(off.argmax())]


def test_a_limit_on_orientations_is_not_kept_by_those_that_nobody_measured(mixed, tmp_path):
    """Neither the verdict nor the certificate may speak of an orientation."""
    arm, data = wb.load_robot(tmp_path / "arm.toml"), wb.read_measurements(tmp_path / "mixed.csv")
    found = wb.verify(arm, data, wanted=Wanted(position=1.0, rotation=1e-6))
    assert found.passed
    assert "°" not in found.verdict
    assert any("orientation" in text for text in found.warnings)


def test_orientations_in_some_rows_bound_the_share_by_those_rows(tmp_path):
    """Thirty points, five of them with an orientation: both limits were judged at five poses."""
    q = np.random.default_rng(3).uniform(-1.0, 1.0, (30, 6))
    rotation = frames(DH, q)[-1][:, :3, :3].copy()
    rotation[5:] = np.nan
    data = wb.Dataset(q, points(DH, q), rotation)
    found = wb.verify(
        wb.load_robot(robot_file(tmp_path / "arm.toml")), data, wanted=Wanted(position=1e-4, rotation=1e-4)
    )
    assert found.passed
    assert found.minimum_share == pytest.approx(0.05**0.2, rel=1e-6)


def test_nothing_is_verified_where_no_fresh_row_has_a_position(mixed, tmp_path):
    data = wb.read_measurements(tmp_path / "mixed.csv")
    with pytest.raises(DataError):
        wb.verify(wb.load_robot(tmp_path / "arm.toml"), data.take(np.arange(12, 40)), wanted=1.0)


def test_the_certificate_of_a_mixed_table_counts_its_points(mixed, tmp_path):
    arm, data = wb.load_robot(tmp_path / "arm.toml"), wb.read_measurements(tmp_path / "mixed.csv")
    found = wb.verify(arm, data, wanted=1.0)
    assert len(found.data) == len(found.judged_positions) == 10
    assert np.isfinite(found.judged_positions).all()
    assert mentions(write_certificate(found, tmp_path / "out").read_text(), "10 measurements of 10")
