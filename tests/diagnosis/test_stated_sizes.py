"""What is stated of sizes: only what the rows support, and ± that hold where rows share an error."""

from dataclasses import replace

import numpy as np
import pytest
from refusals import mentions

import workbench as wb
from workbench.arm.effects.bearing_compliance import BearingCompliance
from workbench.arm.effects.joint_harmonic import JointHarmonic
from workbench.arm.effects.local_joint_error import LocalJointError
from workbench.arm.motion import Motion
from workbench.diagnosis.claims.named_joints import sentence_of
from workbench.diagnosis.claims.standard_errors import MIN_PLACES, dependence
from workbench.plate.simulated_measurement import measure_poses

ARIA = wb.load_robot("aria")
REPEATS = 5


class Independent(dict):
    """Standard errors of coefficients that err independently."""

    def covariance(self, names):
        return np.diag([self[n] ** 2 for n in names])


def rows_over(degrees):
    """Rows in which every joint turns so far."""
    half = np.deg2rad(degrees) / 2.0
    return Motion(np.repeat(np.linspace(-half, half, 200)[:, None], ARIA.dof, axis=1))


def test_a_size_that_the_rows_do_not_show_is_not_the_largest():
    tilt = BearingCompliance((0, 3, 4), (5.9e-5, 3.2e-5, 1.02e-4))
    std = Independent(zip(tilt.names, (1.4e-5, 9.5e-5, 9.5e-5), strict=True))
    result = sentence_of(tilt, (), std, ARIA, rows_over(90.0))
    assert BearingCompliance((0,), (5.9e-5,)).sentence(ARIA.chain, rows_over(90.0)) in result
    assert mentions(result, "joints 4, 5")
    clear = Independent.fromkeys(tilt.names, 1e-6)
    assert sentence_of(tilt, (), clear, ARIA, rows_over(90.0)) == tilt.sentence(ARIA.chain, rows_over(90.0))


@pytest.mark.parametrize(
    ("order", "degrees", "named"), [(1, 350.0, True), (1, 200.0, False), (2, 200.0, True), (11, 20.0, False)]
)
def test_an_order_is_named_where_the_rows_hold_a_period(order, degrees, named):
    rows = rows_over(degrees)
    result = JointHarmonic((2,), (1e-3, 0.0), order=order).stated(ARIA.chain, rows, 1e-12 * np.eye(2))
    assert ("per turn" in result) is named
    assert (f"{degrees:.0f}°" in result) is (degrees < 340.0)


def test_the_largest_error_of_a_joint_is_one_that_the_rows_support():
    """A knot at the end of the range that hardly any row sees."""
    dent = LocalJointError((2,), (0.0, 1e-3, 0.0, 0.0, 5e-3), knots=(-1.0, -0.5, 0.0, 0.5, 1.0))
    rows = rows_over(np.rad2deg(2.0))
    std = np.array([1e-5, 1e-5, 1e-5, 1e-5, 1e-2])
    bare, supported = (
        np.abs(dent.increments(ARIA.chain, rows, None)[:, 0]).max(),
        dent.stated(ARIA.chain, rows, np.diag(std**2)),
    )
    assert bare > 4e-3
    size = float(supported.split("up to ")[1].split(" mrad")[0])
    assert size < 3.0


@pytest.fixture(scope="module")
def measured():
    """Poses that were measured several times each, with an error of each pose and less of each reading."""
    _, rows = measure_poses(ARIA, 3 * MIN_PLACES, instrument="ideal", seed=5)
    return rows.take(np.repeat(np.arange(len(rows)), REPEATS))


def fitted(rows, shared, own):
    rng = np.random.default_rng(2)
    place = np.arange(len(rows)) // REPEATS
    error = shared * rng.standard_normal((place.max() + 1, 3))[place] + own * rng.standard_normal(
        (len(rows), 3)
    )
    data = replace(rows, position=rows.position + error, rotation=None, sigma=None, row=np.arange(len(rows)))
    return wb.identify(ARIA, data, held_out=0.0).best.fit


def test_standard_errors_count_places_whose_rows_share_an_error(measured):
    """Readings of one pose that all err alike tell no more than one: ± grows by the root of their number."""
    together, separate = (dependence(fitted(measured, *sizes)) for sizes in ((1e-4, 1e-6), (0.0, 1e-4)))
    assert np.median(together) == pytest.approx(np.sqrt(REPEATS), rel=0.25)
    assert np.median(separate) < 1.2
    assert separate.min() >= 1.0
