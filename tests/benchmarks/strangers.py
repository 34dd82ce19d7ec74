"""Diagnose virtual arms with troubles that the catalogue doesn't hold, and count what is claimed of them.

    python tests/benchmarks/strangers.py --arms 3                              # tuning seeds
    python tests/benchmarks/strangers.py --seeds judging --arms 10 --check
    python tests/benchmarks/strangers.py --kinds settling,without-compliance --wrong
    python tests/benchmarks/strangers.py --kinds 'without-*' --arms 30         # leave one kind out

Either a kind is taken out of the catalogue (`without-…`), or nobody wrote a law for it. So every cause that
is named is wrong, but for what is near enough (`Stranger.near`); right is which quantity the error follows.
Arms, statics and laws are those of `tests/diagnosis`, plain numpy that shares nothing with the package.
"""

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from unittest import mock

import beside  # noqa: F401
import numpy as np
from arms import EXACT, ROWS, SIGMA, UnseenError, robot_of, states
from draws import direction, draw
from generator import four, rotation
from laws import Effect, State, poses, straight_moments
from morphologies import MORPHOLOGIES
from options import ended, run_options

from workbench import Dataset, Motion, diagnose, tool_poses
from workbench.arm.effects import EFFECTS
from workbench.base.errors import DataError
from workbench.diagnosis.search.event_search import promising

ARMS = ("aria", "three-parallel", "industrial", "seven")
SEEN, GREEN, WORSE = 0.5, 1.5, 1.05
"""Noise of a row that a trouble must exceed to be asked for, and above which no verdict may be good; error of
the saved arm relative to the geometry's."""
CERTAIN, PROBABLE, DRIVEN = 0.01, 0.05, 0.9
"""Greatest shares of arms with a false cause, and least share of those whose driver is named."""


@dataclass
class VirtualRows:
    """What a trouble changes: the arm, its effects, the rows' state, the poses seen; `rng` draws its size."""

    arm: object
    state: State
    moves: np.ndarray
    rng: np.random.Generator
    effects: tuple[Effect, ...] = ()
    before: np.ndarray | None = None

    def drawn(self, name, joint=None, detail=None):
        """An effect that this arm can show, of a size that `draws.py` draws."""
        for _ in range(50):
            if (found := draw(name, self.arm, self.state, self.rng, joint=joint, detail=detail)) is not None:
                return found
        raise UnseenError(f"no draw of {name} can be seen")

    @property
    def late(self):
        """Share of the measurements that has passed (rows,); they are over in the fresh rows."""
        return np.minimum(np.arange(len(self.state.q)) / ROWS, 1.0)


@dataclass(frozen=True)
class Stranger:
    """A trouble.

    Args:
        does: Poses that are seen, given the rows.
        driver: What the error follows, one of these words; empty: nothing to be found.
        near: Names of causes that are near enough to the truth.
        out: Names taken out of the catalogue.
    """

    does: Callable[[VirtualRows], np.ndarray]
    driver: str
    near: tuple[str, ...] = ()
    out: tuple[str, ...] = ()


def seen(v, q=None, effects=None):
    """Poses of the arm at other joint positions than the logged ones."""
    return poses(
        v.arm, v.effects if effects is None else effects, replace(v.state, q=v.state.q if q is None else q)
    )


def settling(v):
    """Every joint is read before it has arrived: it lacks a share of its last move."""
    return seen(v, v.state.q - v.rng.uniform(3e-4, 8e-4, v.arm.dof) * np.tanh(v.moves / 1.5))


def sticking(v):
    """Two joints stay behind by what friction holds, but not after long moves."""
    lag = np.zeros_like(v.moves)
    for j in v.rng.permutation(v.arm.dof)[:2]:
        lag[:, j] = v.rng.uniform(8e-4, 1.6e-3) * np.sign(v.moves[:, j]) * np.exp(-np.abs(v.moves[:, j]))
    return seen(v, v.state.q - lag)


def fading(v):
    """Play of a joint closes while it is measured."""
    joint = np.eye(v.arm.dof)[v.rng.permutation(v.arm.dof - 1)[0] + 1]
    play = v.rng.uniform(6e-4, 1.5e-3) * (1.0 - v.late)[:, None] * joint
    return seen(v, v.state.q - play * v.state.direction)


def hysteresis(v):
    """Friction in proportion to the load: play that opens with it."""
    load = np.abs(straight_moments(v.arm, v.state)[:, 1:3, 2])
    lag = np.zeros_like(v.moves)
    lag[:, 1:3] = 1.2e-3 * load / load.max(0) * v.state.direction[:, 1:3]
    return seen(v, v.state.q - lag)


def loose_seat(v):
    """The reflector sits in one of two seats, at random."""
    out = seen(v)
    out[:, :3, 3] += (v.rng.random(len(out)) < 0.5)[:, None] * (out[:, :3, :3] @ (4e-4 * direction(v.rng)))
    return out


def bent_link(v):
    """A collision changes two constants of one link half-way."""
    table, link = v.arm.table.copy(), int(v.rng.integers(1, 4))
    table[link, 2:4] += v.rng.uniform(5e-4, 1e-3) * v.rng.choice([-1.0, 1.0], 2)
    return _later(v, seen(replace(v, arm=replace(v.arm, table=table))))


def another_arm(v, row=None):
    """Rows of another arm of the same make from some row on."""
    table = v.arm.table + 1e-3 * v.rng.uniform(-1, 1, v.arm.table.shape) * v.arm.proper()
    return _later(v, seen(replace(v, arm=replace(v.arm, table=table))), row)


def two_arms(v):
    """Every other row is another arm's of the same make."""
    out = seen(v)
    out[::2] = another_arm(v, row=0)[::2]
    return out


def knocked(v):
    """The measuring frame steps."""
    return _later(v, _step(v) @ seen(v))


def slipped(v):
    """The tool slips."""
    return _later(v, seen(v) @ _step(v))


def zero_moved(v):
    """The zero of a joint steps."""
    return _later(v, seen(v, v.state.q + 1e-3 * np.eye(v.arm.dof)[v.rng.integers(v.arm.dof)]))


def frame_warmed(v):
    """The measuring frame moves until it is warm, in a seventh of the time."""
    return four(rotation(1e-3 * np.exp(-7.0 * v.late)[:, None] * direction(v.rng))) @ seen(v)


def warming(v):
    """The arm warms up and cools again; the file has no temperature."""
    warmth = 20.0 + v.rng.uniform(20.0, 40.0) * np.sin(np.pi * v.late)
    return poses(v.arm, [Effect("thermal-growth", (), (2.3e-5,))], replace(v.state, temperature=warmth))


def grown_link(v):
    """One link alone grows with the temperature."""
    plain, table, link = seen(v), v.arm.table.copy(), int(v.rng.integers(1, 4))
    table[link, 1 + int(np.abs(table[link, 2]) > np.abs(table[link, 1]))] += 2e-5
    grown = seen(replace(v, arm=replace(v.arm, table=table))) - plain
    return plain + (v.state.temperature - 20.0)[:, None, None] * grown


def ceiling(v):
    """Soft joints of an arm that hangs from the ceiling, which its file doesn't say."""
    soft = [v.drawn("joint-compliance", joint=j) for j in (1, 2)]
    return poses(replace(v.arm, gravity=-v.arm.gravity), soft, v.state)


def creeping(v):
    """The zero of a joint settles by the logarithm of the time."""
    joint = np.eye(v.arm.dof)[v.rng.integers(1, v.arm.dof - 1)]
    return seen(v, v.state.q + 4e-4 * np.log1p(v.late / v.rng.uniform(0.02, 0.1))[:, None] * joint)


def sagging_tool(v):
    """The tool's tip gives way to gravity, by how the tool is turned."""
    out = seen(v)
    out[:, :3, 3] -= 4e-4 * (out[:, :3, :2] @ out[:, 2, :2, None])[..., 0]
    return out


def bending_table(v):
    """The table under the arm gives way with its reach."""
    out = seen(v)
    lean = 4e-4 / np.abs(out[:, :2, 3]).max() * np.stack([-out[:, 1, 3], out[:, 0, 3], 0.0 * v.late], 1)
    return four(rotation(lean)) @ out


def loose_base(v):
    """The base tips with the sign of the first joint's position."""
    tip = v.rng.uniform(2e-4, 4e-4) * np.sign(v.state.q[:, :1] - np.median(v.state.q[:, 0]))
    return four(rotation(tip * direction(v.rng))) @ seen(v)


def sight(v):
    """A tracker three metres away reads too far by a share of the square of the distance."""
    out, eye = seen(v), 2.0 * direction(v.rng)
    ray = out[:, :3, 3] - eye
    far = np.linalg.norm(ray, axis=1, keepdims=True)
    out[:, :3, 3] += 4e-4 * (far - far.mean()) ** 2 / np.ptp(far) ** 2 * 4.0 * ray / far
    return out


def pulled(v):
    """A spring from the tool to a point above the arm turns two soft joints."""
    place = seen(v)[:, :3, 3]
    pull, off = v.rng.uniform([-0.4, -0.4, 1.0], [0.4, 0.4, 1.6]) - place, np.zeros_like(v.state.q)
    for j in (1, 2):
        step = 1e-4 * np.eye(v.arm.dof)[j]
        arm = (seen(v, v.state.q + step)[:, :3, 3] - place) / 1e-4
        off[:, j] = v.rng.uniform(1e-3, 2e-3) * (arm * pull).sum(1)
    return seen(v, v.state.q + off)


def payload_between(v):
    """A payload is carried in the middle third, over soft joints, and no column says so."""
    soft = [v.drawn("joint-compliance", joint=j) for j in (1, 2)]
    return poses(v.arm, soft, replace(v.state, payload=3.0 * (np.abs(v.late - 0.5) < 1 / 6)))


def by_law(name, v):
    """A law of `laws.py`, in a joint and of a size that are drawn."""
    return seen(v, effects=[v.drawn(*name)] if isinstance(name, tuple) else [v.drawn(name)])


def _later(v, other, row=None):
    """The rows as they are, and as the other from some row on."""
    out, row = seen(v), int(ROWS * v.rng.uniform(0.35, 0.65)) if row is None else row
    out[row:] = other[row:]
    return out


def _step(v):
    return four(rotation(5e-4 * direction(v.rng)), 8e-4 * direction(v.rng))


SOFT = ("joint-compliance", "uneven-compliance")
STRANGERS = {
    "settling": Stranger(settling, "motion"),
    "sticking": Stranger(sticking, "motion"),
    "hysteresis": Stranger(hysteresis, "motion"),
    "fading": Stranger(fading, "motion", ("backlash",)),
    "wind-up": Stranger(partial(by_law, "wind-up"), "motion"),
    "hardening": Stranger(partial(by_law, "hardening drive"), "load", SOFT),
    "belt": Stranger(partial(by_law, "belt stretch"), "load", SOFT),
    "mount": Stranger(partial(by_law, "wobbling mount"), "load"),
    "dent": Stranger(partial(by_law, "dent"), "angle"),
    "hose": Stranger(partial(by_law, "dragging hose"), "angle"),
    "loose-seat": Stranger(loose_seat, ""),
    "bent-link": Stranger(bent_link, "time"),
    "another-arm": Stranger(another_arm, "time"),
    "two-arms": Stranger(two_arms, ""),
    "warming": Stranger(warming, "time"),
    "creeping": Stranger(creeping, "time"),
    "sagging-tool": Stranger(sagging_tool, "load"),
    "grown-link": Stranger(grown_link, "temperature", ("thermal-growth",)),
    "ceiling": Stranger(ceiling, "load", (*SOFT, "gravity-direction")),
    "table": Stranger(bending_table, "place load"),
    "loose-base": Stranger(loose_base, "angle"),
    "sight": Stranger(sight, "place"),
    "pull": Stranger(pulled, "place"),
    "payload": Stranger(payload_between, "time", SOFT),
    "quantised": Stranger(seen, ""),  # positions to the last tenth of a millimetre
} | {
    f"without-{short}": Stranger(partial(by_law, law), driver, out=out)
    for short, law, driver, out in (
        ("compliance", "joint-compliance", "load", (*SOFT, "gravity-sag")),
        ("backlash-load", ("backlash", None, "moment"), "load", ("backlash",)),
        ("backlash-motion", ("backlash", None, "motion"), "motion", ("backlash",)),
        ("clearance", "clearance-tilt", "load", ("clearance-tilt",)),
        ("bearing", "bearing-compliance", "load", ("bearing-compliance",)),
        ("flexure", "link-flexure", "load", ("link-flexure",)),
        ("harmonic", ("joint-harmonic", None, 2), "angle", ("joint-harmonic",)),
        ("scale", "encoder-scale", "angle", ("encoder-scale",)),
        ("coupling", "joint-coupling", "angle", ("joint-coupling",)),
        ("thermal", "thermal-growth", "temperature", ("thermal-growth",)),
        ("drift", "base-drift", "time", ("base-drift",)),
    )
} | {
    f"without-{kind}": Stranger(does, "time", out=(kind,))
    for kind, does in (
        ("frame-step", knocked), ("tool-step", slipped), ("zero-step", zero_moved), ("warm-up", frame_warmed)
    )
}  # fmt: skip


@dataclass(frozen=True)
class Met:
    """One diagnosis of a stranger.

    Args:
        claims: Kinds of the causes claimed, with joints and confidence.
        drivers: What the diagnosis says that the error follows.
        wrong: Confidences of causes that are not there.
        is_driver: Whether the true driver is named, by a cause or without; None if there is nothing to see.
        is_green: Whether the verdict is good although much more than noise is left.
        left: Mean held-out error, in noise of a row.
        geometry: Error of the geometry alone on noise-free rows [mm].
        saved: Of the saved arm.
        seconds: Processor time.
    """

    claims: tuple[str, ...]
    drivers: tuple[str, ...]
    wrong: tuple[str, ...]
    is_driver: bool | None
    is_green: bool
    left: float
    geometry: float
    saved: float
    verdict: str
    seconds: float


def rows_of(kind: str, seed: int) -> tuple[object, Dataset, Dataset]:
    """Robot, measured rows, and noise-free rows after them with the same trouble."""
    stranger, name = STRANGERS[kind], ARMS[seed % len(ARMS)]
    rng = np.random.default_rng([seed, sum(map(ord, kind))])
    nominal = MORPHOLOGIES[name]()
    arm = nominal.perturbed(rng, 1e-3, float(np.deg2rad(0.3)))
    state = states(arm, ROWS + EXACT, rng, None)
    moves = np.diff(state.q, axis=0, prepend=state.q[:1])
    exact = np.arange(ROWS + EXACT) >= ROWS
    found = stranger.does(VirtualRows(arm, state, moves, rng))
    true = Dataset(q=state.q, row=np.arange(len(found)), position=found[:, :3, 3], rotation=found[:, :3, :3])
    true = replace(true, time=state.time, direction=state.direction)
    true = replace(true, temperature=None if kind == "warming" else state.temperature)
    rough, noise = true.take(~exact), rng.standard_normal((ROWS, 6)) * np.repeat(SIGMA, 3)
    position = rough.position + noise[:, :3]
    position = 1e-4 * np.round(1e4 * position) if kind == "quantised" else position
    turned = rotation(noise[:, 3:]) @ rough.rotation if seed % 2 else None
    return robot_of(nominal, name, True), replace(rough, position=position, rotation=turned), true.take(exact)


def diagnosed(stranger: Stranger, robot, data: Dataset):
    """The diagnosis without what is taken out of the catalogue."""
    rest = {name: effect for name, effect in EFFECTS.items() if name not in stranger.out}

    def known(*about):
        return [c for c in promising(*about) if c.effect.name not in stranger.out]

    with (
        mock.patch("workbench.diagnosis.search.candidates.EFFECTS", rest),
        mock.patch("workbench.diagnosis.search.rounds.promising", known),
    ):
        return diagnose(robot, data)


def judged(kind: str, seed: int) -> Met:
    """Diagnose an arm and compare with the truth."""
    robot, data, exact = rows_of(kind, seed)
    stranger, began = STRANGERS[kind], time.process_time()
    result = diagnosed(stranger, robot, data)
    seconds = time.process_time() - began
    geometry = saved = _error(result.before_fit.calibrated, exact)
    if result.effects:  # else it is the geometry alone, fitted to held-out rows too
        saved = _error(result.calibrated, exact)
    sure = [c for c in result.causes if c.confidence != "cannot tell"]
    near = {*stranger.near, *stranger.out}
    wrong = [c for c in sure if near.isdisjoint([c.kind, *(e.name for e in c.look_alikes)])]
    followed = [str(f.driver) for f in result.followed if f.confidence != "cannot tell"]
    drivers = tuple(dict.fromkeys([*followed, *(str(c.driver) for c in sure)]))
    noise = 1e3 * SIGMA[0] * np.sqrt(3.0) * (1.0 if kind != "quantised" else 1.2)
    left = result.error.after.position_mm.rms / noise
    is_seen = bool(stranger.driver) and geometry > SEEN * noise
    return Met(
        claims=tuple(f"{c.kind} {[j + 1 for j in c.joints]} {c.confidence}" for c in result.causes),
        drivers=drivers,
        wrong=tuple(str(c.confidence) for c in wrong),
        is_driver=not {*drivers}.isdisjoint(stranger.driver.split()) if is_seen else None,
        is_green=bool(result.is_good and left > GREEN),
        left=left,
        geometry=geometry,
        saved=saved,
        verdict=f"{result.verdict_text}: {result.message}",
        seconds=seconds,
    )


def _error(robot, rows: Dataset) -> float:
    """Mean error on noise-free rows [mm]; NaN without a driver."""
    try:
        away = tool_poses(robot, Motion.of(rows))[:, :3, 3] - rows.position
    except DataError:
        return float("nan")
    return float(1e3 * np.linalg.norm(away, axis=1).mean())


def counts(ones):
    """Of some diagnoses: falsely certain, falsely probable, driver named and asked for, saved arm worse."""
    certain, probable = (sum(w in m.wrong for m in ones) for w in ("certain", "probable"))
    asked = [m.is_driver for m in ones if m.is_driver is not None]
    faint = SEEN * 1e3 * SIGMA[0] * np.sqrt(3.0)
    worse = sum(m.saved > WORSE * max(m.geometry, faint) for m in ones)
    return certain, probable, sum(asked), len(asked), worse


def bounds(name, ones):
    """Sentences on some diagnoses, and whether they hold."""
    if not ones:
        return
    count, green = len(ones), sum(m.is_green for m in ones)
    certain, probable, named, asked, worse = counts(ones)
    yield f"{name}: falsely certain ≤ {CERTAIN:.0%}: {certain} of {count}", certain <= CERTAIN * count
    yield f"{name}: falsely probable ≤ {PROBABLE:.0%}: {probable} of {count}", probable <= PROBABLE * count
    yield f"{name}: driver ≥ {DRIVEN:.0%}: {named} of {asked}", named >= DRIVEN * asked
    yield f"{name}: green above {GREEN} × noise: {green}", not green
    yield f"{name}: saved arm worse than the geometry: {worse} of {count}", worse <= CERTAIN * count
    yield f"{name}: {np.median([m.seconds for m in ones]):.1f} s median", True


def main(arguments=None):
    given = run_options(__doc__.splitlines()[0], "kinds", STRANGERS, arms=2, arguments=arguments)
    met = {}
    for kind in given.kinds:
        for seed in given.seeds:
            try:
                met[kind, seed] = m = judged(kind, seed)
            except UnseenError:
                continue
            mark = "F" if "certain" in m.wrong else "f" if m.wrong else "m" if m.is_driver is False else "r"
            claims, drivers = (", ".join(texts) or "–" for texts in (m.claims, m.drivers))
            fresh = f"{m.left:.1f} noise, fresh {m.geometry:.3f} → {m.saved:.3f} mm, {m.seconds:.1f} s"
            green = " GREEN" if m.is_green else ""
            print(f"{mark} {kind} {seed}: {claims} | follows {drivers} | {fresh}{green}", flush=True)
            if given.wrong:
                print(f"    {m.verdict}", flush=True)
    print(f"{'kind':26} arms  certain probable driver  worse")
    for kind in given.kinds:
        ones = [m for (mine, _), m in met.items() if mine == kind]
        certain, probable, named, asked, worse = counts(ones)
        print(f"{kind:26} {len(ones):4} {certain:8} {probable:8} {named:3} of {asked:2} {worse:5}")
    checks = [
        check
        for name, part in (("left out", True), ("strangers", False))
        for check in bounds(name, [m for (kind, _), m in met.items() if kind.startswith("without-") == part])
    ]
    return ended(given, checks)


if __name__ == "__main__":
    sys.exit(main())
