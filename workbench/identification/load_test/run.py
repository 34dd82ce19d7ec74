"""The experiment with inclinometers, planned and simulated: clearance, backlash and stiffness of each joint.

The readings of all postures are fitted together, the directions of the axes with them, so that no posture has
to be exact. Joints about which no gravity acts, as they stand upright, are pulled sideways at the tool
instead, and the tool's pose is measured; the other joints are then known from the inclinometers.

Source: Katana figs. 4.6, 4.9, 5.4; §4.4.1 for joint 1.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base.errors import OptionError
from workbench.data.dataset import Dataset
from workbench.data.simulation.instruments import INSTRUMENTS, Instrument
from workbench.data.simulation.simulate import simulate, virtual_arm
from workbench.identification.load_test.postures import (
    LoadingPlan,
    Purpose,
    SideLoads,
    loading_plan,
    pullable,
    side_loads,
)
from workbench.identification.load_test.result import LoadingResult
from workbench.identification.problem import Noise
from workbench.identification.tilting import (
    JointTilting,
    Tilting,
    fit_tilting,
    giving_way,
    tilting_effects,
)

REPEATS = 10
"""Readings of every posture, whose mean is taken."""
FORCE = 40.0
"""Greatest sideways pull at the tool [N]."""
CLEARANCE, BACKLASH, STIFFNESS = (0.015, 0.025), (0.045, 0.065), (70.0, 125.0)
"""Least and greatest sizes that a virtual arm has, after Katana Tables 4.3 and 4.4 [°, °, kg m/°]."""
LENGTH, ANGLE = 5e-5, float(np.deg2rad(0.1))
"""Greatest errors of its geometry [m, rad]."""


def loading_experiment(
    robot: Robot,
    *,
    joints: Sequence[int] | None = None,
    added_mass: float = 0.0,
    each: int = 4,
    repeats: int = REPEATS,
    force: float = FORCE,
    seed: int = 0,
) -> LoadingResult:
    """Plan the experiment for a robot, and simulate it on a virtual arm with hidden sizes.

    Args:
        robot: Nominal arm with masses and limits; effects that it carries are left out.
        joints: Joints to load by gravity, from 0; if None all that gravity turns, and the others by pulls.
        added_mass: Mass that can be hung onto the tool [kg].
        each: Pairs of postures for every joint and purpose.
        repeats: Readings of every posture.
        force: Greatest sideways pull at the tool for joints that gravity does not turn [N].
        seed: Of postures, hidden arm and noise.

    Raises:
        OptionError: no such joint, or no reading.
        DataError: postures that load a joint as asked can't be reached; names joint and purpose.
    """
    if repeats < 1:
        raise OptionError(f"{repeats} readings of every posture can't be; give 1 or more")
    rng = np.random.default_rng(seed)
    robot = robot.with_effects()
    plan = loading_plan(robot, joints=joints, added_mass=added_mass, each=each, rng=rng)
    pulled_at = [j for j in plan.unturned if joints is None and pullable(robot, j, rng=rng)]
    side = tuple(side_loads(robot, j, force=force, rng=rng) for j in pulled_at)
    hidden = draw_joints(asked_of(plan, pulled_at), rng)
    actual = virtual_arm(robot, rng=rng, length=LENGTH, angle=ANGLE).with_effects(*tilting_effects(hidden))
    inclinometer, tracker = INSTRUMENTS["inclinometer"], replace(INSTRUMENTS["optotrak"], sight=None)
    meter, tracker = (replace(instrument, samples=repeats) for instrument in (inclinometer, tracker))
    data = read_plan(actual, plan, instrument=meter, rng=rng)
    tilting = tilting_of(robot, plan, data, instrument=meter)
    pulled = tuple(
        pulled_joint(robot, tilting, loads, _pulled(actual, loads, tracker, rng)) for loads in side
    )
    return LoadingResult(
        robot=robot,
        plan=plan,
        data=data,
        tilting=tilting,
        side=side,
        side_tilting=pulled,
        hidden=hidden,
    )


def read_plan(
    actual: Robot, plan: LoadingPlan, *, instrument: Instrument, rng: np.random.Generator
) -> Dataset:
    """Readings of the inclinometers on an arm in the postures of a plan."""
    return simulate(actual, plan.q, instrument=instrument, rng=rng, motion=Motion(plan.q, payload=plan.added))


def tilting_of(robot: Robot, plan: LoadingPlan, data: Dataset, *, instrument: Instrument) -> Tilting:
    """What readings of a plan show of its joints, the directions of all axes fitted beside.

    Of joints that gravity does not turn, but tips, they show the clearance.
    """
    _, turn = instrument.deviations
    angles = [n for n in robot.default_free if robot.chain.elements[robot.chain.index[n]].axis.turns]
    noise = Noise(rotation=turn or Noise().rotation)
    return fit_tilting(robot, data, asked=asked_of(plan), noise=noise, free=angles)


def asked_of(plan: LoadingPlan, pulled: Sequence[int] = ()) -> tuple[JointTilting, ...]:
    """What a plan shows of each joint, 0 where it does; of pulled joints how they turn as well."""
    out = []
    for joint in sorted((*plan.joints, *plan.unturned)):
        tips = (joint, Purpose.CROSSWISE) not in plan.missing
        turns = joint in pulled or joint not in plan.unturned
        back, soft = (turns and (joint, p) not in plan.missing for p in (Purpose.REVERSAL, Purpose.SIZE))
        out.append(JointTilting(joint, *(0.0 if shown else np.nan for shown in (tips, back, soft))))
    return tuple(out)


def pulled_joint(robot: Robot, known: Tilting, loads: SideLoads, data: Dataset) -> Tilting:
    """What poses under sideways pulls show of one joint about its axis, when all else is known.

    Args:
        robot: Nominal arm.
        known: The other joints, and how far this one tips.
        loads: The pulls.
        data: Measured poses, with the wrench of every row.
    """
    others = robot.with_effects(*known.effects)
    return fit_tilting(others, data, asked=giving_way(turning=(loads.joint,)), noise=Noise())


def _pulled(actual: Robot, loads: SideLoads, tracker: Instrument, rng: np.random.Generator) -> Dataset:
    """Poses of the tool under the pulls, by a tracker that stands where it sees them all."""
    data = simulate(actual, loads.q, instrument=tracker, rng=rng, motion=Motion(loads.q, wrench=loads.wrench))
    position, turn = tracker.deviations
    return replace(data, sigma=np.tile([position] * 3 + [turn or position] * 3, (len(loads.q), 1)))


def draw_joints(asked: Sequence[JointTilting], rng: np.random.Generator) -> tuple[JointTilting, ...]:
    """Joints of a virtual arm, of the usual sizes, as far as they are asked for."""
    out = []
    for joint in asked:
        clearance, backlash, stiffness = (rng.uniform(*s) for s in (CLEARANCE, BACKLASH, STIFFNESS))
        compliance = np.deg2rad(1.0) / (9.81 * stiffness)
        sizes = [float(v) for v in (np.deg2rad(clearance), np.deg2rad(backlash), compliance)]
        out.append(JointTilting(joint.joint, *sizes).only(joint))
    return tuple(out)
