"""Data, parameters, errors and residuals as data frames."""

import sys

import numpy as np
import pytest

import workbench as wb
from workbench.base.errors import MissingExtraError


@pytest.fixture(scope="module")
def rows(aria):
    return wb.measure_poses(aria, 30, seed=3)[1]


def test_measurements_go_out_and_come_back(rows):
    pytest.importorskip("pandas")
    frame = rows.to_frame()
    assert frame.shape[0] == 30
    np.testing.assert_array_equal(frame[["x[m]", "y[m]", "z[m]"]], rows.position)
    again = wb.read_measurements(frame)
    np.testing.assert_array_equal(again.q, rows.q)
    np.testing.assert_allclose(again.rotation, rows.rotation, atol=1e-14)
    slider = wb.Dataset(q=[[0.1, 0.2], [0.3, 0.4]], position=np.zeros((2, 3)))
    assert list(slider.to_frame(prismatic=[1]))[:2] == ["q1[rad]", "q2[m]"]


def test_parameters_and_residuals_of_a_fit(aria, rows):
    pytest.importorskip("pandas")
    fit = wb.identify(aria, rows, algorithms="ols")
    assert fit.parameters().equals(fit.best.fit.to_frame())
    signed = fit.residuals().sort_index()
    assert signed["held_out"].sum() == len(fit.held_out_data)
    poses = wb.tool_poses(fit.robot, rows.q)
    np.testing.assert_allclose(signed[["x[m]", "y[m]", "z[m]"]], rows.position - poses[:, :3, 3], atol=1e-12)
    angles = np.linalg.norm(signed[["rx[rad]", "ry[rad]", "rz[rad]"]], axis=1)
    np.testing.assert_allclose(angles[fit.train_rows], fit.best.train.rotation, atol=1e-6)
    alone = wb.evaluate(fit.robot, rows).residuals()
    np.testing.assert_allclose(alone["z[m]"], signed["z[m]"], atol=1e-12)


def test_without_either_the_extra_is_named(rows, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    monkeypatch.setitem(sys.modules, "polars", None)
    with pytest.raises(MissingExtraError) as refused:
        rows.to_frame()
    assert refused.value.extra == "pandas"
