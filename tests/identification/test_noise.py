"""What rows state of their noise is the instrument's repeatability; what the model lacks comes on top."""

import re
from dataclasses import replace
from functools import cache

import generator
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from workbench import Dataset, diagnose, evaluate, identify, load_robot, read_measurements
from workbench.identification.noise import from_repeats

SIGMA = 5e-5, 2e-4
"""What the arm is measured with, and what a few rows claim is a thousandth of it [m, rad]."""


@pytest.fixture(scope="module")
def rows():
    """An arm that sags, of which its geometry knows nothing; 100 rows, and noise-free ones."""
    rng = np.random.default_rng(5)
    nominal = generator.aria()
    arm = nominal.perturbed(rng, 1e-3, 3e-3)
    q = arm.random(rng, 160)
    sag = arm.sag(q, compliance=5e-5)
    return Dataset(q, *arm.measure(q, rng, *SIGMA, sag))


@cache
def fitted(data, **options):
    return identify(load_robot("aria"), data, held_out=0.25, algorithms=("opt2",), **options)


def claimed(data, position, rotation):
    sigma = np.empty((len(data), 6))
    sigma[:, :3], sigma[:, 3:] = np.reshape(position, (-1, 1)), np.reshape(rotation, (-1, 1))
    return replace(data, sigma=sigma)


def test_a_few_rows_that_claim_to_be_exact_do_not_carry_the_fit(rows):
    claims = np.full(160, SIGMA[0])
    claims[::10] = 1e-3 * SIGMA[0]
    plain, stated = fitted(rows), fitted(claimed(rows, claims, SIGMA[1]))
    assert stated.best.held_out.position_mm.mean < 1.05 * plain.best.held_out.position_mm.mean
    assert stated.best.held_out.orientation_deg.mean < 1.05 * plain.best.held_out.orientation_deg.mean
    assert stated.instrument.position == pytest.approx(np.sqrt(np.mean(claims**2)), rel=0.1)


def test_what_is_left_beyond_the_stated_noise_is_found():
    rng = np.random.default_rng(6)
    arm = generator.aria().perturbed(rng, 1e-3, 3e-3)
    q = arm.random(rng, 300)
    own = SIGMA[0] * np.exp(rng.uniform(-1.5, 1.5, 300))
    position, rotation = arm.measure(q, rng, 0.0, SIGMA[1])
    scatter = np.hypot(own, 1e-4)[:, None]
    data = Dataset(q, position + scatter * rng.standard_normal((300, 3)), rotation)
    found = fitted(claimed(data, own, SIGMA[1])).best.fit.problem.noise
    assert found.position == pytest.approx(1e-4, rel=0.12)
    assert found.rotation < 0.5 * SIGMA[1]


def test_a_sigma_of_zero_is_rounding(tmp_path, rows):
    head = ",".join(f"q{i}[rad]" for i in range(1, 7)) + ",x[m],y[m],z[m],sigma_x[mm],sigma_y[mm],sigma_z[mm]"
    table = np.column_stack([rows.q, rows.position, *[np.where(np.arange(160) % 4, 0.01, 0.0)] * 3])
    np.savetxt(path := tmp_path / "a.csv", table, "%.17g", ",", header=head, comments="")
    data = read_measurements(path)
    assert any("40 rows state a position sigma of 0" in note for note in data.notes)
    assert data.sigma[0, 0] == pytest.approx(5e-6)
    held, plain = (fitted(d).best.held_out.position_mm.mean for d in (data, replace(data, sigma=None)))
    assert held < 1.05 * plain
    assert evaluate(load_robot("aria"), data).errors.position_mm.mean > 0.0


def test_a_channel_that_gets_worse_than_nominal_is_refused(rows):
    """Sigma columns that call orientations meaningless: the fit turns the tool by degrees."""
    assert not fitted(rows).robot.calibration.refused
    claims = claimed(rows, 1e-3 * SIGMA[0], 1.0)
    stated = fitted(claims, deviation=np.inf)
    assert stated.best.held_out.orientation_deg.mean > 5.0 * stated.nominal.held_out.orientation_deg.mean
    refused = stated.robot.calibration.refused["TOML"]
    assert re.search("worse than nominal|off by .*° on average", refused)
    found = diagnose(load_robot("aria"), claims.take(np.arange(60)))  # which keeps constants near nominal
    turned = (each.held_out.orientation_deg.mean for each in (found.after, found.nominal))
    assert next(turned) < next(turned)


@pytest.mark.parametrize("missing", ["position", "rotation"])
def test_repeats_without_a_pose_leave_the_noise_of_the_others(rows, missing):
    """Twenty poses, four rows each; two are without a pose, one of them the first of its four."""
    four = {key: np.repeat(getattr(rows, key)[:20], 4, axis=0) for key in ("q", "position", "rotation")}
    four["position"] = four["position"] + np.random.default_rng(1).normal(0.0, SIGMA[0], (80, 3))
    spin = np.random.default_rng(2).normal(0.0, SIGMA[1], (80, 3))
    four["rotation"] = four["rotation"] @ Rotation.from_rotvec(spin).as_matrix()
    four[missing][[0, 33]] = np.nan
    noise = from_repeats(Dataset(row=np.arange(80), **four))
    assert noise is not None
    # 58 degrees of freedom of three components each: 5 % of a standard deviation
    assert noise.position == pytest.approx(SIGMA[0], rel=0.2)
    assert noise.rotation == pytest.approx(SIGMA[1], rel=0.2)


def test_eight_poses_tell_the_noise_of_both_channels():
    """Their geometry could pass through all positions, and a fit that weighs them ever more would."""
    ratios = []
    for seed in range(16):
        rng = np.random.default_rng(seed)
        arm = generator.aria().perturbed(rng, 1e-3, 3e-3)
        q = arm.random(rng, 8)
        found = identify(load_robot("aria"), Dataset(q, *arm.measure(q, rng, *SIGMA)), held_out=0.0)
        ratios.append(found.best.fit.problem.noise.position / SIGMA[0])
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.12)
