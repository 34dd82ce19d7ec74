"""A payload that isn't what the file says, through the laws of load that were found.

All of them see one payload. Where δ kg more hang at the tool than the file says, they move elements by
s'(m) δ more, s' their derivative, so that few columns tell:

| what the payload is | δ |
|---|---|
| a factor of the file's | (f − 1) m |
| that of the row before, or after | its m − m |
| more by one mass | 1 |
| another one for each that the file says | one for each |
| another one in any row | one for each, of one variance |

If it hangs elsewhere than at the tool's point, its moments are others too, by three unknown coordinates.
"""

from dataclasses import replace
from functools import partial

import numpy as np

from workbench.arm.effects.effect import Loads
from workbench.arm.frame import revised
from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.robot import Robot
from workbench.arm.statics.deflection import shift_of
from workbench.base.errors import DataError
from workbench.data.dataset import Dataset
from workbench.diagnosis.confidence import PROBABLE
from workbench.diagnosis.drivers.driver import AS_UNDER, LOAD, OPPOSED, DrivenRows, Driver, Follower, Shape
from workbench.diagnosis.drivers.evidence import (
    MIN_GAIN,
    DriverEvidence,
    FollowedDriver,
    compressed,
    what_add,
)
from workbench.diagnosis.search.evidence import Model, Offer, coefficients, left_of
from workbench.diagnosis.search.gram_matrices import Grams

STEP = 0.1
"""Payload, and distance of its centre, by which the derivatives are taken [kg], [m]."""
MAX_LEVELS, MAX_NAMED = 12, 3
"""Maximum number of payloads in a file that may each be another one, and of those that are named."""
MAX_FACTOR = 1.4
"""Factor up to which masses of links, of which only the ratio to the payload shows, may be wrong instead."""
MISSTATED = "a payload that isn't what the file says"
MAX_CARRIED = 10.0
"""Payload that no arm carries, in masses of its own."""


def refuse_heavy(arm: Robot, data: Dataset) -> None:
    """Raise where a payload is that of another unit."""
    own, most = sum(j.mass or 0.0 for j in arm.joints), np.max(0.0 if data.payload is None else data.payload)
    if 0.0 < MAX_CARRIED * own < most:
        text = f"a payload of {most:.5g} kg on an arm of {own:.3g} kg: g? Write its unit, as in payload[g]"
        raise DataError(f"{data.source}: {text}", column="payload")


def _hypotheses(rows: DrivenRows, carried: np.ndarray, whole: Dataset) -> dict[str, Follower]:
    """Payloads by what they are, as processes; none without a law of load."""
    arm = rows.arm
    laws = tuple(e for e in arm.effects if e.loads is not Loads.NONE and not e.is_nameless)
    if whole.payload is None or not laws or not arm.has_masses:
        return {}
    alone = revised(arm, effects=laws)
    moved = tuple(dict.fromkeys(name for e in laws for name in e.elements(alone.chain)))
    slope = np.zeros((len(carried), len(moved), 4))
    for block in rows.problem.blocks:
        here, motion = alone.in_session(block.session), rows.motion.take(block.rows)
        heavy = carried[block.rows]
        known = np.zeros((len(motion), 6)) if motion.wrench is None else motion.wrench
        axes = (here.base.rotation.T @ tool_poses(here, motion)[:, :3, :3]).transpose(2, 0, 1)
        turned = [np.pad(np.cross(STEP * a, heavy[:, None] * here.gravity), ((0, 0), (3, 0))) for a in axes]
        tried = [motion, replace(motion, payload=heavy + STEP)]
        tried += [replace(motion, wrench=known + each) for each in turned]
        now, *then = (shift_of(here, each)[:, alone.chain.indices(moved)] for each in tried)
        slope[block.rows] = (np.stack(then, 2) - now[..., None]) / STEP
    file = np.argsort(whole.row, kind="stable")
    place = np.searchsorted(whole.row[file], rows.data.row)
    before, after = (whole.payload[file[np.clip(place + k, 0, len(file) - 1)]] for k in (-1, 1))
    levels, level = np.unique(carried, return_inverse=True)
    shapes = {"factor": carried, "early": before - carried, "late": after - carried}
    shapes |= {"more": np.ones(len(carried)), "any": np.eye(len(carried))}
    shapes |= {"each": np.eye(len(levels))[level]} if len(levels) <= MAX_LEVELS else {}
    joints = tuple(sorted({j for e in laws for j in e.joints}))
    process = partial(rows.follower, Driver.LOAD, MISSTATED, joints=joints, moved=moved)
    mass, away = np.split(slope[rows.order], [1], axis=2)
    carried_by = partial(process, together=mass, shape=Shape.CARRIED)
    found = {what: carried_by(s.reshape(len(s), -1), tag=what) for what, s in shapes.items()}
    hung = process(np.ones((len(carried), 1)), together=away, tag="elsewhere", shape=Shape.HANGS)
    return found | {"elsewhere": hung}


def misstated_payload(drivers: DriverEvidence, whole: Dataset) -> tuple[FollowedDriver, ...]:
    """What the payload is, if this explains more than any process beside the laws of load; `whole` are all
    rows of the file."""
    searched, rows = drivers.searched, DrivenRows(drivers.problem, drivers.searched.stage.fit.x, None)
    carried = rows.motion.payload
    if carried is None or not np.ptp(carried) or not (found := _hypotheses(rows, carried, whole)):
        return ()
    model, offered, rivals = searched.model, list[tuple[float, str, Offer, Grams]](), [0.0]
    for noise in filter(None, (drivers, drivers.exact)):
        grams = compressed(searched, noise.problem, (), (*found.values(),), masses=True)
        charge = noise.surprise(model) - drivers.surprise(model)
        offers = what_add(left_of(grams, model), (*found.values(),))
        shown = {what: offers[f] for what, f in found.items() if f in offers}
        offered += [(o.gain - charge, what, o, grams) for what, o in shown.items()]
        rivals += [o.gain - charge for f, o in noise.beside.items() if AS_UNDER not in f.phrase]
    gain, what, offer, grams = max(offered, key=lambda each: each[0])
    lead = gain - max(rivals)
    if gain < MIN_GAIN or lead < np.log(PROBABLE):
        return ()
    sizes = coefficients(grams, (*model, offer.term))
    now, then = np.array([(sizes[n], c) for n, c in rows.arm.coefficients.items() if n in sizes]).T
    more = np.array([sizes[n] for n in found[what].candidate.names]) * (then @ then) / (now @ then)
    if what == "factor" and abs(np.log(max(1.0 + float(more[0]), 1e-3))) < np.log(MAX_FACTOR):
        return ()
    part = replace(found[what], phrase=f"{MISSTATED}: {_text(what, more, np.unique(carried))}")
    return (FollowedDriver(Driver.LOAD, (part,), lead, None),)


def with_sign(follows: FollowedDriver, drivers: DriverEvidence, sure: Model) -> FollowedDriver:
    """Where torques are measured, a load says if it is opposite to what bends its joints."""
    if drivers.problem.robot.has_masses or follows.driver is not Driver.LOAD:
        return follows
    lines = [f for f in drivers.followers if f.shape is Shape.LINE and f.phrase == LOAD]
    found = what_add(left_of(drivers.grams, sure), [f for f in lines if {*f.joints} <= {*follows.joints}])
    sizes = coefficients(drivers.grams, (*sure, *(o.term for o in found.values())))
    if not found or min(sizes[n] for f in found for n in f.candidate.names) <= 0.0:  # loads bend by −c τ
        return follows
    parts = (replace(p, phrase=OPPOSED) if p.phrase == LOAD else p for p in follows.parts)
    return replace(follows, parts=tuple(parts))


def _text(what: str, more: np.ndarray, levels: np.ndarray) -> str:
    """What the payload is, by how much it is more [kg], or its factor less 1, and what the file says [kg]."""
    said = [(old + new, old) for old, new in zip(levels, more, strict=False)]
    most = sorted(said, key=lambda pair: -abs(pair[0] - pair[1]))[:MAX_NAMED]
    return {
        "factor": f"{1.0 + more[0]:.2g} times as much",
        "more": f"{abs(more[0]):.2g} kg {'more' if more[0] > 0.0 else 'less'}",
        "each": ", ".join(f"{new:.2g} kg where it says {old:.2g}" for new, old in most),
        "any": "another one in many rows",
        "elsewhere": f"its centre is about {1e3 * np.linalg.norm(more):.0f} mm from the tool's point",
    }.get(what, f"its column is one row {what}")
