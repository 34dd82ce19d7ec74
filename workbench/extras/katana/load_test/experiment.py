"""The load test, planned and simulated: clearance, backlash and stiffness of each joint from inclinometers.

The readings of all postures are fitted together, the directions of the axes with them, so that no posture has
to be exact. Joints about which no gravity acts, as they stand upright, are pulled sideways at the tool
instead, and the tool's pose is measured; the other joints are then known from the inclinometers.

Source: Katana figs. 4.6, 4.9, 5.4; §4.4.1 for joint 1.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import final

import numpy as np
from jaxtyping import Bool, Int

from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base.arguments import checked_arguments
from workbench.base.errors import DataError
from workbench.base.threads import one_thread
from workbench.base.types import frozen
from workbench.data.arguments import RobotLike
from workbench.data.dataset import Dataset
from workbench.data.simulation.instruments import INSTRUMENTS, Instrument
from workbench.data.simulation.simulate import simulate, virtual_arm
from workbench.extras.katana.load_test.joint_tilting_fit import (
    KINDS,
    JointTilting,
    Tilting,
    fit_tilting,
    tilting_effects,
)
from workbench.extras.katana.load_test.postures import (
    LoadTestPlan,
    PairPurpose,
    SideLoads,
    plan_load_test,
    pullable,
    side_loads,
)
from workbench.extras.katana.load_test.tolerance import (
    ANGLE,
    CENTRE,
    LENGTH,
    constants_known,
    has_certain_load_sides,
)
from workbench.identification.fit import Fit
from workbench.identification.problem import Noise

REPEATS = 10
"""Readings of every posture, whose mean is taken."""
CLEARANCE, BACKLASH, STIFFNESS = (0.015, 0.025), (0.045, 0.065), (70.0, 125.0)
"""Ranges of a virtual arm's clearances and backlashes [°] and stiffnesses [kg m/°] (Tables 4.3 and 4.4)."""
MIN_MASS = 0.1
"""Minimum share of its stated mass that a link of a virtual arm has."""
SPARE = 4.0
"""Variance of the residual, in that of the stated noise, above which a fit is refused."""


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class LoadTest:
    """A load test and what it showed.

    Args:
        robot: The nominal arm.
        plan: Postures and masses.
        data: Readings of the inclinometers.
        tilting: What they showed.
        side: Sideways pulls for the joints that gravity does not turn.
        side_tilting: What they showed, in the order of `side`.
        hidden: What the virtual arm has; empty if it is not known.
    """

    robot: Robot
    plan: LoadTestPlan
    data: Dataset
    tilting: Tilting
    side: tuple[SideLoads, ...]
    side_tilting: tuple[Tilting, ...]
    hidden: tuple[JointTilting, ...]

    @property
    def joints(self) -> tuple[JointTilting, ...]:
        pulled = {j.joint: j for tilting in self.side_tilting for j in tilting.joints}
        return tuple(j.joined(pulled[j.joint]) if j.joint in pulled else j for j in self.tilting.joints)


@checked_arguments()
@one_thread()
def run_load_test(robot: RobotLike, *, added_mass: float = 0.0, each: int = 4, seed: int = 0) -> LoadTest:
    """Plan the load test of a robot, and simulate it on a virtual arm with hidden sizes.

    Args:
        robot: Nominal arm with masses and limits; effects that it carries are left out. Joints that gravity
            does not turn are pulled.
        added_mass: Mass that can be hung onto the tool [kg].
        each: Pairs of postures for every joint and purpose.
        seed: Of postures, hidden arm and noise.
    """
    rng = np.random.default_rng(seed)
    known = tuple(replace(j, com_tolerance=CENTRE) for j in robot.joints)
    robot = replace(robot.with_effects(), joints=known)
    plan = plan_load_test(robot, added_mass=added_mass, each=each, rng=rng)
    pulled_at = [j for j in plan.unturned if pullable(robot, j, rng=rng)]
    side = tuple(side_loads(robot, j, rng=rng) for j in pulled_at)
    hidden = draw_joints(observable_sizes(plan, pulled_at), rng)
    actual = virtual_arm(robot, rng=rng, errors=(LENGTH, ANGLE)).with_effects(*tilting_effects(hidden))
    actual = with_other_masses(actual, np.random.default_rng((seed, 1)))
    inclinometer, tracker = INSTRUMENTS["inclinometer"], INSTRUMENTS["optotrak"]
    meter, tracker = (replace(instrument, samples=REPEATS) for instrument in (inclinometer, tracker))
    data = read_plan(actual, plan, instrument=meter, rng=rng)
    tilting = tilting_of(robot, plan, data, instrument=meter)
    pulled = tuple(
        pulled_joint(robot, tilting, loads, _pulled(actual, loads, tracker, rng)) for loads in side
    )
    if pulled:
        turning = [e for found in pulled for e in found.effects]
        tilting = tilting_of(robot.with_effects(*turning), plan, data, instrument=meter)
    return LoadTest(
        robot=robot, plan=plan, data=data, tilting=tilting, side=side, side_tilting=pulled, hidden=hidden
    )


def read_plan(
    actual: Robot, plan: LoadTestPlan, *, instrument: Instrument, rng: np.random.Generator
) -> Dataset:
    """Readings of the inclinometers on an arm in the postures of a plan."""
    return simulate(actual, Motion(plan.q, payload=plan.added), instrument=instrument, rng=rng)


def tilting_of(robot: Robot, plan: LoadTestPlan, data: Dataset, *, instrument: Instrument) -> Tilting:
    """What readings of a plan show of its joints, the directions of all axes fitted beside.

    Of joints that gravity does not turn, but tips, they show the clearance. No axis stands quite upright, so
    that its play lets the arm turn downhill, the way that its clearance tips it: 0.05° about an axis that is
    0.1° off tips by 0.0001°. A `robot` with the play that pulls showed leaves it out of the clearance.
    Lengths stay nominal; errors up to `LENGTH` enter the standard errors. The links' masses and centres are
    fitted too, known as well as the robot file states.
    Postures in which the side of a moment is in doubt are left out.
    """
    _, turn = instrument.deviations
    angles = [n for n in robot.default_free if robot.chain.elements[robot.chain.index[n]].axis.turns]
    noise, known = Noise(rotation=turn or Noise().rotation), constants_known(robot)
    requested = observable_sizes(plan)
    rows = np.flatnonzero(_certain(robot, data, requested, known))
    tilting = fit_tilting(
        robot, data.take(rows), requested=requested, noise=noise, free=angles, known=known, inertia=True
    )
    _check(tilting.fit, rows)
    return tilting


def _certain(
    robot: Robot, data: Dataset, requested: Sequence[JointTilting], known: Mapping[str, float]
) -> Bool[np.ndarray, " rows"]:
    """Postures in which the side of the play is certain for every tested joint."""
    about, across = has_certain_load_sides(robot, Motion.of(data), known)
    turns, tips = (
        [j.joint for j in requested if np.isfinite(getattr(j, word))] for word in ("backlash", "clearance")
    )
    certain = np.all(np.hstack([about[:, turns], across[:, tips]]), axis=1)
    if not certain.any():
        raise DataError(
            "in every posture the load of some joint is too close to reversing to tell on which side of its "
            "play it rests; plan postures that load the joints more, or add mass at the tool"
        )
    return certain


def _check(fit: Fit, rows: Int[np.ndarray, " rows"]) -> None:
    """Refuse a fit that does not see all that is wanted, or that leaves far more than noise."""
    hidden = (*fit.unidentifiable, *fit.weakly_observable)
    if unseen := {n for found in hidden for n in found.names if n.split(".")[-1] in KINDS}:
        raise DataError(
            f"the {len(rows)} postures whose loads are not close to reversing do not show "
            f"{', '.join(sorted(unseen))}; plan more pairs, or add mass at the tool"
        )
    if fit.variance_factor > SPARE:
        worst = int(np.argmax(fit.row_residuals))
        raise DataError(
            f"the residuals are {np.sqrt(fit.variance_factor):.3g} times the inclinometers' noise "
            f"(limit {np.sqrt(SPARE):g}), the largest in row {rows[worst] + 1} "
            f"({fit.row_residuals[worst]:.3g} times); check its readings and the mass at the tool, "
            "or leave it out",
            row=int(rows[worst]),
        )


def observable_sizes(plan: LoadTestPlan, pulled: Sequence[int] = ()) -> tuple[JointTilting, ...]:
    """Sizes that a plan shows of each joint as 0, the others as NaN; pulled joints show how they turn too."""
    out = []
    for joint in sorted((*plan.joints, *plan.unturned)):
        tips = (joint, PairPurpose.CROSSWISE) not in plan.missing
        turns = joint in pulled or joint not in plan.unturned
        back, soft = (
            turns and (joint, p) not in plan.missing for p in (PairPurpose.REVERSAL, PairPurpose.SIZE)
        )
        out.append(JointTilting(joint, *(0.0 if shown else np.nan for shown in (tips, back, soft))))
    return tuple(out)


def pulled_joint(robot: Robot, known: Tilting, loads: SideLoads, data: Dataset) -> Tilting:
    """What poses under sideways pulls, a wrench in every row, show of one joint about its axis.

    All else is known: the other joints, and how far this one tips.
    """
    wanted = (JointTilting(loads.joint, backlash=0.0, compliance=0.0),)
    return fit_tilting(robot.with_effects(*known.effects), data, requested=wanted, noise=Noise())


def _pulled(actual: Robot, loads: SideLoads, tracker: Instrument, rng: np.random.Generator) -> Dataset:
    """Poses of the tool under the pulls, measured by a tracker that sees them all."""
    data = simulate(actual, Motion(loads.q, wrench=loads.wrench), instrument=tracker, rng=rng)
    position, turn = tracker.deviations
    return replace(data, sigma=np.tile([position] * 3 + [turn or position] * 3, (len(loads.q), 1)))


def with_other_masses(robot: Robot, rng: np.random.Generator) -> Robot:
    """The arm with links whose masses, a tenth at least, and centres are off as their tolerances state."""
    heavy = [j for j in robot.joints if j.mass]
    sizes = [j.mass * max(1.0 + j.mass_tolerance * rng.normal(), MIN_MASS) for j in heavy if j.mass]
    others = {
        j.name: replace(j, mass=mass, com=frozen(j.com + j.com_tolerance * rng.normal(size=3)))
        for j, mass in zip(heavy, sizes, strict=True)
    }
    return replace(robot, joints=tuple(others.get(j.name, j) for j in robot.joints))


def draw_joints(requested: Sequence[JointTilting], rng: np.random.Generator) -> tuple[JointTilting, ...]:
    """Joints of a virtual arm, of the usual sizes, as far as they are wanted."""
    out = []
    for joint in requested:
        clearance, backlash, stiffness = (rng.uniform(*s) for s in (CLEARANCE, BACKLASH, STIFFNESS))
        sizes = np.deg2rad(clearance), np.deg2rad(backlash), np.deg2rad(1.0) / (9.81 * stiffness)
        wanted = (getattr(joint, word) for word in KINDS)
        drawn = (float(v) if np.isfinite(w) else np.nan for v, w in zip(sizes, wanted, strict=True))
        out.append(JointTilting(joint.joint, *drawn))
    return tuple(out)
