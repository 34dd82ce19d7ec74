"""Loads that vary at a few postures: what geometry can't take is found though it moved little else."""

from dataclasses import replace

import numpy as np
import pytest
from generator import move, turn

from workbench import Dataset, Robot, diagnose
from workbench.diagnosis.coverage import loads_vary
from workbench.identification.meaning.nominal_fit import with_holding_torques

COMPLIANCE, OWN, LENGTHS = 8e-5, 4.0, (0.4, 0.35)
LINKS = [{"d": 0.34, "alpha": -np.pi / 2}, *({"a": a} for a in LENGTHS), {"alpha": np.pi / 2}, {"d": 0.1}]
ARM = Robot.from_dh(LINKS, name="loaded")


def swept(loads=(0.0, 1.25, 2.5)) -> Dataset:
    """Joint 2 of a stretched arm swept at three angles of joint 1 under some loads: own kinematics."""
    rng, rows = np.random.default_rng(2), []
    for load in loads:
        for q1 in (-1.0, 0.0, 1.0):
            for q2 in np.linspace(-1.4, 1.4, 12):
                reach = sum(LENGTHS)
                torque = -9.81 * (OWN * reach / 2 + load * reach) * np.cos(q2)  # z of joint 2 points aside
                angle = q2 - COMPLIANCE * torque
                here = turn("z", q1) @ move("z", 0.34) @ turn("x", -np.pi / 2) @ turn("z", angle)
                here = here @ move("x", reach) @ turn("x", np.pi / 2) @ move("z", 0.1)
                rows.append((q1, q2, load, torque, *here[:3, 3]))
    table = np.array(rows)
    q, torque = np.zeros((2, len(table), 5))
    q[:, :2], torque[:, 1] = table[:, :2], table[:, 3]
    noisy = table[:, 4:] + rng.normal(0.0, 5e-5, (len(table), 3))
    return Dataset(q=q, position=noisy, torque=torque, payload=table[:, 2], source="sweep")


def test_torques_of_the_load_are_read_as_those_that_hold_it():
    rows = swept()
    turned = replace(rows, torque=-rows.torque)
    alone = replace(turned, payload=None)
    assert with_holding_torques(ARM, rows) is rows
    for shown in (turned, alone):
        read = with_holding_torques(ARM, shown)
        np.testing.assert_array_equal(read.torque, rows.torque)
        assert "sign of the load" in read.notes[-1]


def test_a_joint_that_yields_is_found_where_only_the_load_varies():
    rows = swept()
    found = diagnose(ARM, replace(rows, torque=-rows.torque))
    (cause,) = found.causes
    assert (cause.effects[0].name, cause.effects[0].joints) == ("joint-compliance", (1,))
    assert cause.effects[0].coefficients[0] == pytest.approx(COMPLIANCE, rel=0.02)
    assert found.after.held_out.position_mm.rms < 0.15
    assert any("only effects of the load" in note for note in found.notes)


def test_one_load_leaves_too_few_directions():
    rows = swept(loads=(2.5,))
    assert not loads_vary(rows)
    found = diagnose(ARM, rows)
    assert (found.is_tried, found.verdict) == (False, "unexplained")
