"""What is left: structure, and noise of joint readings, told from noise of the instrument."""

from dataclasses import replace

import numpy as np
import pytest
from arms import ARMS, make
from problems import fitted

from workbench.diagnosis.leftover import joint_noise, structured

READINGS = np.deg2rad(0.03)
"""Noise of joint readings [rad]: 0.5 mrad, some five times what the instrument brings at a metre."""


def trembling(case, sigma, seed):
    """The case with readings that are off by random angles [rad], though the arm stands elsewhere."""
    off = sigma * np.random.default_rng(seed).standard_normal(case.data.q.shape)
    return replace(case, data=replace(case.data, q=case.data.q + off))


@pytest.mark.parametrize("arm", ARMS)
@pytest.mark.parametrize("seed", range(3))
def test_noisy_readings_are_recognised(arm, seed):
    case = trembling(make("none", seed, arm), READINGS, seed)
    found = joint_noise(fitted(case).fit)
    assert found is not None
    assert found.sigma == pytest.approx(READINGS, rel=0.15)
    assert found.share > 0.8


@pytest.mark.parametrize("arm", ARMS)
@pytest.mark.parametrize("seed", range(5))
def test_noise_of_the_instrument_is_not_taken_for_it(arm, seed):
    case = make("none", seed, arm)
    assert joint_noise(fitted(case).fit) is None
    positions = replace(case, data=replace(case.data, rotation=None))
    assert joint_noise(fitted(positions).fit) is None


def test_noisy_readings_show_in_positions_alone():
    case = trembling(make("none", 1), READINGS, 1)
    found = joint_noise(fitted(replace(case, data=replace(case.data, rotation=None))).fit)
    assert found is not None
    assert found.sigma == pytest.approx(READINGS, rel=0.25)


def test_what_a_missing_effect_leaves_has_structure():
    """A clearance of many noise units, in neighbouring poses alike; and noise has none."""
    bent, clean = 0, 0
    for seed in range(6):
        rng = np.random.default_rng(seed)
        bent += structured(fitted(make("compliance-all", seed, "katana")).fit, rng)
        clean += structured(fitted(make("none", seed, "katana")).fit, rng)
    assert bent >= 5
    assert clean == 0
