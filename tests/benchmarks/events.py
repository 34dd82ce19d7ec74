"""Diagnose virtual arms to which something happened while they were measured, and count what was named.

    python tests/benchmarks/events.py --arms 10                        # tuning seeds
    python tests/benchmarks/events.py --seeds judging --arms 100 --check
    python tests/benchmarks/events.py --cases knock,late --wrong

Arms are those of `tests/diagnosis`, plain numpy that shares nothing with the package, one morphology after
the other; base and tool are free, or known until something happens. An event is named if its kind and joints
are right and its row is at most `NEAR` measured rows off; a warm-up has no row. Any other claim is a false
cause. Arms whose rows can't show what happened, by linear theory beside all constants, base and tool
(`decide.DISTINGUISHABLE` noise units: the last joint of a short lever), are counted apart. Results on judging
seeds must change nothing in the program.
"""

import sys
import time
from dataclasses import dataclass, replace
from functools import partial
from itertools import count
from typing import NamedTuple

import beside  # noqa: F401
import numpy as np
from arms import SIGMA, robot_of, states
from decide import DISTINGUISHABLE, Sight
from draws import direction, draw
from generator import four, rotation, shift
from laws import poses as deflected_poses
from morphologies import MORPHOLOGIES
from options import run_options

from workbench import Dataset, diagnose
from workbench.base.errors import DataError

ARMS = ("aria", "three-parallel", "seven", "industrial", "katana")
ROWS = 120
NEAR = 2
"""Measured rows by which the row of an event may be off."""
SLIP, TURN = (0.5e-3, 1e-3), (0.3e-3, 1e-3)
"""Least and greatest step of a frame or a tool [m], and how far it turns where it does [rad]."""
ZERO, WARM, PACE = (0.8e-3, 1.2e-3), 1.2e-3, 720.0
"""Step of a joint's zero, change of a joint that warms up [rad or m], and its time constant [s]."""
MARKERS = np.array([[0.0, 0.0, 0.0], [0.08, 0.0, 0.01], [0.0, 0.07, -0.02]])
"""Places of markers in the tool frame [m]."""
RIGHT, FALSE = 0.95, 0.01
"""Share of events that must be named, and of arms that may be accused of something."""
EVENTS = ("frame-step", "tool-step", "zero-step", "warm-up")


@dataclass(frozen=True)
class Happened:
    """An event: its kind, the joint (None for frame and tool), and the first row after it (None: warm-up)."""

    kind: str
    joint: int | None = None
    row: int | None = None


@dataclass(frozen=True)
class Case:
    """What happens to an arm.

    Args:
        events: Kinds, in this order of time.
        effects: What the arm has besides, by the catalogue's names.
        late: Whether the event lies in the last tenth of the rows.
        tails: Degrees of freedom of Student's t that the noise follows; None: normal.
        shuffled: Whether the file's order is another than that of the measurements.
        timed: Whether the file has times.
        pose: Whether orientations are measured too.
        readings: Noise of the logged joint angles [rad].
        markers: Whether three markers on the tool are measured, in place of one point.
        known: Whether base and tool are those of the file until something happens.
    """

    events: tuple[str, ...] = ()
    effects: tuple[tuple[str, object], ...] = ()
    late: bool = False
    tails: float | None = None
    shuffled: bool = False
    timed: bool = True
    pose: bool = False
    readings: float = 0.0
    markers: bool = False
    known: bool = False


COMPLIANCE, ECCENTRIC, DRIFT = ("joint-compliance", None), ("joint-harmonic", 1), ("base-drift", None)
CASES = {
    "slip": Case(("tool-step",)),
    "slip-pose": Case(("tool-step",), pose=True),
    "slip-markers": Case(("tool-step",), markers=True),
    "knock": Case(("frame-step",)),
    "knock-pose": Case(("frame-step",), pose=True),
    "slip-known": Case(("tool-step",), known=True),
    "knock-known": Case(("frame-step",), known=True),
    "zero": Case(("zero-step",)),
    "warm-joint": Case(("warm-up joint",)),
    "warm-frame": Case(("warm-up frame",)),
    "two": Case(("zero-step", "frame-step")),
    "twice": Case(("frame-step", "frame-step")),
    "slip-compliance": Case(("tool-step",), (COMPLIANCE,)),
    "knock-eccentric": Case(("frame-step",), (ECCENTRIC,)),
    "zero-both": Case(("zero-step",), (COMPLIANCE, ECCENTRIC)),
    "knock-drift": Case(("frame-step",), (DRIFT,)),
    "late-slip": Case(("tool-step",), late=True),
    "late-knock": Case(("frame-step",), late=True),
    "shuffled": Case(("frame-step",), shuffled=True),
    "untimed": Case(("zero-step",), timed=False),
    "tails": Case(("tool-step",), tails=3.0),
    "readings": Case(("frame-step",), readings=2e-4),
    "drift": Case((), (DRIFT,)),
    "untimed-drift": Case((), (DRIFT,), timed=False),
    "none": Case(),
    "none-tails": Case(tails=3.0),
    "none-untimed": Case(timed=False),
    "none-compliance": Case((), (COMPLIANCE,)),
    "none-eccentric": Case((), (ECCENTRIC,)),
    "none-readings": Case(readings=2e-4),
}
"""Cases by name; those without an event come last."""


class Measured(NamedTuple):
    """An arm with its rows, and what happened."""

    robot: object
    data: Dataset
    truth: tuple[Happened, ...]
    effects: tuple
    measured: np.ndarray
    """For every row of the file, which measurement it is."""
    shown: float
    """What geometry leaves of all that happened, in noise units."""


def make(case: Case, seed: int, arm: str) -> Measured:
    """Draw an arm."""
    of_arm, of_rows, of_events, of_noise = (np.random.default_rng([seed, k]) for k in range(4))
    nominal = MORPHOLOGIES[arm]()
    actual = nominal.perturbed(of_arm, 1e-3, np.deg2rad(0.3))
    if not case.known:
        actual = replace(actual, base=_off(actual.base, of_arm), tool=_off(actual.tool, of_arm))
    state = states(actual, ROWS, of_rows, None)
    state = replace(state, time=np.sort(state.time) + 3.0 * np.arange(ROWS))
    effects = tuple(
        next(e for _ in count() if (e := draw(name, actual, state, of_events, detail=detail)) is not None)
        for name, detail in case.effects
    )
    _, still = _measured(replace(case, events=()), actual, state, effects, of_events)
    truth, seen = _measured(case, actual, state, effects, of_events)
    sigma = SIGMA if case.pose or case.markers else (SIGMA[0], np.inf)
    shown = Sight(actual, state, not case.known, sigma).beside_geometry(seen, still)
    drawn = of_noise.standard_normal if case.tails is None else partial(of_noise.standard_t, case.tails)
    noise = drawn(size=(ROWS, 6)) * np.repeat(SIGMA, 3)
    seen[:, :3, 3] += noise[:, :3]
    seen[:, :3, :3] = rotation(noise[:, 3:]) @ seen[:, :3, :3]
    order = of_noise.permutation(ROWS) if case.shuffled else np.arange(ROWS)
    markers = np.einsum("rab,mb->rma", seen[:, :3, :3], MARKERS) + seen[:, None, :3, 3]
    markers += SIGMA[0] * of_noise.standard_normal(markers.shape)
    data = Dataset(
        q=(state.q + case.readings * of_noise.standard_normal(state.q.shape))[order],
        position=None if case.markers else seen[order, :3, 3],
        markers=markers[order] if case.markers else None,
        rotation=seen[order, :3, :3] if case.pose else None,
        time=state.time[order] if case.timed else None,
        direction=state.direction[order],
    )
    return Measured(robot_of(nominal, arm, not case.known), data, truth, effects, order, shown)


def _measured(case, arm, state, effects, rng):
    """What happened, and the poses (rows, 4, 4) that were measured without noise."""
    bases, tools = np.tile(arm.base, (ROWS, 1, 1)), np.tile(arm.tool, (ROWS, 1, 1))
    q, truth, number = state.q.copy(), [], len(case.events)
    grown = 1.0 - np.exp(-(state.time - state.time[0]) / PACE)
    for k, event in enumerate(case.events):
        low, high = (0.9, 0.95) if case.late else 2 * ((k + 0.7) / (number + 0.4),)
        row = min(int(ROWS * rng.uniform(low, high)) + int(rng.integers(-4, 5)), ROWS - 6)
        joint = int(rng.integers(arm.dof))
        if event == "zero-step":
            q[row:, joint] += rng.choice([-1.0, 1.0]) * rng.uniform(*ZERO)
            truth.append(Happened(event, joint, row))
        elif event == "warm-up joint":
            q[:, joint] += WARM * rng.choice([-1.0, 1.0]) * grown
            truth.append(Happened("warm-up", joint))
        elif event == "warm-up frame":
            bases[:, :3, 3] += grown[:, None] * 1e-3 * direction(rng)
            truth.append(Happened("warm-up"))
        elif event == "tool-step":
            tools[row:] = tools[row:] @ _moved(rng, rng.uniform(*TURN) if case.pose or case.markers else 0.0)
            truth.append(Happened(event, None, row))
        else:
            bases[row:] = bases[row:] @ _moved(rng, rng.choice([0.0, 1.0]) * rng.uniform(*TURN))
            truth.append(Happened(event, None, row))
    plain = replace(arm, base=np.eye(4), tool=np.eye(4))
    drifting = [e for e in effects if e.name == "base-drift"]
    crept = deflected_poses(plain, drifting, state) @ np.linalg.inv(deflected_poses(plain, [], state))
    own = replace(arm, base=np.eye(4))
    deflected = deflected_poses(own, [e for e in effects if e.name != "base-drift"], replace(state, q=q))
    return tuple(truth), crept @ bases @ deflected @ np.linalg.inv(arm.tool) @ tools


def _moved(rng, turn):
    return four(rotation(turn * direction(rng))) @ shift(rng.uniform(*SLIP) * direction(rng))


def _off(frame, rng):
    return frame @ four(rotation(0.02 * rng.uniform(-1, 1, 3))) @ shift(0.02 * rng.uniform(-1, 1, 3))


def judge(name: str, seed: int) -> dict:
    """Diagnose one arm, and say which events were named and what was named falsely."""
    arm = ARMS[seed % len(ARMS)]
    made = make(CASES[name], seed, arm)
    began = time.process_time()
    try:
        found = diagnose(made.robot, made.data, held_out=0.2)
    except DataError as error:
        return {"arm": arm, "right": False, "shown": True, "false": [], "message": str(error)}
    seconds = time.process_time() - began
    missed, false = list(made.truth), []
    known = {(e.name, j) for e in made.effects for j in e.joints or (None,)}
    for cause in (c for c in found.causes if c.confidence != "cannot tell"):
        output = [(cause.kind, j) for j in cause.joints or (None,)]
        if cause.kind in EVENTS:
            row = int(made.measured[cause.row])
            alike = [t for t in missed if [(t.kind, t.joint)] == output]
            hit = next((t for t in alike if t.row is None or abs(t.row - row) <= NEAR), None)
            if hit is None:
                false.append(f"{cause.label} at {row} ({cause.confidence})")
            else:
                missed.remove(hit)
        elif not known.issuperset(output):
            false.append(f"{cause.label} ({cause.confidence})")
    return {
        "arm": arm,
        "right": not missed,
        "shown": not made.truth or made.shown >= DISTINGUISHABLE,
        "missed": [f"{t.kind} {t.joint} {t.row}" for t in missed],
        "false": false,
        "after_mm": found.error.after.position_mm.mean,
        "message": found.message,
        "seconds": seconds,
    }


def main(arguments=None):
    given = run_options(__doc__.splitlines()[0], "cases", CASES, arms=10, arguments=arguments)
    held = True
    for name in given.kinds:
        found = [judge(name, seed) for seed in given.seeds]
        shown = [f for f in found if f["shown"]]
        right, false = sum(f["right"] for f in shown), sum(bool(f["false"]) for f in found)
        others = f"and {sum(f['right'] for f in found) - right}/{len(found) - len(shown)} hardly shown"
        error, seconds = (
            float(np.median([f.get(k, np.nan) for f in found])) for k in ("after_mm", "seconds")
        )
        held &= right >= RIGHT * len(shown) and false <= FALSE * len(found)
        print(
            f"{name:18} named {right:3}/{len(shown)} {others}  false {false:3}  {error:.3f} mm  "
            f"{seconds:.2f} s",
            flush=True,
        )
        for seed, f in zip(given.seeds, found, strict=True):
            if given.wrong and (f["false"] or not f["right"]):
                print(f"    {seed} {f['arm']}: missed {f.get('missed')}, false {f['false']}")
                print(f"      {f['message']}")
    return int(given.check and not held)


if __name__ == "__main__":
    sys.exit(main())
