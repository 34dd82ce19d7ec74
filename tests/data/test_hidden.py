"""Hidden effects of virtual arms: said in words, of a size that shows, with what drives them."""

import numpy as np
import pytest

from workbench import evaluate, measure_poses
from workbench.arm.effects import EFFECTS
from workbench.arm.statics.deflection import shift_of
from workbench.data.simulation.hidden_effects import MAX_BEND, hidden_effects, varied_state


@pytest.mark.parametrize("name", EFFECTS)
def test_every_effect_can_be_hidden(aria, name):
    (effect,), (note,) = hidden_effects(aria, [name], rng=np.random.default_rng(0))
    assert effect.name == name
    assert all(n in note for n in (name, *effect.names))
    robot = aria.with_effects(effect)
    rng = np.random.default_rng(1)
    q = rng.uniform(*aria.search_limits.T, (120, 6))
    largest = np.abs(shift_of(robot, varied_state(robot, q, rng=rng))).max()
    if name == "thermal-growth":
        assert effect.coefficients == (2.3e-5,)  # aluminium
        assert 1e-5 < largest < 1e-3
    else:
        assert 0.5 * MAX_BEND < largest < 1.5 * MAX_BEND


def test_joint_and_size_are_as_said(aria):
    rng = np.random.default_rng(0)
    text = ["joint-compliance:3:4e-5", "base-drift::1e-7", "joint-coupling:4:1e-3", "backlash:5:2e-3"]
    compliance, drift, coupling, backlash = hidden_effects(aria, text, rng=rng)[0]
    assert (compliance.joints, compliance.coefficients) == ((2,), (4e-5,))
    assert drift.joints == ()
    assert np.linalg.norm(drift.coefficients[:3]) == pytest.approx(1e-7)
    assert (coupling.joints, coupling.coefficients) == ((3, 2), (1e-3,))
    assert (backlash.joints, backlash.coefficients) == ((4,), (2e-3,))
    given = EFFECTS["encoder-scale"]((1,), (5e-4,))
    assert hidden_effects(aria, [given], rng=rng)[0] == (given,)


def test_rows_carry_what_drives_the_effects(aria):
    effects = ("thermal-growth", "base-drift", EFFECTS["backlash"]((1,), (1e-3,), by="motion"))
    actual, rows = measure_poses(aria, 40, instrument="ideal", effects=effects, seed=3)
    assert [e.name for e in actual.effects] == ["thermal-growth", "base-drift", "backlash"]
    assert set(np.unique(rows.direction)) == {-1.0, 1.0}
    # a driver that goes along with another can't be told from it
    assert abs(np.corrcoef(rows.time, rows.temperature)[0, 1]) < 0.7
    assert rows.payload is None
    assert evaluate(actual, rows).errors.position_mm.max < 1e-9
    straight = evaluate(actual.with_effects(), rows).errors.position_mm.max
    assert straight > 0.5
    plain, same = measure_poses(aria, 40, instrument="ideal", seed=3)
    assert not plain.effects
    assert same.time is None
