"""Drivers that an error may follow, each as a process through the elements of the arm that it may move.

| driver | of | through |
|---|---|---|
| angle | a joint | the joint, its bearing, another joint |
| | sum and difference of two joints next to each other | either joint |
| load | a joint's moment about its axis, also with its angle, the payload, other gravity | the joint |
| | its moments across its axis | its bearing, its link |
| | the direction of gravity in its frame | the tool, a link's lengths |
| motion | a joint's last motion, also with its load, its angle or the time | the joint |
| | a joint's last motion | another joint |
| | the speed of all joints: places and joints of different times | all joints |
| time, temperature | all rows | frame, tool, joints, lengths, any constant |
| two together | a joint's angle, load or motion, and another joint's angle | the joint, if it scatters |
| column | rows with the same value, where nobody said what it is | as time |
| place | where the tool is, what an instrument at the frame's origin reads of it | frame |
| | a pull on the tool to a point, in proportion to the way to it, as by a hose | the joint |

Over a load there are its simplest shapes besides, a line and a jump, which laws have too; over time and
temperature a line, over time a creep as well. Time is a driver only where postures come in no order: on a
path it can't be told from them.
"""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cached_property, partial
from itertools import pairwise, permutations, product

import numpy as np
from jaxtyping import Float

from workbench.arm.chain import Axis, Chain, frames
from workbench.arm.effects import AbstractEffect, Candidate
from workbench.arm.effects.axes import Insertion, across, driven_names, inserted_names, own, turns
from workbench.arm.effects.base_drift import mixed_share
from workbench.arm.effects.effect import moved_joints
from workbench.arm.effects.tilting import AbstractTilting
from workbench.arm.frame import BASE
from workbench.arm.kinematics.forward import geometric_jacobian, tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base.types import Vector3
from workbench.base.wording import joint_list
from workbench.data.measuring_order import clock_of
from workbench.diagnosis.drivers.path import Path
from workbench.diagnosis.drivers.process import (
    TIMES,
    DriverProcess,
    Features,
    jump,
    smooth,
    smooth_plane,
    wandering,
    with_one,
)
from workbench.diagnosis.search.candidates import known_wrenches
from workbench.identification.problem import Problem

ANGLE_LENGTHS, OTHER_LENGTH, TWO_LENGTH, MOTION_LENGTH = (0.25, 0.6, 1.5), 1.2, 0.8, 0.5
"""Correlation lengths over a joint's own angle, another's, sum and difference of two, and a motion's size
[rad or m]."""
LOAD_LENGTHS, ACROSS_LENGTH, WARM_LENGTH, READ_LENGTH = (0.5, 1.5), 0.9, 0.35, 0.05
"""Likewise over loads [in their standard deviations], over a temperature and a reading [in their ranges]."""
FEW = 6
"""Functions over a number, beside a line, of which each is multiplied with those over another."""
CARRIED_LENGTH = 0.5
"""Likewise over the payload [in its standard deviation]."""
MIN_LOAD, MIN_VARIATION = 1e-3, 0.03
"""Size of a load relative to the largest, and variation relative to its size, below which it is no driver."""
MIN_WARMING = 0.5
"""Range of temperatures below which they drive nothing [K]."""
MIN_PLACES, MIN_SPREAD = 20, 1e-3
"""Minimum number of places, and their spread [m]: the distance of a few alone fixes the scale."""
MAX_MOTION = 3.0
"""Motions above this are alike [rad or m]."""
MIN_PART, MAX_PARTS = 5, 4
"""Minimum number of rows with each value of a column, and maximum number of its values."""
MIN_MIXED = 0.3
"""Share of rows whose nearest posture must be much earlier or later for time to be a driver: 0.64 in no
order."""
TIME, SESSION, SPEED, WAY = "the time", "the session", "the speed of the joints", "the way by which {} came"
"""They in words."""
LOAD, AS_UNDER = "the load of {}", "as under a payload"
OPPOSED = "the load of {} as if the torque columns had the other sign"
UNSTATED = f"the load of {{}}, {AS_UNDER} that isn't stated"
TILTED = "the load of {}, as under gravity in another direction"
QUICK_TIMES = 26
"""Number of eigenfunctions over time, a period each two, but for constants, which change slowly: `TIMES`."""
CREEPS = (0.01, 0.03, 0.06, 0.12, 0.2, 0.3, 0.5)
"""Times from which a creep is one by their logarithm, as shares of all."""


class Driver(StrEnum):
    """What an error may follow."""

    ANGLE = "angle"
    LOAD = "load"
    MOTION = "motion"
    TIME = "time"
    TEMPERATURE = "temperature"
    PLACE = "place"
    COLUMN = "column"


def driver_of(effect: AbstractEffect) -> Driver:
    """The driver of an effect's law."""
    for driver, column in ((Driver.MOTION, "direction"), (Driver.TEMPERATURE, "temperature")):
        if column in effect.needs:
            return driver
    if effect.is_event or "time" in effect.needs:
        return Driver.TIME
    return Driver.LOAD if effect.loads else Driver.ANGLE


class Shape(StrEnum):
    """The simplest dependences: in proportion, also under other gravity, on a load's sign alone, on time's
    logarithm from some time on, once, by one delay of all joints, or by laws of load as another payload or
    one that hangs elsewhere."""

    LINE = "line"
    CREEP = "creep"
    STEP = "step"
    TURNED = "turned"
    JUMP = "jump"
    LAG = "lag"
    CARRIED = "carried"
    HANGS = "hangs"


@dataclass(frozen=True, eq=False)
class Follower:
    """A process over one driver.

    Args:
        phrase: The driver in words, `{}` for the joints: `the last motion of {}`.
        joints: Counted from 0.
        candidate: The process, its weights with one variance.
        shape: How it depends on its driver, if as simply as a law; by any function without.
        by: The joints that it follows, if these aren't those that it moves.
        is_even: Whether it gives way about both axes across a joint alike.
    """

    driver: Driver
    phrase: str
    joints: tuple[int, ...]
    candidate: Candidate
    shape: Shape | None = None
    by: tuple[int, ...] = ()
    is_even: bool = False

    def holds(self, effect: AbstractEffect, chain: Chain) -> bool:
        """Whether an effect's law is one of its functions: of the same quantity through the same elements; a
        bearing gives way as the next link may."""
        assert isinstance(self.candidate.effect, DriverProcess), "followers are processes"
        moved, elements = {*self.candidate.effect.moved}, {*effect.elements(chain)}
        if isinstance(effect, AbstractTilting) and self.candidate.effect.kind is Insertion.BEND:
            elements = {*inserted_names(chain, effect.joints, Insertion.BEND)}
        joints = {*self.joints, *self.by}
        if self.shape is not None and (self.shape is Shape.JUMP) != effect.has_play:
            return False
        if effect.of_many_joints:
            return moved <= elements and joints <= {*effect.joints}
        return joints == {*effect.joints} and 2 * len(moved & elements) >= max(len(moved), len(elements))

    @property
    def followed(self) -> tuple[int, ...]:
        """The joints whose angle, load or motion it follows; none where it follows something else."""
        of_joints = self.driver in (Driver.ANGLE, Driver.LOAD, Driver.MOTION)
        return (self.by or self.joints) if of_joints else ()

    @property
    def part(self) -> str:
        """What it moves: `joint`, `bearing`, `link`, `frame`, `tool`, or `constants`."""
        assert isinstance(self.candidate.effect, DriverProcess), "followers are processes"
        kind, is_plain = self.candidate.effect.kind, not self.joints and self.driver is not Driver.MOTION
        return ("constants" if is_plain else "joint", "bearing", "link", "frame", "tool")[kind]

    def as_step(self, clock: Float[np.ndarray, " rows"], row: np.ndarray, moment: float) -> "Follower":
        """The same elements, changed once at a moment of the clock of some rows, whose numbers in the file
        ascend: what a process over time may be."""
        assert isinstance(self.candidate.effect, DriverProcess), "followers are processes"
        before, after = row[clock < moment], row[clock >= moment]
        shape = (clock >= moment).astype(float)[:, None]
        key = f"{self.candidate.effect.key} at {moment}"
        effect = replace(self.candidate.effect, coefficients=(), key=key, features=shape, row=row)
        last = before[np.argmax(clock[clock < moment])], after[np.argmin(clock[clock >= moment])]
        phrase = self.phrase.replace(TIME, "a step between rows {} and {}".format(*last))
        own = Candidate(effect, np.eye(len(effect.names)))
        return replace(self, phrase=phrase, candidate=own, shape=Shape.STEP)

    @property
    def since(self) -> np.ndarray:
        """Numbers of the rows after it, if it is a step."""
        assert isinstance(self.candidate.effect, DriverProcess), "followers are processes"
        return self.candidate.effect.row[self.candidate.effect.features[:, 0] > 0.0]

    def text(self, beside: Sequence["Follower"]) -> str:
        """It in words, with the joints of all that are of its kind."""
        joints = sorted({j for f in beside if f.phrase == self.phrase for j in f.joints})
        return self.phrase.format(joint_list(joints) if joints else "")


def followed_text(parts: Sequence[Follower]) -> str:
    """Several processes in words: those of one kind with all their joints."""
    return "; and ".join(dict.fromkeys(part.text(parts) for part in parts))


def followers(
    problem: Problem, x: Float[np.ndarray, " p"], path: Path | None, drivers: Collection[Driver]
) -> tuple[Follower, ...]:
    """All processes over some drivers that the rows of a problem may show at its solution."""
    rows = DrivenRows(problem, x, path)
    return tuple(found for driver in drivers for found in _PROCESSES[driver](rows))


class DrivenRows:
    """Rows of a problem at its solution, with what drives them."""

    def __init__(self, problem: Problem, x: np.ndarray, path: Path | None):
        self.problem, self.x, self.path, self.data = problem, x, path, problem.data
        self.order = np.argsort(self.data.row, kind="stable")
        self.motion = Motion.of(self.data)
        known = self.motion.direction if path is None else path.sign
        self.sign = None if known is None else np.nan_to_num(known)
        self.alive = moved_joints(self.motion)
        clock, _ = clock_of(self.data)
        self.clock = (clock - clock.min()) / max(float(np.ptp(clock)), 1e-9)
        self.is_clocked = mixed_share(self.motion.q, clock) > MIN_MIXED

    @cached_property
    def arm(self) -> Robot:
        return self.problem.frames.placed(self.problem.robot_at(self.x), self.data.sessions)

    @cached_property
    def chain(self) -> Chain:
        return self.arm.chain

    @cached_property
    def ways(self) -> Float[np.ndarray, "rows n 3"]:
        """Ways of the tool by every joint."""
        return geometric_jacobian(self.arm, self.motion.q)[:, :3].transpose(0, 2, 1)

    @cached_property
    def down(self) -> Vector3:
        """Direction of gravity in the measuring frame; zero without gravity."""
        pull = self.arm.base.rotation @ self.arm.gravity
        return pull / max(float(np.linalg.norm(pull)), 1e-300)

    @cached_property
    def constants(self) -> tuple[str, ...]:
        """Unknown constants of the arm."""
        return tuple(p.name for p in self.problem.parameters if p.is_geometry and p.name in self.chain.index)

    @cached_property
    def lengths(self) -> dict[int, tuple[str, ...]]:
        """Lengths of the link after every joint that has some; the tool is that of the last."""
        elements, places = self.chain.elements, self.chain.driven.tolist()
        links = enumerate(elements[first + 1 : last] for first, last in pairwise(places))
        own = {j: tuple(e.name for e in link if Axis.TX <= e.axis <= Axis.TZ) for j, link in links}
        return {j: names for j, names in own.items() if names}

    @cached_property
    def wrenches(self) -> np.ndarray:
        """Through every joint in every row; empty where neither masses nor torques are known."""
        return self.wrenches_of(self.arm)

    @cached_property
    def stated(self) -> np.ndarray:
        """The same with the file's masses, where the fit has others: these suit its own laws."""
        mine = [i for i, p in enumerate(self.problem.parameters) if p.is_inertia]
        x = self.x.copy()
        x[mine] = [self.problem.parameters[i].nominal for i in mine]
        return self.wrenches_of(self.problem.frames.placed(self.problem.robot_at(x), self.data.sessions))

    def wrenches_of(self, arm: Robot, payload: float = 0.0) -> np.ndarray:
        """Of an arm with a payload more [kg]."""
        heavy = np.zeros(len(self.data)) if self.motion.payload is None else self.motion.payload
        motion, out = replace(self.motion, payload=heavy + payload), np.zeros((0, 0, 6))
        for block in self.problem.blocks:
            mine = known_wrenches(arm.in_session(block.session), motion.take(block.rows))
            if not len(mine):
                return mine
            out = out if len(out) else np.full((len(self.data), *mine.shape[1:]), np.nan)
            out[block.rows] = mine
        return np.nan_to_num(out)

    def varied(self, loads: Float[np.ndarray, "rows j d"]) -> list[int]:
        """Which of some loads of d numbers vary."""
        size, spread = (np.sqrt((v**2).sum(2).mean(0)) for v in (loads, loads - loads.mean(0)))
        felt = size > MIN_LOAD * max(float(size.max(initial=0.0)), 1e-9)
        return np.flatnonzero(felt & (spread > MIN_VARIATION * size)).tolist()

    def follower(
        self,
        driver: Driver,
        phrase: str,
        features: Features,
        *,
        joints: tuple[int, ...] = (),
        moved: tuple[str, ...] = (),
        by: tuple[int, ...] = (),
        together: np.ndarray | None = None,
        kind: Insertion = Insertion.NONE,
        by_load: bool = False,
        shape: Shape | None = None,
        tag: str = "",
    ) -> Follower:
        """A process that moves some elements, by default those of its kind, by features of these rows."""
        if not moved:
            shown = 3 if kind is Insertion.SLIP and not self.problem.sees_rotation else 6
            inserted = inserted_names(self.chain, joints, kind) if joints else kind.frame[:shown]
            moved = inserted if kind else driven_names(self.chain, joints)
        effect = DriverProcess(
            joints,
            key=f"{driver} {phrase} {' '.join(moved)}{tag}{shape or ''} {features.shape[1]}",
            moved=moved,
            together=np.eye(len(moved)) if together is None else together,
            features=features[self.order],
            row=self.data.row[self.order],
            kind=kind,
            by_load=by_load,
        )
        return Follower(driver, phrase, joints, Candidate(effect, np.eye(len(effect.names))), shape, by)


def _angles(rows: DrivenRows) -> Iterator[Follower]:
    for j in rows.alive:
        mine = rows.motion.q[:, j]
        what = f"the {'angle' if turns(rows.chain, j) else 'position'} of {{}}"
        for length in ANGLE_LENGTHS:
            yield rows.follower(Driver.ANGLE, what, smooth(mine, length), joints=(j,), tag=f" {length}")
        wave, through = smooth(mine, ANGLE_LENGTHS[1]), partial(rows.follower, Driver.ANGLE, joints=(j,))
        yield through(f"{what}, in its bearing", wave, kind=Insertion.TILT)
        if not turns(rows.chain, j):  # a way that isn't straight, seen in the frame that carries the arm
            yield through(f"{what}, in its way", wave, moved=Insertion.DRIFT.frame, kind=Insertion.DRIFT)
    q = rows.motion.q
    for j, k in permutations(range(rows.chain.dof), 2):
        if k in rows.alive:
            text = f"the angle of {joint_list((k,))}, in {{}}"
            yield rows.follower(Driver.ANGLE, text, smooth(q[:, k], OTHER_LENGTH), joints=(j,), by=(k,))
            if abs(j - k) == 1 and j in rows.alive:
                sum_of, other = (smooth(q[:, j] + sign * q[:, k], TWO_LENGTH) for sign in (1.0, -1.0))
                text = f"the angles of joints {min(j, k) + 1} and {max(j, k) + 1}, in {{}}"
                both = np.column_stack([sum_of, other])
                yield rows.follower(Driver.ANGLE, text, both, joints=(j,), by=(j, k))


def _hangs(rows: DrivenRows) -> Iterator[Follower]:
    """What gravity moves by its direction in the frame of the tool or of a link."""
    ends, place = np.unique([*rows.chain.driven, len(rows.chain.elements) - 1], return_inverse=True)
    turned = frames(rows.chain, rows.motion.q, ends)[:, place, :3, :3]
    down = np.einsum("rfij,i->rfj", turned, rows.down)
    what = "the direction of gravity in the frame of the "
    both, tool = np.column_stack([down[:, -1], np.sign(down[:, -1])]), Insertion.SLIP
    for moved, features in (tool.frame[:3], down[:, -1]), ((), both):
        yield rows.follower(Driver.LOAD, f"{what}tool, in the tool", features, moved=moved, kind=tool)
    what, link = f"{what}link after {{}}, in its lengths", Insertion.BEND
    for j in rows.lengths.keys() & rows.varied(down):
        yield rows.follower(Driver.LOAD, what, down[:, j], joints=(j,), moved=rows.lengths[j], kind=link)


def _loads(rows: DrivenRows) -> Iterator[Follower]:
    yield from _hangs(rows)
    heavy = rows.motion.payload
    carried = None
    if heavy is not None and np.isfinite(heavy).all() and (spread := float(heavy.std())) > 0.0:
        carried = smooth((heavy - heavy.mean()) / spread, CARRIED_LENGTH)
        yield from _through_all(rows, Driver.LOAD, "the payload", carried)
    yield from _payloads(rows, Driver.LOAD, UNSTATED, np.ones((len(rows.data), 1)))
    if not len(rows.wrenches):
        return
    chain, q, by_load = rows.chain, rows.motion.q, partial(rows.follower, Driver.LOAD, by_load=True)
    mine, stated = (own(chain, range(chain.dof), wrenches) for wrenches in (rows.wrenches, rows.stated))
    for j in rows.varied(mine[:, :, None]):
        load, other = (each[:, j] / mine[:, j].std() for each in (mine, stated))
        leap = jump(load[:, None], np.abs(load - other))
        shapes = [np.column_stack([smooth(load, length), leap]) for length in LOAD_LENGTHS]
        shapes += [load[:, None] * with_one(smooth(q[:, j], OTHER_LENGTH))] if j in rows.alive else []
        simple = (Shape.LINE, load[:, None]), (Shape.JUMP, leap)
        for k, (shape, found) in enumerate([*((None, f) for f in shapes), *simple]):
            yield by_load(LOAD, found, joints=(j,), shape=shape, tag=f" {k}")
        if j in rows.lengths:
            what = "the load of {}, in the lengths of its link"
            free = np.column_stack([load, np.abs(load), leap])
            yield by_load(what, free, joints=(j,), moved=rows.lengths[j], kind=Insertion.BEND)
    turning = [j for j in range(chain.dof) if turns(chain, j)]
    beside = across(chain, turning, rows.wrenches)
    for k in rows.varied(beside):
        j = turning[k]
        sides = beside[:, k] / np.maximum(np.linalg.norm(beside[:, k], axis=1, keepdims=True), 1e-300)
        for shape, even in (Shape.LINE, beside[:, k]), (Shape.JUMP, sides):
            what, ones = "the load across {}, in its bearing or link", np.ones((len(even), 1))
            through = partial(by_load, joints=(j,), kind=Insertion.TILT, shape=shape)
            yield replace(through(what, ones, together=even[rows.order, :, None]), is_even=True)
        angle = q[:, j] + chain.values[chain.driven[j]]
        c, s = np.cos(angle), np.sin(angle)
        here = beside[:, k]
        there = np.stack([c * here[:, 0] + s * here[:, 1], c * here[:, 1] - s * here[:, 0]], 1)
        for kind, load, part in ((Insertion.TILT, here, "bearing"), (Insertion.BEND, there, "link")):
            what = f"the load across {{}}, in its {part}"
            scaled = load / max(float(np.sqrt((load**2).mean())), 1e-300)
            leap = jump(scaled)
            free = np.column_stack([smooth_plane(scaled, ACROSS_LENGTH), leap])
            for shape, features in ((None, free), (Shape.LINE, scaled), (Shape.JUMP, leap)):
                yield by_load(what, features, joints=(j,), kind=kind, shape=shape)
    if carried is not None:
        yield from _payloads(rows, Driver.LOAD, "the load of {} and the payload", with_one(carried), kg=0.0)
    yield from _gravities(rows)


def _motions(rows: DrivenRows) -> Iterator[Follower]:
    """Motions back and forth act oppositely; without their sizes, only with load or angle."""
    if rows.sign is None:
        return
    sign, q = rows.sign, rows.motion.q
    loads = own(rows.chain, range(rows.chain.dof), rows.wrenches) if len(rows.wrenches) else np.zeros(q.shape)
    heavy = rows.varied(loads[:, :, None])
    if rows.path is not None and (rows.path.course.is_steady or rows.path.course.is_timed):
        moved, ones = driven_names(rows.chain, range(rows.chain.dof)), np.ones((len(sign), 1))
        speed = rows.path.course.speed[rows.order, :, None]
        lag = Shape.LAG if rows.path.course.is_steady else None
        yield rows.follower(Driver.MOTION, SPEED, ones, moved=moved, together=speed, shape=lag)
    for j in (j for j in rows.alive if np.ptp(sign[:, j]) > 0.0):
        shapes = {" angle": smooth(q[:, j], OTHER_LENGTH)}
        if rows.is_clocked:
            shapes[" change over time"] = wandering(rows.clock)
        if rows.path is not None:
            way = np.column_stack([sign[:, j], rows.path.wound[:, j]])
            yield rows.follower(Driver.MOTION, WAY, way, joints=(j,))
            size = np.minimum(np.abs(rows.path.moves[:, j]), MAX_MOTION)
            shapes[""] = smooth(size, MOTION_LENGTH)
        if j in heavy:
            shapes[" load"] = smooth(loads[:, j] / loads[:, j].std(), LOAD_LENGTHS[1])
        for i in {*range(rows.chain.dof)} - {j}:
            text = f"the last motion of {joint_list((j,))}, in {{}}"
            yield rows.follower(Driver.MOTION, text, sign[:, j, None], joints=(i,), by=(j,))
        for tag, shape in shapes.items():
            what = f"the last motion of {{}}{f' and its{tag}' if tag else ''}"
            yield rows.follower(Driver.MOTION, what, sign[:, j, None] * with_one(shape), joints=(j,))


def _times(rows: DrivenRows) -> Iterator[Follower]:
    if rows.is_clocked:
        yield from _through_all(rows, Driver.TIME, TIME, wandering(rows.clock, QUICK_TIMES))
        for begin in CREEPS:
            creep = np.log1p(rows.clock / begin)[:, None]
            yield from _through_all(rows, Driver.TIME, TIME, creep, f" {begin}")
        unsaid = f"{TIME}, {AS_UNDER} that changes, in {{}}"
        yield from _payloads(rows, Driver.TIME, unsaid, wandering(rows.clock))
    if len(names := rows.data.sessions) > 1:
        session = np.column_stack([rows.data.in_session(name) for name in names[1:]])
        yield from _through_all(rows, Driver.TIME, SESSION, session)


def constants_over_time(problem: Problem, x: Float[np.ndarray, " p"]) -> Iterator[Follower]:
    """A process of all constants of the arm over time, also on a path; none without unknown constants."""
    rows = DrivenRows(problem, x, None)
    if rows.constants:
        what, wave = f"{TIME}, in the arm's constants", wandering(rows.clock)
        yield rows.follower(Driver.TIME, what, wave, moved=rows.constants)


def products(
    problem: Problem, x: Float[np.ndarray, " p"], path: Path | None, joints: Sequence[int]
) -> Iterator[Follower]:
    """Processes over two quantities together through some joints: each is a function of the one times one of
    another joint's angle, which neither alone resembles."""
    rows = DrivenRows(problem, x, path)
    q, alive = rows.motion.q, rows.alive
    waves = {k: np.roll(smooth(q[:, k], OTHER_LENGTH), FEW, axis=1)[:, : FEW + 1] for k in alive}
    factors: dict[str, tuple[Driver, dict[int, Features]]] = {"the angle": (Driver.ANGLE, waves)}
    if len(rows.wrenches):
        loads = own(rows.chain, range(rows.chain.dof), rows.wrenches)
        factors["the load"] = Driver.LOAD, {j: loads[:, j, None] for j in rows.varied(loads[:, :, None])}
    if rows.sign is not None:
        factors["the last motion"] = Driver.MOTION, {j: rows.sign[:, j, None] for j in alive}
    for (what, (driver, of)), j in product(factors.items(), joints):
        for k in {*alive} - {j} if j in of else ():
            both = (of[j][:, :, None] * waves[k][:, None]).reshape(len(q), -1)
            text = f"{what} of joint {j + 1} together with the angle of joint {k + 1}, in {{}}"
            yield rows.follower(driver, text, both, joints=(j,), by=(j, k))


def _payloads(rows: DrivenRows, driver: Driver, phrase: str, shape: Features, kg=1.0) -> Iterator[Follower]:
    """A payload more, or with 0 kg the load itself, times some shape over the rows, through soft joints."""
    is_line, loads = driver is Driver.LOAD and not rows.arm.has_masses, np.zeros((len(rows.data), 0))
    if rows.arm.has_masses:
        more = rows.wrenches_of(rows.arm, kg) - (rows.wrenches if kg else 0.0)
        loads = own(rows.chain, range(rows.chain.dof), more)
    elif kg and not len(rows.wrenches):
        loads = rows.ways @ rows.down
    for j in rows.varied(loads[:, :, None]):
        heavy = loads[:, j, None] / np.abs(loads[:, j]).max()
        yield rows.follower(driver, phrase, heavy * shape, joints=(j,), shape=Shape.LINE if is_line else None)


def _gravities(rows: DrivenRows) -> Iterator[Follower]:
    """Gravity in any direction acts through soft joints by its components along the axes of the base."""
    mountings = [rows.arm.in_session(name).mounting for name in rows.data.sessions]
    if not rows.arm.has_masses or len({tuple(m.gravity.tolist()) for m in mountings}) > 1:
        return
    chain, parts = rows.chain, []
    for gravity in (np.zeros(3), *np.linalg.norm(rows.arm.gravity) * np.eye(3)):
        sessions = {name: replace(own, gravity=gravity) for name, own in rows.arm.sessions.items()}
        arm = replace(rows.arm, mounting=replace(rows.arm.mounting, gravity=gravity), sessions=sessions)
        parts.append(own(chain, range(chain.dof), rows.wrenches_of(arm)))
    gives = np.stack([parts[0] - part for part in parts[1:]], axis=2)
    for j in rows.varied(gives):
        yield rows.follower(Driver.LOAD, TILTED, gives[:, j], joints=(j,), by_load=True, shape=Shape.TURNED)


def _temperatures(rows: DrivenRows) -> Iterator[Follower]:
    warm = rows.motion.temperature
    if warm is not None and np.isfinite(warm).all() and np.ptp(warm) > MIN_WARMING:
        wave = smooth((warm - warm.min()) / np.ptp(warm), WARM_LENGTH)
        yield from _through_all(rows, Driver.TEMPERATURE, "the temperature", wave)
        softer = "the temperature, as where a joint gives way more when warm, in {}"
        yield from _payloads(rows, Driver.TEMPERATURE, softer, wave - wave.mean(0), kg=0.0)


def _columns(rows: DrivenRows) -> Iterator[Follower]:
    """Columns of the file that nobody named, whose values part the rows."""
    for heading, cells in rows.data.unread.items():
        said = heading.replace("{", "{{").replace("}", "}}")
        _, value, counts = np.unique(cells.astype(str), return_inverse=True, return_counts=True)
        if 1 < len(counts) <= MAX_PARTS and counts.min() >= MIN_PART:
            parts, name = np.eye(len(counts))[value][:, 1:], f"the column '{said}'"
            yield from _through_all(rows, Driver.COLUMN, name, parts)
            yield from _payloads(rows, Driver.COLUMN, f"{name}, {AS_UNDER} that changes, in {{}}", parts)


def _through_all(rows: DrivenRows, driver: Driver, name: str, wave: Features, creep="") -> Iterator[Follower]:
    """A driver of all rows through everything that it may move, by any function and by the first feature, or
    by a creep alone."""
    chain = rows.chain
    lengths = [e for e in chain.elements if Axis.TX <= e.axis <= Axis.TZ and e.link != BASE]
    values = np.array([[chain.values[chain.index[e.name]]] for e in lengths])
    shapes = (None, wave), (Shape.LINE, wave[:, :1])
    for shape, features in [(Shape.CREEP, wave)] if creep else shapes[: wave.shape[1]]:
        through = partial(rows.follower, driver, features=features, shape=shape, tag=creep)
        yield through(f"{name}, in the measuring frame", kind=Insertion.DRIFT)
        yield through(f"{name}, in the tool", kind=Insertion.SLIP)
        for j in range(chain.dof):
            yield through(f"{name}, in {{}}", joints=(j,))
        yield through(f"{name}, in the arm's lengths", moved=tuple(e.name for e in lengths), together=values)
        if rows.constants and not creep:
            slow = features[:, : TIMES + 1]
            yield through(f"{name}, in the arm's constants", moved=rows.constants, features=slow)


def _places(rows: DrivenRows) -> Iterator[Follower]:
    """Measured places: predicted ones would be a function of the residuals."""
    yield from _pulls(rows)
    place = rows.data.position
    if place is None or not np.isfinite(place).all() or place.std() < MIN_SPREAD:
        return
    if len(np.unique(np.round(place, 4), axis=0)) > MIN_PLACES:
        p = (place - place.mean(0)) / place.std()
        squares = np.stack([p[:, i] * p[:, k] for i in range(3) for k in range(i, 3)], 1)
        shape = np.concatenate([p, squares - squares.mean(0)], 1)
        yield rows.follower(Driver.PLACE, "the tool's place", shape, kind=Insertion.DRIFT)
        (x, y, z), level = place.T, np.maximum(np.linalg.norm(place[:, :2], axis=1), 1e-9)
        far, aside = np.hypot(level, z), np.stack([-y, x, 0.0 * z], 1)
        for what, read, way in (  # by an instrument at the origin
            ("distance", far, place),
            ("azimuth", np.arctan2(y, x), aside),
            ("elevation", np.arctan2(z, level), np.cross(place, aside) / level[:, None]),
        ):
            wave, moved = smooth(read / max(np.ptp(read), 1e-9), READ_LENGTH), Insertion.DRIFT.frame[:3]
            text, along = f"the {what} of the tool seen from the frame's origin", way[rows.order, :, None]
            yield rows.follower(Driver.PLACE, text, wave, moved=moved, together=along, kind=Insertion.DRIFT)


def _pulls(rows: DrivenRows) -> Iterator[Follower]:
    """A force F = f − c p on the tool at p turns a soft joint by its moment aᵀF, a = ∂p/∂q; a weight there by
    f alone, along gravity, which may not be the file's."""
    place = tool_poses(rows.arm, rows.motion)[:, :3, 3] / rows.arm.reach
    pulls = np.concatenate([rows.ways, rows.ways @ place[..., None]], axis=2)
    for j in rows.varied(pulls):
        what = "a pull on the tool, as by a hose, in {}"
        yield rows.follower(Driver.PLACE, what, pulls[:, j], joints=(j,))
        if rows.down.any() and not (len(rows.wrenches) or rows.problem.frames.levelled):
            weight = pulls[:, j, :3]
            yield rows.follower(Driver.LOAD, TILTED, weight, joints=(j,), shape=Shape.TURNED)


_PROCESSES = {
    Driver.ANGLE: _angles,
    Driver.LOAD: _loads,
    Driver.MOTION: _motions,
    Driver.TIME: _times,
    Driver.TEMPERATURE: _temperatures,
    Driver.PLACE: _places,
    Driver.COLUMN: _columns,
}
