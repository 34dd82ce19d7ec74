"""What is stated of sizes: only what the rows support, and ± that hold where rows share an error."""

from dataclasses import replace

import numpy as np
import pytest

import workbench as wb
from workbench import Motion, measure_poses
from workbench.arm.effects.joint_harmonic import JointHarmonic
from workbench.diagnosis.claims.standard_errors import MIN_PLACES, dependence

ARIA = wb.load_robot("aria")
REPEATS = 5


@pytest.mark.parametrize(
    ("order", "degrees", "named"), [(1, 350.0, True), (1, 200.0, False), (2, 200.0, True), (11, 20.0, False)]
)
def test_an_order_is_named_where_the_rows_hold_a_period(order, degrees, named):
    half = np.deg2rad(degrees) / 2.0
    rows = Motion(np.repeat(np.linspace(-half, half, 200)[:, None], ARIA.dof, axis=1))
    result = JointHarmonic((2,), (1e-3, 0.0), order=order).stated(ARIA.chain, rows, 1e-12 * np.eye(2))
    assert ("per turn" in result) is named
    assert (f"{degrees:.0f}°" in result) is (degrees < 340.0)
    assert float(result.partition("up to ")[2].split()[0]) <= 1.0


@pytest.fixture(scope="module")
def measured():
    """Poses that were measured several times each, with an error of each pose and less of each reading."""
    _, rows = measure_poses(ARIA, 3 * MIN_PLACES, instrument="ideal", seed=5)
    return rows.take(np.repeat(np.arange(len(rows)), REPEATS))


def fitted(rows, shared, own):
    rng = np.random.default_rng(2)
    place = np.arange(len(rows)) // REPEATS
    error = shared * rng.standard_normal((place.max() + 1, 3))[place]
    error += own * rng.standard_normal((len(rows), 3))
    data = replace(rows, position=rows.position + error, rotation=None, sigma=None, row=np.arange(len(rows)))
    fit = wb.identify(ARIA, data, held_out=0.0).best.fit
    return replace(fit, problem=replace(fit.problem, shares=None))  # rows alone, as a diagnosis fits them


def test_standard_errors_count_places_whose_rows_share_an_error(measured):
    """Readings of one pose that all err alike tell no more than one: ± grows by the root of their number."""
    together, separate = (dependence(fitted(measured, *sizes)) for sizes in ((1e-4, 1e-6), (0.0, 1e-4)))
    assert np.median(together) == pytest.approx(np.sqrt(REPEATS), rel=0.25)
    assert np.median(separate) < 1.2
    assert separate.min() >= 1.0
