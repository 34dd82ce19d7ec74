"""What is tried on an arm: every effect of the catalogue, on every joint where the data could show it.

Harmonics are tried one order at a time and in bands; errors without a name as splines of several widths.
What can't be tried is said, with the reason.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from workbench.arm.effects import AbstractEffect, Loads
from workbench.arm.effects.backlash import Backlash
from workbench.arm.effects.base_drift import BaseDrift
from workbench.arm.effects.bearing_compliance import BearingCompliance
from workbench.arm.effects.clearance_tilt import ClearanceTilt
from workbench.arm.effects.effect import turns
from workbench.arm.effects.encoder_scale import EncoderScale
from workbench.arm.effects.gravity_sag import GravitySag
from workbench.arm.effects.joint_compliance import JointCompliance
from workbench.arm.effects.joint_coupling import JointCoupling
from workbench.arm.effects.joint_harmonic import JointHarmonic
from workbench.arm.effects.link_flexure import LinkFlexure
from workbench.arm.effects.local_joint_error import LocalJointError
from workbench.arm.effects.thermal_growth import ThermalGrowth
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.diagnosis.candidate import Candidate
from workbench.diagnosis.weights import sags

HIGHEST_ORDER = 64
"""Harmonics beyond this are not looked for."""
LEAST_BAND, HALF_TURN = 16, np.pi
"""Lowest order up to which a band must reach. It asks for twice as many rows as a single order, and for a
joint that went through half a turn [rad]: on less, a spline is the same and refuses beyond."""
DECAYS, LOW = (0.0, 2.0, 4.0), 16.0
"""Powers with which the variance of a band's orders may fall beyond this order."""
ROWS_PER_ORDER, ROWS_PER_KNOT = 6, 4
"""Rows that a harmonic order asks for, and a knot of a spline, whose height is shrunk."""
KNOTS = 40
"""Most knots of a spline."""
WIDTHS = (1.0, 2.0, 4.0)
"""Correlation lengths of splines that are tried, in knot distances."""
WRIST = 3
"""Number of last joints whose motors may be coupled with each other, neighbours or not."""
FEW = 2
"""Products of compliance and weight up to which they stay free."""
STILL = np.deg2rad(1.0)
"""A joint [rad, or m] that moves less than this shows no error of its own."""


@dataclass(frozen=True, eq=False)
class Catalogue:
    """What is tried.

    Args:
        candidates: Effects with zero coefficients.
        notes: What could not be tried, and why, one sentence each.
    """

    candidates: tuple[Candidate, ...]
    notes: tuple[str, ...]


def catalogue(robot: Robot, motion: Motion) -> Catalogue:
    """Everything that some rows could show of an arm.

    Args:
        robot: The arm; effects that it carries already are not offered again.
        motion: State of the rows.
    """
    moving = [j for j in range(robot.dof) if np.ptp(motion.q[:, j]) > STILL]
    notes = [f"joint {j + 1} hardly moved: no error of its own was looked for" for j in range(robot.dof)]
    notes = [n for j, n in enumerate(notes) if j not in moving]
    found: list[Candidate] = []
    for offers in (_of_load, _of_drivers):
        effects, words = offers(robot, motion)
        found += [_candidate(e) for e in effects]
        notes += words
    for joint in moving:
        found += _of_joint(robot, motion, joint)
    own = set(robot.coefficients)
    kept = [c for c in found if not own & set(c.names) and c.effect.mistake(robot.chain) is None]
    return Catalogue(tuple(kept), tuple(notes))


def _candidate(effect: AbstractEffect) -> Candidate:
    """The effect; the many products of a sag, alike in kind, are shrunk together."""
    many = isinstance(effect, GravitySag) and len(effect.names) > FEW
    return Candidate(effect, np.eye(len(effect.names)) if many else None)


def _of_load(robot: Robot, motion: Motion) -> tuple[list[AbstractEffect], list[str]]:
    """Effects that follow the moments."""
    kinds: tuple[type[AbstractEffect], ...] = (
        JointCompliance, Backlash, ClearanceTilt, BearingCompliance, LinkFlexure,
    )  # fmt: skip
    effects = [kind((j,)) for kind in kinds for j in range(robot.dof)]
    if motion.payload is not None and not np.isfinite(motion.payload).all():
        return [], ["the payload is missing in some rows, so effects of load were not tried; fill the column"]
    if robot.has_masses:
        return effects, []
    if motion.torque is not None and np.isfinite(motion.torque).all():
        own = [e for e in effects if e.loads is Loads.OWN]
        return own, ["the robot has no masses: only effects of the measured joint torques were tried"]
    return [*sags(robot, motion)], [
        "the robot has no masses: only products of compliance and weight were tried, joint by joint; for "
        "compliances themselves, backlash by load and clearance add mass and com to its joints, or torque "
        "columns without gaps to the data"
    ]


def _of_drivers(robot: Robot, motion: Motion) -> tuple[list[AbstractEffect], list[str]]:
    """Effects of time, temperature and direction, where their columns say something."""
    effects: list[AbstractEffect] = []
    notes = []
    for driver, offer in (
        ("temperature", lambda v: [ThermalGrowth()]),
        ("time", lambda v: [BaseDrift(reference=float(np.min(v)))]),
        ("direction", lambda v: [Backlash((j,), by="motion") for j in range(robot.dof) if np.ptp(v[:, j])]),
    ):
        values = getattr(motion, driver)
        if values is None:
            continue
        if not np.isfinite(values).all():
            notes.append(f"the {driver} is missing in some rows, so its effects were not tried")
        elif np.ptp(values) == 0.0:
            notes.append(f"the {driver} is the same in all rows, so its effects were not tried")
        else:
            effects += offer(values)
    if motion.payload is not None and len(motion) and np.ptp(motion.payload) == 0.0:
        notes.append("the payload is the same in all rows: it can't be told from the arm's own weight")
    return effects, notes + _confounded(motion)


def _confounded(motion: Motion) -> list[str]:
    """Pairs of drivers that run together."""
    drivers = {
        name: values
        for name in ("time", "temperature", "payload")
        if (values := getattr(motion, name)) is not None and np.isfinite(values).all() and np.ptp(values) > 0
    }
    names = list(drivers)
    return [
        f"{a} and {b} run together in these rows ({100 * abs(r):.0f} % correlated): their effects can "
        "hardly be told apart"
        for i, a in enumerate(names)
        for b in names[i + 1 :]
        if abs(r := np.corrcoef(drivers[a], drivers[b])[0, 1]) > CONFOUNDED
    ]


CONFOUNDED = 0.95
"""Correlation of two drivers from which on they are called confounded."""


def _of_joint(robot: Robot, motion: Motion, joint: int) -> Iterator[Candidate]:
    """Errors of one joint."""
    yield Candidate(EncoderScale((joint,)))
    last = robot.dof - WRIST
    for other in range(robot.dof):
        if other != joint and (abs(other - joint) == 1 or min(other, joint) >= last):
            yield Candidate(JointCoupling((joint, other)))
    highest = highest_order(motion.q[:, joint])
    if turns(robot.chain, joint):
        for order in range(1, highest + 1):
            yield Candidate(JointHarmonic((joint,), order=order))
        band = min(highest, len(motion) // (2 * ROWS_PER_ORDER))
        if band >= LEAST_BAND and np.ptp(motion.q[:, joint]) > HALF_TURN:
            yield from _bands(joint, band)
    count = min(KNOTS, len(motion) // ROWS_PER_KNOT, places(motion.q[:, joint]))
    if count >= 5:
        yield from _splines(motion.q[:, joint], joint, count)


def _bands(joint: int, highest: int) -> Iterator[Candidate]:
    """All orders of a joint together, with more or less strength in the high ones."""
    effect = JointHarmonic((joint,), order=tuple(range(1, highest + 1)))
    orders = np.repeat(np.array(effect.orders), 2)
    for decay in DECAYS:
        yield Candidate(effect, np.diag(1.0 / (1.0 + (orders / LOW) ** decay)))


def highest_order(q: np.ndarray) -> int:
    """Highest harmonic that positions of a joint can carry: some rows, and some places, for each."""
    return int(np.clip(places(q) // 2, 2, min(HIGHEST_ORDER, max(len(q) // ROWS_PER_ORDER, 2))))


def places(q: np.ndarray) -> int:
    """How many different positions [to a milliradian or millimetre] of a joint occur."""
    return len(np.unique(np.round(q, 3)))


def _splines(q: np.ndarray, joint: int, count: int) -> Iterator[Candidate]:
    """Errors of any smooth shape over the positions that occur."""
    low, high = float(q.min()), float(q.max())
    knots = np.linspace(low, high, count)
    effect = LocalJointError((joint,), knots=tuple(knots.tolist()), range=(low, high))
    distance = np.subtract.outer(np.arange(count), np.arange(count))
    for width in WIDTHS:
        yield Candidate(effect, np.exp(-0.5 * (distance / width) ** 2) + 1e-6 * np.eye(count))
