"""Measuring technologies: what each loses, how well it sees, and what an arm can be found from."""

import numpy as np
import pytest
from checks import any_joints

from workbench import Instrument, Motion, measure_poses, tool_poses, write_measurements
from workbench.base import se3
from workbench.data.readers import read_measurements
from workbench.data.simulation.instruments import THREE_MARKERS, Observes
from workbench.data.simulation.simulate import simulate
from workbench.identification.identify import identify


@pytest.mark.parametrize("samples", [1, 16])
def test_three_markers_give_a_pose_as_well_as_promised(katana, samples):
    """Spread of 3000 fitted poses against the deviations that follow from the markers' places."""
    instrument = Instrument("o", Observes.RIGID_BODY, 1e-5, markers=THREE_MARKERS, samples=samples)
    q = np.tile(any_joints(katana, 1), (3000, 1))
    rows = simulate(katana, Motion(q), instrument=instrument, rng=np.random.default_rng(2))
    error = se3.pose_error(se3.pose(rows.rotation, rows.position), tool_poses(katana, Motion(q)))
    position, rotation = instrument.deviations
    assert np.isclose(position, 1e-5 / np.sqrt(3 * samples))  # the mean of three markers
    assert np.isclose(np.sqrt((error[:, :3] ** 2).mean()), position, rtol=0.05)
    assert np.isclose(np.sqrt((error[:, 3:] ** 2).mean()), rotation, rtol=0.05)
    assert np.allclose(rows.sigma[0], [position] * 3 + [rotation] * 3)


WITHIN_MM = {"photogrammetric-tracker": 0.12, "optotrak": 0.02, "ball-bar": 0.03}


@pytest.mark.parametrize(("name", "within_mm"), WITHIN_MM.items())
def test_an_arm_is_found_with_each(katana, name, within_mm, tmp_path):
    """Measured, written, read and identified: held-out rows are met to about the instrument's noise."""
    _, rows = measure_poses(katana, 160, instrument=name, errors=(5e-3, np.deg2rad(5.0)), seed=2)
    back = read_measurements(write_measurements(rows, tmp_path / "rows.csv"), joints=katana.dof)
    assert np.array_equal(back.included, rows.included)
    run = identify(katana, back, algorithms=("opt2",), held_out=0.2)
    held = run.best.held_out.position_mm
    assert run.nominal.held_out.position_mm.mean > 5.0
    assert held.mean < within_mm
