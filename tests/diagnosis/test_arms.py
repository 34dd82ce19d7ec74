"""The virtual arms that judge the diagnosis: against the package, and as stated."""

from dataclasses import replace

import numpy as np
import pytest
from arms import ARMS, MORPHOLOGIES, ROWS, TUNING, make
from cases import stated
from checks import joint_wrenches, robot_of
from decide import catalogue, coefficients
from draws import draw
from laws import WHOLE, Effect, change, poses, straight_moments, turns

from workbench import Motion, tool_poses
from workbench.arm.effects import EFFECTS

UNDRAWN = {
    *("local-joint-error", "uneven-compliance", "gravity-sag"),
    *("extension-compliance", "extension-clearance"),
    *(name for name, kind in EFFECTS.items() if kind.is_event),
}
"""What no arm hides under this name: shapes without a name, the compliance of arms without masses, events."""


@pytest.mark.parametrize("name", MORPHOLOGIES)
def test_poses_and_moments_equal_the_package(name, tmp_path):
    """Its own equal pinocchio's."""
    case = make("none", TUNING[1], name, free_frames=True)
    arm, robot, payload = case.actual, robot_of(case.actual, tmp_path), np.full(ROWS, 1.3)
    state = replace(case.state, payload=payload)
    np.testing.assert_allclose(poses(arm, [], state), tool_poses(robot, Motion(state.q)), atol=1e-12)
    about = np.where(np.array(arm.sliding)[:, None], [3, 4, 2], [3, 4, 5])
    held = np.take_along_axis(joint_wrenches(robot, state.q, payload=payload), about[None], axis=2)
    np.testing.assert_allclose(straight_moments(arm, state), held, atol=1e-10)


@pytest.mark.parametrize("name", [*ARMS, "scara", "gantry"])
def test_laws_equal_the_package_to_first_order(name, tmp_path):
    """Every effect of the catalogue in every joint: the check of conventions and signs."""
    case = make("payload", TUNING[4], name, free_frames=True)
    arm, state, rng = case.actual, case.state.take(slice(0, 30)), np.random.default_rng(0)
    robot = robot_of(arm, tmp_path)
    drivers = {n: getattr(state, n) for n in ("direction", "time", "temperature", "payload")}
    motion = Motion(state.q, **drivers)
    plain, tried = poses(arm, [], state), set()
    for effect in catalogue(arm):
        size = (1e-7 if effect.name in WHOLE else 1e-5) * rng.uniform(0.5, 1.0, coefficients(effect))
        effect = replace(effect, size=tuple(size.tolist()))
        mine = change(poses(arm, [effect], state), plain)
        theirs = change(tool_poses(robot.with_effects(stated(effect)), motion), plain)
        if np.abs(mine).max() > 1e-9:
            assert np.abs(theirs - mine).max() < 0.01 * np.abs(mine).max(), effect
            tried.add(effect.name)
        else:
            assert np.abs(theirs).max() < 1e-9, effect
    assert tried == set(EFFECTS) - UNDRAWN


def test_a_slide_shifts_where_a_joint_turns():
    """Its compliance is that of the force along it, and a law of turns counts its way."""
    case = make("none", TUNING[2], "scara")
    arm, state = replace(case.actual, table=MORPHOLOGIES["scara"]().table), case.state.take(slice(0, 5))
    state = replace(state, payload=np.full(5, 2.0))
    held = straight_moments(arm, state)
    weight = 9.81 * (0.9 + 0.4 + 2.0)
    np.testing.assert_allclose(held[:, 2, 2], -weight, rtol=1e-12)  # its axis points down
    moved = change(poses(arm, [Effect("joint-compliance", (2,), (1e-5,))], state), poses(arm, [], state))
    np.testing.assert_allclose(moved, [[0, 0, -1e-5 * weight, 0, 0, 0]] * 5, atol=1e-12)
    assert draw("joint-harmonic", arm, state, np.random.default_rng(0), joint=2, detail=1) is None
    dent = Effect("dent", (2,), (1e-3,), shape=(2 * np.pi * 0.1, 1.0))
    middle = replace(state, q=state.q * [1, 1, 0, 1] + [0, 0, 0.1, 0])
    np.testing.assert_allclose(turns(arm, dent, middle, None)[:, 2, 2], 1e-3)
