"""Files that don't tell all: masses, gravity, noise or columns that are missing or wrong; what is true then.

A step is true if its row is within `NEAR`, a gravity that stands otherwise if the saved one is twice as near
to the truth as the file's; all else as `judge.py` has it.
"""

import tempfile
import time
from collections.abc import Callable
from dataclasses import replace

import lift
import numpy as np
from arms import UnseenError
from cases import CASES, Case, Named
from claims import Claim
from conditions import CONDITIONS, under
from generator import four, rotation
from judge import Judged, false_names, judge, judged_claims
from morphologies import MORPHOLOGIES

from workbench import Dataset, Diagnosis, Robot, diagnose
from workbench.base.errors import DataError

NEAR = 2
"""Fitted rows by which the row of an event may be off."""
ROWS = (60, 80, 100, 120)
OFF_LEVEL, TILTED = 10e-3, float(np.deg2rad(3.0))
"""By how much gravity may be off [rad]."""
SET_UP = 0.05
"""How far another set-up of the instrument is off [m], and turned [rad], per axis at most."""
ROUNDED = float(np.deg2rad(0.01)), 1e-4
"""Last digit of joint readings [rad] and of measured positions [m]."""
KINDS = tuple(k for k in CASES if not k.startswith("misseated"))
RIGHT_WITHIN = 3.0
"""Standard errors within which a size is right."""

Change = Callable[[Case, np.random.Generator], Case]


def _without_masses(count: int | None) -> Change:
    def change(case, rng):
        links = rng.permutation(case.robot.dof)[:count]
        joints = tuple(replace(j, mass=None) if k in links else j for k, j in enumerate(case.robot.joints))
        soft = {n.joints for n in (*case.truth, *case.allowed) if n.name == "joint-compliance"}
        sags = tuple(Named("gravity-sag", j) for j in soft if count is None)
        return replace(case, robot=replace(case.robot, joints=joints), allowed=(*case.allowed, *sags))

    return change


def _standing(angle: float) -> Change:
    def change(case, rng):
        heading = rng.uniform(0.0, 2.0 * np.pi)
        turned = rotation(angle * np.array([np.cos(heading), np.sin(heading), 0.0])) @ case.robot.gravity
        return replace(case, robot=case.robot.under(turned))

    return change


def _without(*columns: str) -> Change:
    return lambda case, rng: replace(case, data=replace(case.data, **dict.fromkeys(columns)))


def _shuffled(case, rng):
    data = case.data.take(rng.permutation(len(case.data)))
    return replace(case, data=replace(data, time=None, direction=None, row=np.arange(len(data))))


def _set_up_again(case, rng):
    """Two set-ups of the instrument in one file, without a column of sessions."""
    data, row = case.data, int(len(case.data) * rng.uniform(0.3, 0.7))
    moved = four(rotation(SET_UP * rng.uniform(-1, 1, 3)), SET_UP * rng.uniform(-1, 1, 3))
    position = data.position.copy()
    position[row:] = position[row:] @ moved[:3, :3].T + moved[:3, 3]
    turned = data.rotation
    if turned is not None:
        turned = turned.copy()
        turned[row:] = moved[:3, :3] @ turned[row:]
    step = Named("frame-step", (), row)
    return replace(case, data=replace(data, position=position, rotation=turned), truth=(*case.truth, step))


def _rounded(case, rng):
    angle, length = ROUNDED
    data = case.data
    q = np.where(case.actual.sliding, data.q, angle * np.round(data.q / angle))
    return replace(case, data=replace(data, q=q, position=length * np.round(data.position / length)))


CHANGES: dict[str, Change] = {
    "one-mass": _without_masses(1),
    "no-masses": _without_masses(None),
    "gravity": _standing(OFF_LEVEL),
    "tilted": _standing(TILTED),
    "rounded": _rounded,
    "no-time": _without("time"),
    "no-temperature": _without("temperature"),
    "no-payload": _without("payload"),
    "shuffled": _shuffled,
    "no-session": _set_up_again,
}
"""What a gap makes of a case."""
MET = {
    "masses30": "masses30",
    "tails": "t3",
    "understated": "stated3",
    "uneven": "sigma10",
    "readings": "joints",
}
"""Gaps that are conditions."""
GAPS = (
    "one-mass", "no-masses", "masses30", "gravity", "tilted", "tails", "understated", "uneven", "readings",
    "rounded", "no-time", "no-temperature", "no-payload", "shuffled", "no-session", "lift",
)  # fmt: skip
"""In the order of seeds; the last has arms of its own (`tests/diagnosis/lift.py`)."""


def draw(gap: str, seed: int) -> Case:
    """An arm whose file has a gap."""
    rng = np.random.default_rng([seed, 33])
    kind, arms = str(rng.choice(KINDS)), list(rng.permutation(list(MORPHOLOGIES)))
    about = {"poses": int(rng.choice(ROWS)), "point": bool(rng.integers(2)), "free": bool(rng.integers(2))}
    given = replace(CONDITIONS[MET.get(gap, "ideal")], **about)
    for arm in arms:
        try:
            case = under(given, kind, seed, str(arm))
            return CHANGES[gap](case, rng) if gap in CHANGES else case
        except UnseenError:
            continue
    raise UnseenError(f"no morphology can show {kind}")


def judge_gap(gap: str, seed: int) -> Judged:
    """Diagnose one arm whose file has a gap."""
    if gap == "lift":
        return _judge_lift(seed)
    case = draw(gap, seed)
    return judge(case, diagnose, is_true=lambda *about: _is_true(case, *about))


def _is_true(case: Case, result: Diagnosis, claim: Claim, cause) -> bool:
    if cause.kind == "gravity-direction":
        off = [
            np.arccos(np.clip(g @ case.actual.gravity / 9.81**2, -1.0, 1.0))
            for g in (result.calibrated.gravity, case.robot.gravity)
        ]
        return bool(2.0 * off[0] < off[1])
    if cause.kind == "frame-step":
        fitted = np.sort(result.after_fit.problem.data.row)  # held-out rows lie between those that are named
        true = [t.detail for t in case.truth if t.name == cause.kind]
        return any(abs(np.diff(np.searchsorted(fitted, [row, cause.row]))[0]) <= NEAR for row in true)
    return not false_names(case, claim)


def drawn_lift(seed: int) -> tuple[Robot, Dataset, lift.Truth]:
    """An arm on a lift that lacks a mass, or all, with or without inclinometers, and what is true."""
    rng = np.random.default_rng([seed, 33])
    actual = lift.draw(rng, scale=float(rng.choice([0.0, 5.7e-4])), off_level=float(rng.uniform(0, 0.012)))
    columns = lift.measure(actual, rng, rows=int(rng.choice(ROWS)))
    tilted, masses, lost = bool(rng.integers(2)), bool(rng.random() < 0.8), int(rng.integers(8))
    if not tilted:
        columns = {name: v for name, v in columns.items() if not name.startswith("tilt")}
    with tempfile.TemporaryDirectory() as folder:
        return *lift.files(folder, columns, lost, masses), actual


def _judge_lift(seed: int) -> Judged:
    robot, data, actual = drawn_lift(seed)
    true = {("extension-compliance", 0), ("extension-clearance", 0), ("gravity-direction", None)}
    true |= {("joint-compliance", j) for j in range(1, 7)} | {("gravity-sag", j) for j in range(1, 7)}
    # the carriage tips behind the slide: the root of its link, and the bearing of the joint that it carries
    true |= {("link-flexure", 0), ("bearing-compliance", 1)}
    true |= {("encoder-scale", 3)} if actual.scale else set()

    def is_true(result, claim, cause):
        guide = {("bearing-compliance", 0)} if _tips_by(result, actual.tipping[0]) else set()
        return cause.confidence == "cannot tell" or (true | guide).issuperset(
            (cause.kind, j) for j in cause.joints or (None,)
        )

    facts, began = {"kind": "lift", "arm": "lift", "seed": seed, "truth": ()}, time.process_time()
    try:
        found = diagnose(robot, data)
    except DataError as error:
        return Judged(**facts, failed=True, verdict=str(error))
    seconds = time.process_time() - began
    return Judged(**facts, claims=judged_claims(found, is_true), verdict=str(found.verdict), seconds=seconds)


def _tips_by(result: Diagnosis, actual: float) -> bool:
    """Whether the slide's guide is found to tip by what the carriage does where it is retracted."""
    return any(
        abs(c - actual) < RIGHT_WITHIN * std
        for a in result.effects
        if a.effect.name == "bearing-compliance"
        for j, c, std in zip(a.effect.joints, a.effect.coefficients, a.std, strict=True)
        if j == 0
    )
