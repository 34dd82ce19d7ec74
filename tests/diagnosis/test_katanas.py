"""Katana arms that tilt: the package's model against the generator's, and joints found blind from poses."""

import numpy as np
import pytest
from arms import robot_of
from katanas import TILTING, make_katana
from laws import change, poses, straight_moments

from workbench import Motion, diagnose, tool_poses
from workbench.arm.effects import EFFECTS

SEED = 10_001
UPRIGHT = 0.005
"""Moment across an axis [N m] below which a loose joint may snap over by itself."""


def stated(hidden, joints=TILTING):
    """The hidden effects as the package writes them, one record a kind."""
    names = dict.fromkeys(e.name for e in hidden)
    return [EFFECTS[n](joints, tuple(e.size[0] for e in hidden if e.name == n)) for n in names]


@pytest.mark.parametrize("seed", [SEED, SEED + 1])
def test_the_arm_as_made_stands_where_the_generator_says(seed):
    """Large torques about a tilted axis must not leak into the small moments across it."""
    case = make_katana(seed)
    robot = robot_of(case.actual, "made", False).with_effects(*stated(case.hidden))
    off = change(tool_poses(robot, Motion(case.state.q)), poses(case.actual, case.hidden, case.state))
    held = straight_moments(case.actual, case.state)[:, TILTING]
    firm = (np.linalg.norm(held[:, :, :2], axis=2) > UPRIGHT).all(1)
    deflected = change(
        tool_poses(robot.with_effects(), Motion(case.state.q)), poses(case.actual, case.hidden, case.state)
    )
    assert firm.mean() > 0.9
    assert np.abs(deflected[:, :3]).max() > 1e-3
    assert np.abs(off[firm, :3]).max() < 1e-6


@pytest.mark.slow
def test_clearance_and_backlash_are_found_blind_from_poses():
    """Joints 2 to 5 within 15 % of Table 4.3, and within four standard errors."""
    case = make_katana(SEED, spread=0.0)
    result = diagnose(case.robot, case.data, held_out=0.0)
    found = {
        name: (value, std)
        for e in result.effects
        for name, value, std in zip(e.effect.names, e.effect.coefficients, e.std, strict=True)
    }
    requested = [n for n in case.sizes if not n.endswith("compliance")]
    assert len(requested) == 2 * len(TILTING)
    for name in requested:
        value, std = found[name]
        assert value == pytest.approx(case.sizes[name], rel=0.15)
        assert abs(value - case.sizes[name]) < 4.0 * std
        assert std < 0.1 * case.sizes[name]
