"""What is left: noise of joint readings, told from noise of the instrument."""

from dataclasses import replace

import numpy as np
import pytest
from arms import ARMS, make
from conditions import CONDITIONS, under
from judge import error_of
from problems import fitted

from workbench.diagnosis.diagnose import diagnose
from workbench.diagnosis.report.results_json import diagnosis_json
from workbench.diagnosis.result import Verdict
from workbench.identification.joint_reading_noise import _cost, _Residuals, readings, with_joint_readings

READINGS = np.deg2rad(0.03)
"""Noise of joint readings [rad]: 0.5 mrad, some five times what the instrument brings at a metre."""


def joint_noise(fit):
    """What a fit says of joint readings."""
    return readings(fit.problem.with_noise(with_joint_readings(fit.problem, fit.x, fit.factor)))


def trembling(case, sigma, seed):
    """The case with readings that are off by random angles [rad], though the arm stands elsewhere."""
    off = sigma * np.random.default_rng(seed).standard_normal(case.data.q.shape)
    return replace(case, data=replace(case.data, q=case.data.q + off))


@pytest.mark.parametrize("arm", ARMS)
@pytest.mark.parametrize("seed", range(2))
def test_noisy_readings_are_recognised_and_noise_of_the_instrument_is_not_taken_for_them(arm, seed):
    case = make("none", seed, arm)
    found = joint_noise(fitted(trembling(case, READINGS, seed)))
    assert found is not None
    np.testing.assert_allclose(found.sigma, READINGS, rtol=0.15)
    assert found.share > 0.8
    assert joint_noise(fitted(case)) is None
    deep = case.data.position + np.random.default_rng(seed).normal(0, 4e-4, (len(case.data), 1)) * [0, 0, 1]
    assert joint_noise(fitted(replace(case, data=replace(case.data, position=deep, rotation=None)))) is None


def test_readings_that_a_file_rounds_are_told_from_readings_that_scatter():
    """The arm was to settle, though the file held its joints to a tenth of a degree."""
    case = make("none", 1, "aria")
    rounded = replace(case, data=replace(case.data, q=np.deg2rad(np.round(np.rad2deg(case.data.q), 1))))
    assert joint_noise(fitted(rounded)).digit == 0.1
    assert joint_noise(fitted(trembling(rounded, READINGS, 1))).digit == 0.0
    trembled = trembling(case, READINGS, 1).data.q
    both = replace(case, data=replace(case.data, q=np.deg2rad(np.round(np.rad2deg(trembled), 2))))
    assert joint_noise(fitted(both)).digit == 0.0
    shown = case.data.q.copy()
    shown[:, 4] = np.deg2rad(0.2 * np.round(np.rad2deg(shown[:, 4]) / 0.2))
    assert joint_noise(fitted(replace(case, data=replace(case.data, q=shown)))).digit == 0.2


def test_every_joint_has_its_own_noise():
    """One loose encoder among good ones, also beside a joint with an error that follows its angle."""
    case = make("none", 4)
    off = 5e-4 * np.sin(2.0 * case.data.q) * np.eye(6)[4]
    off[:, 2] = READINGS * np.random.default_rng(4).standard_normal(len(off))
    found = joint_noise(fitted(replace(case, data=replace(case.data, q=case.data.q + off))))
    assert found.sigma[2] == pytest.approx(READINGS, rel=0.2)
    assert max(np.delete(found.sigma, 2)) < 0.1 * READINGS
    assert found.text(case.robot.chain).endswith("mrad in joint 3")


def test_a_diagnosis_weighs_by_noisy_readings_and_begins_with_them():
    """Before any effect is looked for; a local joint error and gravity sag were named instead."""
    case = under(CONDITIONS["joints"], "none", 3)
    result = diagnose(case.robot, case.data, held_out=0.0)
    assert result.effects == ()
    assert result.verdict is Verdict.NO_EFFECT
    assert result.message.startswith("The joint readings scatter by 0.2")
    assert "is mostly that of the joint readings" in result.message
    assert error_of(result.calibrated, case) < 0.5
    stated = diagnosis_json(result)["joint_noise_deg"]
    np.testing.assert_allclose(stated, np.rad2deg(2e-4), rtol=0.2)


@pytest.mark.parametrize("kind", ["dragging-hose", "kinked-gear"])
def test_errors_that_follow_the_angle_of_a_joint_are_no_noise_of_its_readings(kind):
    assert joint_noise(fitted(make(kind, 31, "three-parallel"))) is None


def test_variances_that_floating_point_makes_indefinite_cost_infinity():
    """One reading with a tiny stated noise and a large joint variance broke the factorisation."""
    rng = np.random.default_rng(0)
    ones = np.ones((5, 3))
    by_joint = rng.standard_normal((5, 3, 1))
    table = _Residuals(
        rng.standard_normal((5, 3)), 1e-30 * ones, ones > 0.0, by_joint, ones[:, :1], np.zeros(3, int)
    )
    assert _cost([table], np.eye(5), np.array([0.0, 0.0, 0.0, 0.0, 1.0]))[0] == np.inf
    assert np.isfinite(_cost([table], np.eye(5), np.ones(5))[0])
