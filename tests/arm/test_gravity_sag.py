"""Sag by unknown weights: it holds what any masses do, in the fewest terms, with the right derivative."""

from dataclasses import replace

import generator
import numpy as np
import pytest
from checks import robot_of

from workbench.arm.effects.gravity_sag import GravitySag, terms_of
from workbench.arm.motion import Motion

TOOL = generator.move("z", 0.13) @ generator.turn("x", 0.4) @ generator.move("y", 0.05)
BASE = generator.turn("y", 0.3) @ generator.move("x", 0.2)
ARMS = {
    "aria": lambda: replace(generator.aria(), base=BASE, tool=TOOL),
    "three-parallel": lambda: replace(generator.three_parallel(), tool=TOOL),
    "sliding": lambda: replace(
        generator.aria(),
        convention="dh",
        slides=(False, False, False, True, False, False),
        tool=TOOL,
        limits=None,
    ),
}
DOWN = np.array([0.36, 0.48, -0.8])


@pytest.fixture(scope="module", params=ARMS)
def pair(request, tmp_path_factory):
    """The generator's arm, and the package's without masses; gravity is aslant."""
    arm = ARMS[request.param]()
    robot = robot_of(arm, tmp_path_factory.mktemp(request.param))
    bare = replace(robot, joints=tuple(replace(j, mass=None) for j in robot.joints))
    return replace(arm, gravity=9.81 * DOWN), bare.under(9.81 * DOWN)


def motion_of(robot, rows=60):
    rng = np.random.default_rng(0)
    return Motion(rng.uniform(-2.0, 2.0, (rows, robot.dof)), payload=rng.uniform(0.0, 2.0, rows))


def sags(robot):
    """A sag of every turning joint, by everything."""
    for joint in (j for j in range(robot.dof) if robot.moving[j].kind == "revolute"):
        yield GravitySag((joint,), terms=terms_of(robot.chain, joint, payload=True), gravity=tuple(DOWN))


def test_terms_by_hand(pair):
    chain = pair[1].chain
    slides = pair[1].moving[3].kind == "prismatic"
    assert terms_of(chain, 2) == f"3x 3y {'4m' if slides else '4x 4y'} 5x 5y 6x 6y"
    assert terms_of(chain, 5, payload=True) == "6x 6y payload"


def test_any_masses_are_held_and_no_term_is_superfluous(pair):
    arm, robot = pair
    motion = motion_of(robot)
    rng = np.random.default_rng(1)
    arm = replace(arm, masses=rng.uniform(0.5, 5.0, arm.dof), coms=rng.normal(0.0, 0.2, (arm.dof, 3)))
    moments = arm.moments(motion.q, motion.payload)[:, :, 2]
    for effect in sags(robot):
        law = effect.law(robot.chain, motion, np.zeros((0, 0, 6)))[:, 0]
        sizes, _, rank, _ = np.linalg.lstsq(law, -moments[:, effect.joints[0]])
        np.testing.assert_allclose(law @ sizes, -moments[:, effect.joints[0]], atol=1e-10)
        assert rank == len(effect.names)
        assert sizes[-1] == pytest.approx(9.81)
