"""The real UR5 after a diagnosis: a format that can't hold effects gets the geometry that is best without."""

from pathlib import Path

import numpy as np
import pytest
import round_trip as trip

import workbench as wb
from workbench.identification.errors.file_errors import file_text


@pytest.fixture(scope="module")
def diagnosed(shared_data):
    folder = shared_data / "ur5_jacobi"
    arm = wb.load_robot(folder / "robot.toml")
    return wb.diagnose(arm, wb.read_measurements(folder / "measurements.csv", joints=arm.dof))


@pytest.mark.slow
@pytest.mark.data
def test_a_urdf_after_a_diagnosis_is_as_good_as_geometry_alone(diagnosed, tmp_path):
    saved = wb.load_robot(diagnosed.robot.save(tmp_path / "whole.toml"))
    data = diagnosed.data
    arm = trip.read_arm(Path(saved.save(tmp_path / "arm.urdf")))
    reached = arm(trip.rows_of(data.q))[1][:, :3, 3]
    missed = 1e3 * np.linalg.norm(reached - data.position, axis=1)
    geometry = diagnosed.before.held_out.position_mm.mean
    assert diagnosed.after.held_out.position_mm.mean < 0.6 * geometry
    assert missed.mean() < 1.05 * geometry
    run = diagnosed.identification().best
    shown = run.file_errors
    assert shown["URDF"].position_mm.mean == pytest.approx(missed.mean(), rel=0.05)
    assert shown["TOML"].position_mm.mean == diagnosed.after.held_out.position_mm.mean
    text = file_text(run)
    assert text.index("URDF") < text.index("TOML")
