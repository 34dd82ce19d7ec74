"""The thesis's virtual arms against the suite's own generator, and by hand where that has no counterpart."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis import laws
from generator import katana as other_katana
from generator import move, turn

from studies import katana_printed as printed
from studies.katana_generator import NOMINAL, VirtualKatana


def arm(**changes):
    """An arm with errors of all constants that place its joints; d of joints 1 to 4 is none of them."""
    errors = 1e-3 * np.random.default_rng(1).standard_normal((6, 5))
    errors[:4, 4] = 0.0
    return replace(
        VirtualKatana(
            table=NOMINAL + errors,
            clearance=np.zeros(5),
            backlash=np.zeros(5),
            stiffness=np.full(5, np.inf),
            waves=np.zeros((5, 7, 2)),
        ),
        **changes,
    )


@pytest.fixture(scope="module")
def q():
    return other_katana().random(np.random.default_rng(0), 200)


def counterpart(actual):
    """The same geometry in the test suite's generator, whose fifth link begins before d and not behind."""
    alpha, a, beta, theta, d = actual.table.T
    table = np.column_stack([theta, d, a, alpha, beta])[:5]
    tool = turn("x", alpha[5]) @ turn("y", beta[5]) @ move("x", a[5]) @ move("z", d[5]) @ turn("z", theta[5])
    return replace(other_katana(), table=table, tool=tool)


def test_a_straight_arm_stands_where_the_other_generator_says(q):
    actual = arm()
    assert np.abs(actual.poses(q) - counterpart(actual).pose(q)).max() < 1e-13


def test_tilting_is_that_of_the_other_generator(q):
    """Clearance of joints 1 to 4, backlash and compliance of 2 to 5; rows where a moment flips set apart."""
    clearance = printed.CLEARANCE * [1, 1, 1, 1, 0]
    actual = arm(clearance=clearance, backlash=printed.BACKLASH, stiffness=printed.STIFFNESS)
    effects = [laws.Effect("clearance-tilt", (j,), (clearance[j],)) for j in range(4)]
    for j in range(1, 5):
        effects.append(laws.Effect("backlash", (j,), (printed.BACKLASH[j],), detail="moment"))
        effects.append(laws.Effect("joint-compliance", (j,), (1.0 / printed.STIFFNESS[j],)))
    zeros = np.zeros(len(q))
    state = laws.State(q=q, direction=np.ones_like(q), time=zeros, temperature=zeros, payload=zeros)
    other = counterpart(actual)
    distance = np.abs(actual.poses(q) - laws.poses(other, effects, state)).max(axis=(1, 2))
    moments = laws.straight_moments(other, state)
    plain = (np.abs(moments[:, 1:, 2]).min(axis=1) > 0.05) & (
        np.linalg.norm(moments[:, :4, :2], axis=2).min(axis=1) > 0.05
    )
    assert plain.sum() > 120
    assert distance[plain].max() < 1e-8
    assert np.abs(actual.poses(q) - arm().poses(q)).max() > 5e-4
