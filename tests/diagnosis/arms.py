"""Virtual arms with effects that nobody declared: what the program is given, and what it does not see.

Kinematics, statics and laws are those of `laws.py` and `tests/generator.py`, plain numpy that shares nothing
with the package; the package only reads the files that they make. An arm has errors of manufacture, random
postures over its joint ranges in a useful workspace, columns of time, temperature, direction of motion and
(in half of the arms) payload, whatever effect it hides; whether they matter is for the program to find.

    case = make("compliance", arm="aria", seed=TUNING[0])
    diagnose(case.robot, case.data)         # and compare with case.truth, case.misseated, case.exact

`decide.py` says which draws are kept: those that measurements of the usual kind can tell apart at all.
"""

import tempfile
import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np
from cases import ANY, CASES, POOL, Case, permitted, required
from decide import Sight, decidable, shows
from draws import HOUR, draw, steady
from generator import four, rotation, shift
from laws import State, wound
from laws import poses as deflected_poses
from morphologies import ARMS, MORPHOLOGIES

from workbench.arm.robot_toml import read_toml
from workbench.data.dataset import Dataset

TUNING, JUDGING = range(10_000), range(1_000_000, 2_000_000)
"""Seeds to work with, and seeds to be judged by: results on the latter change nothing in the program."""
ROWS, EXACT = 120, 200
SIGMA = 5e-5, float(np.deg2rad(0.01))
"""Noise per axis [m, rad]."""
LENGTH, ANGLE = 1e-3, float(np.deg2rad(0.3))
"""Greatest errors of manufacture [m, rad]."""
PLACED, TURNED = 20e-3, float(np.deg2rad(1.5))
"""Greatest errors of the nominal base and tool where they are free [m, rad]."""
MISSEATED, BADLY = 2e-3, (3, 6)
"""How far a row is off [m], and how many rows are."""
ABOVE, ASIDE = 0.02, 0.12
"""Least height of the tool above the mount, and least distance from its axis [m]."""
TRIES = 60
__all__ = ["ARMS", "MORPHOLOGIES", "make", "states", "useful"]


def seeds_of(text: str, number: int) -> range:
    """Seeds by the name of their half, so many, or from the first one to the end: '5:8'."""
    if ":" in text:
        return range(*(int(s) for s in text.split(":")))
    return (JUDGING if text == "judging" else TUNING)[:number]


class UnseenError(ValueError):
    """No draw of a kind can be told apart on an arm."""


def make(
    kind: str,
    seed: int,
    arm: str = "aria",
    *,
    poses: int = ROWS,
    noise: float = 1.0,
    observation: str = "pose",
    free_frames: bool = False,
) -> Case:
    """Draw a case; the same arm and effect for any number of poses, noise and observation."""
    if seed not in TUNING and seed not in JUDGING:
        raise ValueError(f"seed {seed} is neither for tuning nor for judging")
    source = np.random.SeedSequence([seed, zlib.crc32(f"{kind} {arm}".encode())])
    of_arm, of_rows, of_exact, of_effect, of_noise = (np.random.default_rng(s) for s in source.spawn(5))
    nominal = MORPHOLOGIES[arm]()
    actual = nominal.perturbed(of_arm, LENGTH, ANGLE)
    if free_frames:
        actual = replace(actual, base=off(actual.base, of_arm), tool=off(actual.tool, of_arm))
    chosen = CASES[kind]
    load = chosen.payload or ((0.0, 2.0) if of_arm.random() < 0.5 else None)
    drawn = states(actual, max(ROWS, poses), of_rows, load)
    sight = Sight(actual, drawn.take(slice(0, ROWS)), free_frames, SIGMA)
    hidden, tries = _hide(chosen, sight, of_effect)
    if chosen.leaning:
        lean = np.deg2rad(chosen.leaning) * _across(actual.gravity, of_arm)
        actual = replace(actual, gravity=rotation(lean) @ actual.gravity)
    state, exact = drawn.take(slice(0, poses)), states(actual, 2 * EXACT, of_exact, load)
    exact = exact.take(np.flatnonzero(steady(actual, hidden, exact))[:EXACT])
    sigma = (noise * SIGMA[0], noise * SIGMA[1])
    data, misseated = _measured(actual, hidden, state, sigma, of_noise, chosen.misseated)
    known = {"payload"} if load else set()
    small = [e for e in hidden if not shows(sight, e, hidden)] if chosen.everywhere else []
    return Case(
        kind=kind,
        arm=arm,
        seed=seed,
        robot=robot_of(nominal, arm, free_frames),
        data=_table(data, state, known, observation),
        exact=_table(deflected_poses(actual, hidden, exact), exact, known, "pose"),
        truth=tuple(required(e) for e in hidden if e not in small and not chosen.nameless),
        allowed=tuple(permitted(chosen, hidden, nominal.dof)),
        misseated=misseated,
        hidden=hidden,
        actual=actual,
        state=state,
        sigma=sigma,
        draws=tries,
    )


def off(frame, rng):
    """A frame as it stands, away from where it is said to be."""
    return frame @ four(rotation(TURNED * rng.uniform(-1, 1, 3))) @ shift(PLACED * rng.uniform(-1, 1, 3))


def _across(vector, rng):
    """A unit vector across another, at random."""
    found = np.cross(vector, rng.standard_normal(3))
    return found / np.linalg.norm(found)


def states(arm, rows, rng, payload):
    """Random postures one after the other, with what changes meanwhile: an hour, a warming hall, loads."""
    q = np.zeros((0, arm.dof))
    while len(q) < rows + 1:
        q = np.vstack([q, useful(arm, arm.random(rng, 4 * rows))])
    q = q[: rows + 1]
    time = np.sort(rng.uniform(0.0, HOUR, rows))
    period, phase = rng.uniform(0.3, 0.6) * HOUR, rng.uniform(0.0, 2 * np.pi)
    warmth = 26.0 + 8.0 * np.sin(2 * np.pi * time / period + phase) + 1.0 * rng.standard_normal(rows)
    low, high = payload or (0.0, 0.0)
    return State(
        q=q[1:],
        direction=np.sign(np.diff(q, axis=0)),
        wound=wound(q),
        time=time,
        temperature=warmth,
        payload=low + (high - low) * rng.integers(0, 5, rows) / 4.0,
    )


def useful(arm, q):
    """Postures whose tool is above the mount and beside the column."""
    tool = (np.linalg.inv(arm.base) @ arm.pose(q))[:, :3, 3]
    return q[(tool[:, 2] > ABOVE) & (np.hypot(tool[:, 0], tool[:, 1]) > ASIDE)]


def _hide(kind, sight, rng):
    """Effects that can be told apart, and how many draws that took."""
    for tries in range(1, TRIES + 1):
        effects = _drawn(kind, sight.arm, sight.state, rng)
        if effects is not None and (kind.everywhere or decidable(sight, effects)):
            return effects, tries
    raise UnseenError(f"none of {TRIES} draws of {kind} can be told apart")


def _drawn(kind, arm, state, rng):
    if kind.everywhere:
        found = [draw(name, arm, state, rng, joint=j) for name, _ in kind.effects for j in range(arm.dof)]
        return tuple(e for e in found if e is not None)
    chosen = [POOL[rng.integers(len(POOL))] if item == ANY else item for item in kind.effects]
    joints = rng.permutation(arm.dof)[: len(chosen)] if kind.of_many else [None] * len(chosen)
    if len(joints) < len(chosen):
        return None
    found = [
        draw(name, arm, state, rng, detail=detail, joint=None if joint is None else int(joint))
        for (name, detail), joint in zip(chosen, joints, strict=True)
    ]
    if None in found or len({(e.name, e.joints, e.detail) for e in found}) < len(found):
        return None
    is_varied = min(len({e.name for e in found}), len({e.joints[:1] or e.name for e in found})) == len(found)
    return tuple(found) if is_varied or not kind.is_varied else None


def _measured(arm, hidden, state, sigma, rng, misseated):
    """Poses with noise, and the rows that are off."""
    seen = deflected_poses(arm, hidden, state)
    rows = len(seen)
    seen[:, :3, 3] += sigma[0] * rng.standard_normal((rows, 3))
    seen[:, :3, :3] = rotation(sigma[1] * rng.standard_normal((rows, 3))) @ seen[:, :3, :3]
    if not misseated:
        return seen, ()
    off = np.sort(rng.choice(rows, rng.integers(BADLY[0], BADLY[1] + 1), replace=False))
    away = rng.standard_normal((len(off), 3))
    seen[off, :3, 3] += MISSEATED * away / np.linalg.norm(away, axis=1, keepdims=True)
    return seen, tuple(off.tolist())


def _table(seen, state, known, observation):
    """The rows as a file would hold them."""
    return Dataset(
        q=state.q,
        position=seen[:, :3, 3],
        rotation=seen[:, :3, :3] if observation == "pose" else None,
        time=state.time,
        temperature=state.temperature,
        direction=state.direction,
        payload=state.payload if "payload" in known else None,
    )


def robot_of(arm, name, free):
    """The arm as the package reads it; whether base and tool are free."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"{name}.toml"
        path.write_text(arm.toml(name, free=str(free).lower()))
        return read_toml(path)
