"""How motors count against the joints of a URDF: which joint, which way, and where zero is, each with ±.

    joint = sign · motor + offset

from 12 to 20 poses of a board that the arm holds, or of a camera that it holds, mounted nobody knows where:
signs by an exact search (`sign_search.py`), offsets by the identification engine, sag in what these leave
(`sag.py`); which way sag points tells an arm that stands from one that hangs. The zeros of the
first and the last joint are turns of the unknown mounting and stay open.
"""

from dataclasses import dataclass
from itertools import combinations
from typing import Any, final

import numpy as np
from jaxtyping import Float

from workbench.arm.effects.effect import AbstractEffect
from workbench.arm.joint_units import sliding
from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import Frame, Robot
from workbench.arm.signs_and_offsets import with_signs_and_offsets
from workbench.base import se3
from workbench.base.arguments import checked_arguments
from workbench.base.errors import DataError, OptionError
from workbench.base.hand_eye import base_and_tool
from workbench.base.threads import one_thread
from workbench.base.types import Freedom
from workbench.base.wording import in_mm, plural
from workbench.data.arguments import DatasetLike, RobotLike
from workbench.data.dataset import Dataset
from workbench.extras.hobby.layouts import NAMED
from workbench.extras.hobby.sag import Sag, sag_of
from workbench.extras.hobby.sign_search import Counting, find_counting
from workbench.identification.errors.row_errors import Errors
from workbench.identification.identify import identify
from workbench.identification.joint_reading_noise import alike_readings
from workbench.identification.report.results_json import identification_json
from workbench.identification.result import Identification
from workbench.report.blocks import Block, ResultTable, headed
from workbench.report.json import Json, document
from workbench.report.numbers import signed
from workbench.report.result_display import AbstractShown

SCHEMA = "workbench.motor-map/1"
MIN_POSES, USUAL = 8, "12 to 20"
MOVED = np.deg2rad(15.0)
"""Minimum range of each motor."""
TURNED = 0.1
"""Minimum root mean square turn of the board about a second axis [rad]."""
ALIKE_WITHIN = 4.0
"""Log likelihood within which two ways of counting fit alike."""
SAME = 0.02
"""Share of the arm's length, or twice what is left, by which two ways of counting may differ and be one."""
NORMAL = 1.96
ALIKE_OFFSETS = np.deg2rad(45.0)
"""Sum of offsets by which another way of counting may exceed the one that is taken, and is mentioned."""
OTHER = (
    "another combination of signs and zeros describes the same arm in another mounting; this one has the "
    "smallest zeros; if joints run the wrong way in a viewer, start with the arm near its zeros"
)


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class MotorMap(AbstractShown):
    """How motors count.

    Args:
        nominal: The arm as its file has it.
        motors: Names of the motors.
        counting: Signs, and offsets before the identification.
        offsets: What is added to each motor's angle after its sign [rad]; NaN where the mounting decides.
        half: Half of their 95 % intervals [rad].
        before: Mean error with all zeros as the motors have them, mounting fitted [m].
        alone: Mean error that is left at the poses with the zeros alone [m].
        run: The identification of the arm whose joints count as the motors do, with its sag.
        sag_error: Error of the tip to expect anywhere, as the sag is uncertain [m].
        notes: What else should be known, one sentence each.
    """

    nominal: Robot
    motors: tuple[str, ...]
    counting: Counting
    offsets: Float[np.ndarray, " n"]
    half: Float[np.ndarray, " n"]
    before: float
    alone: float
    run: Identification
    sag_error: float = 0.0
    notes: tuple[str, ...] = ()

    @property
    def robot(self) -> Robot:
        """The arm whose joints count as the motors do, with its sag where it was found; its files are
        judged by `before`, not by the arm with sag that was fitted."""
        start = np.repeat([[self.before], [np.nan], [np.nan]], len(self.run.train_rows), axis=1)
        best = self.run.best
        refused = best.refusals(Errors(*start), self.nominal.reach)
        return best.calibrated.recorded(refused=refused)

    @property
    def after(self) -> tuple[float, float]:
        """Mean errors that are left at the poses, with the zeros alone and with all that was found [m]."""
        return self.alone, 1e-3 * self.run.best.train.position_mm.mean

    @property
    def effects(self) -> tuple[AbstractEffect, ...]:
        return self.robot.effects

    @property
    def scatter(self) -> float:
        """Standard deviation of a joint about what its motor reads [rad]."""
        return self.run.best.fit.problem.noise.joints[0]

    @property
    def expected(self) -> float:
        """Error of the tip to expect anywhere, as zeros and sag are uncertain [m]."""
        return float(np.hypot(self.run.best.transfer.anywhere.position, self.sag_error))

    @property
    def reversed(self) -> list[str]:
        """Motors that count against their joint."""
        return [name for name, sign in zip(self.motors, self.counting.signs, strict=True) if sign < 0]

    @property
    def sentence(self) -> str:
        count = "counts" if len(self.reversed) == 1 else "count"
        motions = (
            f"{', '.join(self.reversed)} {count} in the opposite direction"
            if self.reversed
            else "all count in the direction of the URDF"
        )
        zeros, all_found = self.after
        more = f", and with sag {in_mm(all_found)}" if self.effects else ""
        return (
            f"{motions}; with these zeros the tip is {in_mm(zeros)} off on average instead of "
            f"{in_mm(self.before)}{more}"
        )

    def blocks(self) -> list[Block]:
        rows = []
        for k, name in enumerate(self.motors):
            sizes = (signed(float(np.rad2deg(v[k])), 2) for v in (self.offsets, self.half))
            sense = "with it" if self.counting.signs[k] > 0 else "against it"
            known = sizes if np.isfinite(self.offsets[k]) else ("–", "")
            rows.append((name, str(k + 1), sense, *known))
        table = ResultTable("Motors", ("motor", "joint", "counts", "zero off by [°]", "±"), rows, words=3)
        return headed(f"{self.nominal.name}: {self.sentence}", table, notes=self.notes_in_full)

    @property
    def notes_in_full(self) -> list[str]:
        """What should be known, one sentence each."""
        notes = ["the zeros of the first and last joint depend on how board and camera are mounted, and stay"]
        notes.append(f"expected error {in_mm(self.expected)} anywhere, from noise alone")
        if self.scatter > np.deg2rad(0.1):
            turn = np.rad2deg(self.scatter)
            notes.append(f"joints scatter by {turn:.2g}° about the motor readings: play, or sag")
        motion = Motion(self.run.data.q)
        notes += [f"also found: {e.sentence(self.robot.chain, motion)}" for e in self.effects]
        notes += [f"pose {o.row + 1} does not fit the others; it was left out" for o in self.run.outliers]
        return [*notes, *self.notes]

    def json(self) -> Json:
        """The result as plain data, in SI, with the identification under its own schema."""
        signs, zeros, half = self.counting.signs.astype(int), self.offsets, self.half
        joints = [
            {"joint": k + 1, "motor": name, "sign": signs[k], "offset": zeros[k], "half_width": half[k]}
            for k, name in enumerate(self.motors)
        ]
        return document(
            SCHEMA,
            robot=self.nominal.name,
            message=self.sentence,
            joints=joints,
            before_m=self.before,
            after_m=self.after,
            effects=[str(e.name) for e in self.effects],
            expected_m=self.expected,
            scatter_rad=self.scatter,
            notes=self.notes_in_full,
            identification=identification_json(self.run),
        )


@checked_arguments()
@one_thread()
def map_motors(robot: RobotLike, data: DatasetLike) -> MotorMap:
    """Find how motors count against an arm's joints, from poses of a board or of the tool.

    Args:
        robot: The arm of the URDF; its base and tool count for nothing.
        data: The motors' angles as joints, with poses or pictures; mounting unknown.

    Raises:
        DataError: too few poses, a motor that hardly moved, a board that hardly turned, another arm, or
            several ways of counting that fit.
        OptionError: an arm with joints that slide, or fewer than three.
    """
    if robot.dof < 3 or sliding(robot).any():
        raise OptionError(f"{robot.name}: the map needs three or more joints, all of them revolute")
    given = [note.removeprefix(NAMED).split(", ") for note in data.notes if note.startswith(NAMED)]
    q, poses, rows = _seen(robot, data.said)
    names = tuple(given[0]) if given else tuple(f"motor {k + 1}" for k in range(robot.dof))
    _check(data, q, poses, names)
    found = find_counting(robot, q, poses)
    if not found[0].fits(robot.reach):
        raise DataError(f"{data.source}: {_misfit(robot, found[0], q, poses, names)}")
    near = _near(robot, found, q, data)
    best = near[0]
    arm, alone = _of_zeros(robot, best, q, poses, data, rows)
    found_beside = _effects(alone)
    if found_beside.up and (standing := [c for c in near if c.base[:3, 2] @ best.base[:3, 2] < 0.0]):
        best = standing[0]
        arm, alone = _of_zeros(robot, best, q, poses, data, rows)
        found_beside = _effects(alone)
    effects = found_beside.effects
    run = _identified(arm.with_effects(*effects), alone.data) if effects else alone
    free = np.arange(1, robot.dof - 1)
    columns = [run.best.fit.problem.names.index(arm.joint_offsets[k]) for k in free]
    offsets, half = np.full((2, robot.dof), np.nan)
    moved = run.best.fit.x[columns] - arm.values(tuple(arm.joint_offsets[k] for k in free))
    offsets[free] = best.offsets[free] + best.signs[free] * moved
    half[free] = NORMAL * run.best.fit.std[columns]
    return MotorMap(
        nominal=robot,
        motors=names,
        counting=best,
        offsets=offsets,
        half=half,
        before=_error(robot, best.signs * q, poses),
        alone=1e-3 * alone.best.train.position_mm.mean,
        run=run,
        sag_error=found_beside.error,
        notes=(OTHER,) if any(c.turned < best.turned + ALIKE_OFFSETS for c in near if c is not best) else (),
    )


def _of_zeros(
    robot: Robot, best: Counting, q: np.ndarray, poses: np.ndarray, data: Dataset, rows: np.ndarray
) -> tuple[Robot, Identification]:
    """The arm that counts as the motors do, and its zeros alone."""
    counted = with_signs_and_offsets(robot.bare, best.signs, best.offsets)
    arm = counted.with_frames(base=Frame(free=Freedom.FREE), tool=Frame(free=Freedom.FREE))
    turned = se3.inverse(best.base) @ poses
    fitted = Dataset(
        q=best.signs * (_within(robot, best.joints(q)) - best.offsets),
        position=turned[:, :3, 3],
        rotation=turned[:, :3, :3],
        row=rows,
        source=data.source,
    )
    return arm, _identified(arm, fitted)


def _effects(alone: Identification) -> Sag:
    """Sag in what the zeros leave."""
    arm, data = alone.robot, alone.data.take(alone.train_rows)
    poses = se3.pose(np.asarray(data.rotation), np.asarray(data.position))
    return sag_of(arm, data.q, poses, alone.best.fit.problem.noise)


def _seen(robot: Robot, data: Dataset) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Motor angles, poses and numbers of the rows that have both."""
    robot.check_joints(data.q, data.source)
    if data.readings is not None:
        poses = data.readings.sights
    elif data.position is None or data.rotation is None:
        raise DataError(
            f"{data.source}: poses are needed, position and orientation, or pictures of the board"
        )
    else:
        poses = se3.pose(np.asarray(data.rotation), np.asarray(data.position))
    there = data.included & np.isfinite(poses).all((1, 2))
    return data.q[there], poses[there], np.flatnonzero(there)


def _check(data: Dataset, q: np.ndarray, poses: np.ndarray, names: tuple[str, ...]) -> None:
    if len(q) < MIN_POSES:
        raise DataError(
            f"{data.source}: {plural(len(q), 'pose')}; take {USUAL}, moving every joint in between"
        )
    width = np.array([_width(column) for column in q.T])
    if still := [names[k] for k in np.flatnonzero(width < MOVED)]:
        size = abs(np.rad2deg(width.min()))
        raise DataError(
            f"{data.source}: {', '.join(still)} moved by {size:.1f}° only; move every joint by 30° or more"
        )
    turns = se3.matrix_to_rotvec(poses[:, :3, :3] @ poses[0, :3, :3].T)
    if np.linalg.svd(turns, compute_uv=False)[1] < TURNED * np.sqrt(len(turns)):
        raise DataError(
            f"{data.source}: the board kept its orientation, or turned about one axis only; turn it about "
            "all axes between the poses"
        )


def _width(angles: np.ndarray) -> float:
    """Range of angles on the circle: the turn but for the largest gap [rad]."""
    ordered = np.sort(angles % (2.0 * np.pi))
    return float(2.0 * np.pi - np.diff(np.append(ordered, ordered[0] + 2.0 * np.pi)).max())


def _misfit(robot: Robot, best: Counting, q: np.ndarray, poses: np.ndarray, names: tuple[str, ...]) -> str:
    """That the poses don't fit the arm, and what to do: whether they do with two motors exchanged."""
    off = f"{in_mm(best.errors[0])} and {np.rad2deg(best.errors[1]):.2g}°"
    said = f"these poses do not fit {robot.name}: the best signs and zeros leave {off}"
    few = np.linspace(0, len(q) - 1, MIN_POSES, dtype=int)

    def counting(pair: tuple[int, int], rows: np.ndarray) -> Counting:
        order = np.arange(robot.dof)
        order[[*pair]] = pair[::-1]
        return find_counting(robot, q[np.ix_(rows, order)], poses[rows])[0]

    pair = min(combinations(range(robot.dof), 2), key=lambda pair: counting(pair, few).cost)
    if counting(pair, np.arange(len(q))).fits(robot.reach):
        both = " and ".join(names[k] for k in pair)
        return f"{said}; they fit with {both} exchanged: exchange their headings, or the motors' ids"
    return f"{said}; check robot, units and the motors' ids, and that each pose belongs to its row"


def _near(robot: Robot, found: list[Counting], q: np.ndarray, data: Dataset) -> list[Counting]:
    """The ways of counting that fit alike, which are one arm; that with the smallest offsets first."""
    best = found[0]
    near = [c for c in found if 6 * len(q) * np.log(c.cost / best.cost) < ALIKE_WITHIN]
    if other := next((c for c in near if not _same(robot, c, best)), None):
        open_signs = np.flatnonzero(other.signs != best.signs) + 1
        raise DataError(
            f"{data.source}: the poses don't determine the direction of joint "
            f"{', '.join(map(str, open_signs))}; take {USUAL} poses with every joint moved by 45° or more"
        )
    return sorted(near, key=lambda c: c.turned)


def _same(robot: Robot, a: Counting, b: Counting) -> bool:
    """Whether two ways of counting give the same poses for the same numbers, wherever they are."""
    q = np.random.default_rng(0).uniform(-1.0, 1.0, (50, robot.dof))
    first, second = (c.base @ tool_poses(robot.bare, Motion(c.joints(q))) @ c.end for c in (a, b))
    distances = np.linalg.norm(first[:, :3, 3] - second[:, :3, 3], axis=1)
    return bool(np.median(distances) < max(SAME, 2.0 * b.cost) * robot.reach)


def _within(robot: Robot, joints: np.ndarray) -> np.ndarray:
    """The same angles in the turn about the middle of the limits: counts may pass 4095 and 0."""
    middle = np.where(np.isfinite(robot.limits).all(1), robot.limits.mean(1), 0.0)
    return middle + (joints - middle + np.pi) % (2.0 * np.pi) - np.pi


def _identified(arm: Robot, data: Dataset) -> Identification:
    """The offsets between the first and last joint, rows weighed by how far joints scatter."""
    choices: dict[str, Any] = {"held_out": 0.0, "free": arm.joint_offsets[1:-1], "deviation": np.inf}
    fit = identify(arm, data, algorithms=("ols",), **choices).best.fit
    noise = alike_readings(fit.problem, fit.x)
    return identify(arm, data, algorithms=("ols",), noise=noise, **choices)


def _error(arm: Robot, joints: np.ndarray, poses: np.ndarray) -> float:
    """Mean distance of the board from where the arm has it, mounting fitted [m]."""
    tool = tool_poses(arm.bare, Motion(joints))
    base, end = base_and_tool(tool, poses)
    return float(np.linalg.norm((base @ tool @ end)[:, :3, 3] - poses[:, :3, 3], axis=1).mean())
