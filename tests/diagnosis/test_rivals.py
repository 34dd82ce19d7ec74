"""What else may move the rows as a claim does: gravity that isn't the file's, a base, a sign, a column."""

from dataclasses import replace

import numpy as np
import pytest
from arms import make
from test_without_masses import massless

from workbench import Motion, diagnose, tool_poses
from workbench.arm.effects import EFFECTS
from workbench.arm.effects.effect import NO_WRENCHES
from workbench.arm.kinematics.forward import geometric_jacobian
from workbench.diagnosis.confidence import Confidence
from workbench.diagnosis.drivers.driver import Driver

CASE = make("none", 3, "aria")
TOOL = tool_poses(CASE.robot, Motion.of(CASE.data))
WAYS = geometric_jacobian(CASE.robot, CASE.data.q)[:, :3].transpose(0, 2, 1)
HALF = np.arange(len(CASE.data)) * 7 % 13 < 6


def moved(by, **columns):
    """Points alone of an arm without masses that are moved so."""
    plain = dict.fromkeys(("rotation", "payload", "direction", "time", "temperature"))
    return replace(CASE.data, position=CASE.data.position + by, **plain | columns)


def test_a_sag_is_no_larger_where_gravity_has_no_lever():
    """A tilt of 0.05° was multiplied by a sag of 746 mrad."""
    sag = EFFECTS["gravity-sag"]((0,), terms="2x 2y", gravity=(0.001, 0.0, -1.0))
    assert max(sag.bounds(CASE.robot.chain, Motion.of(CASE.data), NO_WRENCHES)) <= sag.credible[0]


def test_an_undecided_law_does_not_turn_a_flange_that_nobody_sees_turn():
    """A loose reflector added a sag of joint 6 by 4 mrad: more than all constants turn a flange."""
    down = np.sign(TOOL[:, 2, 0])
    found = diagnose(massless(CASE.robot), moved(1.5e-3 * down[:, None] * TOOL[:, :3, 0]), held_out=0.0)
    assert not [e.effect.label for e in found.effects if {*e.effect.joints} & {4, 5}]


def test_a_pull_on_the_tool_is_told_from_gravity_in_another_direction_by_no_rows():
    tilted = WAYS[:, 1] @ np.array([0.0, 0.6, -0.8])
    found = diagnose(massless(CASE.robot), moved(3e-3 * tilted[:, None] * WAYS[:, 1]), held_out=0.0)
    assert "hose" not in found.message or "cannot tell" in found.message
    assert "check whether the base is level" in found.message


def test_a_base_that_sinks_under_the_payload_is_no_other_payload():
    """It was 'a payload that isn't what the file says: 3.8 kg less (certain)'."""
    payload = 4.0 * (np.arange(len(CASE.data)) * 7 % 3)
    sunk = moved(-4e-5 * payload[:, None] * np.eye(3)[2], payload=payload)
    (first, *_) = diagnose(CASE.robot, sunk, held_out=0.0).followed
    assert (first.driver, first.confidence) == (Driver.LOAD, Confidence.CERTAIN)
    assert first.text == "follows the payload, in the measuring frame (certain)"


def test_a_joint_that_leads_has_no_play():
    sign = np.where(HALF, 1.0, -1.0)
    direction = np.zeros(CASE.data.q.shape)
    direction[:, 2] = sign
    (cause,) = diagnose(
        massless(CASE.robot), moved(5e-4 * sign[:, None] * WAYS[:, 2], direction=direction), held_out=0.0
    ).causes
    assert "Joint 3 goes beyond where it is told, in the direction of its motion, by 0.49" in cause.text
    assert cause.confidence is Confidence.PROBABLE
    assert "other sign" in cause.doubt


@pytest.mark.parametrize(("at", "name"), [(np.ones(len(HALF)), "in joint 2"), (WAYS[:, 1, 2], "payload")])
def test_a_left_out_column_that_explains_the_error_is_named(at, name):
    """Joint 2 was accused of scatter."""
    off = moved(
        1e-3 * (HALF * at)[:, None] * WAYS[:, 1],
        unread={"{Zustand}": np.where(HALF, "+", "-").astype(object)},
    )
    found = diagnose(massless(CASE.robot), off, held_out=0.0)
    assert "follows the column '{Zustand}'" in found.message
    assert name in found.message
    assert "scatter" not in found.message
