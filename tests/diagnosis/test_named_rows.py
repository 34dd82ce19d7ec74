"""What is named: rows that stand out, sessions that drift, what the map takes off."""

from dataclasses import replace

import numpy as np
import pytest
from refusals import mentions

import workbench as wb
from workbench.diagnosis.claims.structure import structure_of
from workbench.identification.rows.excluded_outliers import stand_out_note
from workbench.plate.simulated_measurement import measure_poses

DRIFT = 0.4
"""How far the second session drifts [mm]."""


@pytest.fixture(scope="module")
def sessions():
    """Two sessions of points: one stands still, one drifts along y."""
    _, rows = measure_poses(wb.load_robot("aria"), 100, instrument="laser-tracker", seed=4)
    session = np.repeat(["still", "moving"], 50)
    drift = np.concatenate([np.zeros(50), np.linspace(-0.5, 0.5, 50)]) * DRIFT * 1e-3
    return replace(rows, session=session, position=rows.position + drift[:, None] * [0.0, 1.0, 0.0])


def found_in(rows):
    fit = wb.identify(wb.load_robot("aria"), rows, held_out=0.0, frames="per-session").best.fit
    return structure_of(fit, np.random.default_rng(0))


def test_the_session_that_drifts_is_named_with_how_far(sessions):
    drifts = found_in(sessions).drifts
    assert drifts.keys() == {"moving"}
    assert drifts["moving"] == pytest.approx(DRIFT, rel=0.25)


def test_held_out_rows_that_stand_out_are_named_with_the_mean_without_them():
    errors = np.array([0.1, 0.12, 0.09, 1.2, 0.11, np.nan]) * 1e-3
    result = stand_out_note(np.array([3, 8, 20, 125, 130, 140]), errors)
    assert "125" in result
    assert mentions(result, "1.2 mm")
    assert mentions(result, "0.105 mm")
    assert stand_out_note(np.arange(5), errors[[0, 1, 2, 4, 5]]) == ""
    assert stand_out_note(np.arange(0), errors[:0]) == ""
    assert stand_out_note(np.arange(2), np.full(2, np.nan)) == ""
