"""Blocks of a problem: rows of one session with one kind of observation, ready to be evaluated.

A problem's rows are split so that each block has one chain (base, arm, tool of its session) and one
observation; long ones are cut so that their twists stay in the processor's cache.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from workbench.arm import chain as chains
from workbench.arm.effects import AbstractEffect
from workbench.arm.gravity import tilted, tilting
from workbench.arm.kinematics.forward import Watched, watched
from workbench.arm.motion import Motion
from workbench.arm.parameters import Parameter
from workbench.arm.robot import Robot
from workbench.arm.statics.deflection import Twists, deflect, effect_columns
from workbench.arm.statics.wrenches import Masses, TrialArm, masses
from workbench.base.errors import DataError
from workbench.data.dataset import Dataset
from workbench.data.observation import AbstractObservation, Channel, Linearised, Unknown
from workbench.data.observations import OBSERVATIONS, TiltObservation
from workbench.data.prediction import predict
from workbench.identification.frame_freedom import FrameFreedom, frame_name, gravity_names
from workbench.report.result_fields import POSE

NO_PLACES = np.zeros(0, np.int64)
MIN_SIGMA = 1e-9
"""Minimum standard deviation of a component [m or rad]."""
ROWS_AT_ONCE = 256
"""Rows that are evaluated at once: their twists stay in the processor's cache and, even with hundreds of
coefficients, below the size that the allocator returns to the system after each use."""
KEPT = 8
"""Number of x at which derivatives of a short block are kept, whatever its noise: one search and the start of
the next."""


class Noise(NamedTuple):
    """Standard deviations that whiten the residuals.

    Args:
        position: Of a position or a distance [m].
        rotation: Of an orientation about each axis [rad].
        joints: Of the reading of every joint [rad or m]; empty where readings are taken to be exact.
        own: Of a reading in the observation's own unit. Position and rotation are then model errors of the
            tool in a row, which affect all its readings together.
        tilt: Of an inclinometer beside other observations [rad].

    A row's own sigma is the instrument's repeatability. These are added to it in quadrature for model errors;
    rows without their own sigma have these only.
    """

    position: float = 1e-4
    rotation: float = np.deg2rad(0.02)
    joints: tuple[float, ...] = ()
    own: float = 0.3
    tilt: float = np.deg2rad(0.02)

    @property
    def text(self) -> str:
        """Of positions and of orientations, where each is known."""
        sizes = ((1e3 * self.position, ".3g", " mm"), (np.rad2deg(self.rotation), ".2g", "°"))
        return ", ".join(f"{size:{digits}}{unit}" for size, digits, unit in sizes if np.isfinite(size))

    def json(self) -> dict[str, float]:
        """Of positions and orientations as files have it."""
        return POSE.json(self)


@dataclass(frozen=True, eq=False)
class Deflected:
    """Data of a block for arms with effects, beside its chain.

    Args:
        robot: The arm with its effects and the session's frames.
        names: Coefficients of effects that are unknown.
        places: Their indices in x.
        inertia: Indices in x of the links' masses and centres, as in `Robot.inertia`; empty if known.
        gravity: Indices in x of the two angles of gravity; empty if known.
        sized: Cache of the effects with the last coefficients, shared by all blocks.
    """

    robot: Robot
    motion: Motion
    names: tuple[str, ...]
    places: np.ndarray
    inertia: np.ndarray
    gravity: np.ndarray
    sized: dict[tuple[float, ...], tuple[AbstractEffect, ...]]

    def at(self, x: np.ndarray, values: np.ndarray) -> TrialArm:
        """The arm at x, with these constants of its chain."""
        return TrialArm(self.robot, self.robot.chain.with_values(values), self.effects(x), self.weights(x))

    def weights(self, x: np.ndarray) -> Masses | None:
        """Masses, centres and gravity at x; None if all of them are known."""
        if not len(self.inertia) + len(self.gravity):
            return None
        known = masses(self.robot)
        heavy = known.with_values(x[self.inertia]) if len(self.inertia) else known
        return replace(heavy, gravity=tilted(known.gravity, x[self.gravity])) if len(self.gravity) else heavy

    @property
    def varying(self) -> np.ndarray:
        """Which masses, centres and angles are unknown, among all columns."""
        size = 4 * len(masses(self.robot).mass) if len(self.inertia) + len(self.gravity) else 0
        heavy = np.arange(size if len(self.inertia) else 0)
        return np.concatenate([heavy, size + np.arange(len(self.gravity))])

    def effects(self, x: np.ndarray) -> tuple[AbstractEffect, ...]:
        """The robot's effects with the coefficients set."""
        sizes = tuple(x[self.places].tolist())
        if (found := self.sized.get(sizes)) is None:
            given = dict(zip(self.names, sizes, strict=True))
            found = tuple(e.sized(given) for e in self.robot.effects)
            self.sized.clear()
            self.sized[sizes] = found
        return found


@dataclass(frozen=True, eq=False)
class RowBlock:
    """Rows of one session seen by one observation.

    Args:
        session: Its name.
        arm: The robot with the frames and the gravity of the session.
        rows: Rows of the data.
        q: Their joint positions [rad or m].
        observation: How they were observed.
        elements: Elements whose constants are unknown.
        places: Indices in x of the unknown constants, then of masses, then of the angles of gravity if the
            rows depend on them; those of coefficients of effects are `coefficients`.
        unknowns: Indices of the instrument's unknowns in x, -1 for known ones.
        known: Values of the instrument's unknowns that are known.
        own_sigma: Standard deviation of every residual component that its row states; 0 if it states none.
        start: Index of the block's first residual component in the problem.
        noise: Noise that whitens the rows.
        turned: Indices in x of the angles by which the level frame of a watched link is rotated; empty if
            they are known or nothing is watched.
        deflected: Data for an arm with effects; None without.
    """

    session: str
    arm: Robot
    rows: np.ndarray
    q: np.ndarray
    observation: AbstractObservation
    elements: np.ndarray
    places: np.ndarray
    unknowns: np.ndarray
    known: np.ndarray
    own_sigma: np.ndarray
    start: int
    noise: Noise
    turned: np.ndarray
    deflected: Deflected | None
    kept: list[tuple[bytes, tuple[Linearised, Twists]]] = field(default_factory=list, init=False)

    def at(self, x: np.ndarray) -> tuple[Linearised, Twists]:
        """What is observed at x, and twists per unknown; of short blocks the last few x are kept."""
        if (known := self._known(x)) is not None:
            return known
        poses, twists = self.twists(x)
        found = self.observation.linearise(poses, self.unknown(x)), twists
        if len(self.rows) < ROWS_AT_ONCE:
            self.kept[:] = [(x.tobytes(), found), *self.kept[: KEPT - 1]]
        return found

    def _known(self, x: np.ndarray) -> tuple[Linearised, Twists] | None:
        key = x.tobytes()
        return next((found for other, found in self.kept if other == key), None)

    def unknown(self, x: np.ndarray) -> np.ndarray:
        """Values of the instrument's unknowns at x."""
        values = self.known.copy()
        mine = self.unknowns >= 0
        values[mine] = x[self.unknowns[mine]]
        return values

    def residual(self, x: np.ndarray) -> Float[np.ndarray, "rows m"]:
        """Measured minus predicted at x [m, rad or its own unit]."""
        if (known := self._known(x)) is not None:
            return known[0].residual
        return self.observation.linearise(self.poses(x), self.unknown(x)).residual

    @cached_property
    def inverse_sigma(self) -> Float[np.ndarray, "rows m"]:
        """Reciprocal standard deviation of every residual component, from the row's own and the added noise,
        joint readings exact; 0 where nothing was measured."""
        sizes = {c: getattr(self.noise, c.value) for c in Channel}
        on_top = np.array([sizes[channel] for channel in self.observation.channels])
        sigma = np.maximum(np.hypot(self.own_sigma, on_top), MIN_SIGMA)
        return np.where(self.observation.seen, 1.0 / sigma, 0.0)

    @cached_property
    def watched(self) -> Watched:
        """Part of the chain that the observation sees."""
        return watched(self.arm, self.observation.link)

    def view(self, x: np.ndarray) -> Watched:
        """That part, level at x."""
        if not len(self.turned) or self.watched.level is None:
            return self.watched
        return replace(self.watched, level=self.watched.level @ tilting(self.arm.gravity, x[self.turned]).T)

    @cached_property
    def by_joint(self) -> Float[np.ndarray, "rows m n"]:
        """Derivative of residual components by every joint, at nominal constants; for weights only."""
        moves = chains.joint_twists(self.arm.chain, self.q, part=self.watched.part)
        poses, twists = self.watched.turned(*moves)
        return self.observation.linearise(poses, self.known).by_twist @ twists

    @cached_property
    def shared(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Common errors of a row's components: directions Q (rows, m, k) and standard deviations s (rows, k)
        with I + Q diag(s²) Qᵀ the covariance of components in units of their own sigma; None if there are
        none.

        They come from noise of joint readings and, for readings in their own unit, from model errors of the
        tool's pose. Components that were not measured are unaffected.
        """
        columns = []
        if any(self.noise.joints):
            columns.append(self.by_joint * np.array(self.noise.joints))
        if Channel.OWN in self.observation.channels and (self.noise.position or self.noise.rotation):
            (poses,) = self.watched.turned(chains.poses(self.arm.chain, self.q, part=self.watched.part))
            lack = np.repeat([self.noise.position, self.noise.rotation], 3)
            columns.append(self.observation.linearise(poses, self.known).by_twist * lack)
        if not columns:
            return None
        whitened = np.concatenate(columns, axis=2) * self.inverse_sigma[..., None]
        q, s, _ = np.linalg.svd(whitened, full_matrices=False)
        return q * (self.inverse_sigma > 0.0)[..., None], s

    def mixed(self, table: Float[np.ndarray, "rows m ..."], power: float) -> Float[np.ndarray, "rows m ..."]:
        """A power of that covariance, times a table of components."""
        if self.shared is None:
            return table
        q, s = self.shared
        flat = table.reshape(*table.shape[:2], -1)
        factor = (1.0 + s**2) ** power - 1.0
        out = flat + q @ (factor[..., None] * (np.swapaxes(q, 1, 2) @ flat))
        return out.reshape(table.shape)

    def whiten(self, table: Float[np.ndarray, "rows m ..."]) -> Float[np.ndarray, "rows m ..."]:
        """Components divided by their standard deviations, and decorrelated where rows share errors."""
        out = table * self.inverse_sigma.reshape(*self.inverse_sigma.shape, *(1,) * (table.ndim - 2))
        return self.mixed(out, -0.5)

    def physical(self, whitened: Float[np.ndarray, "rows m"]) -> Float[np.ndarray, "rows m"]:
        """Components in m, rad and their own unit from whitened ones; 0 where nothing was measured."""
        whitened = self.mixed(whitened, 0.5)
        seen = self.inverse_sigma > 0.0
        return np.where(seen, whitened / np.where(seen, self.inverse_sigma, 1.0), 0.0)

    @property
    def sigma(self) -> Float[np.ndarray, "rows m"]:
        """Standard deviation of every residual component, joint readings included; infinite where hidden."""
        with np.errstate(divide="ignore"):
            alone = 1.0 / self.inverse_sigma
        if self.shared is None:
            return alone
        q, s = self.shared
        return alone * np.sqrt(1.0 + ((q * s[:, None]) ** 2).sum(2))

    def values(self, x: np.ndarray) -> np.ndarray:
        """Constants of the chain at x."""
        values = self.arm.chain.values.copy()
        values[self.elements] = x[self.places[: len(self.elements)]]
        return values

    def poses(self, x: np.ndarray) -> np.ndarray:
        chain, part, shift = self.arm.chain.with_values(self.values(x)), self.watched.part, chains.NO_SHIFT
        if (arm := self.deflected) is not None:
            shift = deflect(arm.at(x, chain.values), arm.motion).shift
        poses = chains.poses(chain, self.q, shift=shift, part=part)
        return self.view(x).turned(poses)[0]

    def twists(self, x: np.ndarray) -> tuple[np.ndarray, Twists]:
        """Poses of the observed frame at x, and its twists per unknown; plain ones ordered as `places`."""
        values, part, view = self.values(x), self.watched.part, self.view(x)
        if (arm := self.deflected) is None:
            poses, plain = chains.twists(self.arm.chain.with_values(values), self.q, self.elements, part=part)
            found = Twists(plain, plain[:, :, :0], ())
        else:
            trial, varying = arm.at(x, values), arm.varying
            poses, found = effect_columns(
                trial, arm.motion, self.elements, arm.names, varying=varying, part=part
            )
        if view.level is None and not len(self.turned):
            return poses, found
        turned, plain, moved = view.turned(poses, found.plain, found.moved)
        if len(self.turned):
            if arm is None or not len(arm.gravity):
                plain = np.concatenate([plain, np.zeros((len(plain), 6, 2))], axis=2)
            plain[:, [3, 4], [-2, -1]] -= 1.0  # rotating gravity is rotating the arm the other way
        return turned, replace(found, plain=plain, moved=moved)

    @property
    def coefficients(self) -> np.ndarray:
        """Indices in x of unknown coefficients of effects."""
        return NO_PLACES if self.deflected is None else self.deflected.places

    @property
    def stop(self) -> int:
        """First residual component after the block's."""
        return self.start + self.own_sigma.size


def tilts_beside(data: Dataset, kind: type[AbstractObservation]) -> tuple[TiltObservation, ...]:
    """Inclinometers of rows that are seen by another observation."""
    if kind is TiltObservation or data.tilt is None:
        return ()
    return tuple(replace(tilt, beside=True) for tilt in TiltObservation.each(data) if tilt.seen.any())


@lru_cache(maxsize=8)
def carried(data: Dataset) -> dict[type[AbstractObservation], Bool[np.ndarray, " rows"]]:
    """Observations that some rows carry, in their order, with these rows; kept for the next call."""
    found = {kind: kind.applies(data) for kind in OBSERVATIONS.values()}
    return {kind: rows for kind, rows in found.items() if rows.any()}


@lru_cache(maxsize=8)
def observed_kinds(data: Dataset) -> list[tuple[type[AbstractObservation], np.ndarray]]:
    """Every row with the first observation that fits it; kept for the next call."""
    left = np.ones(len(data), bool)
    kinds = []
    for kind, rows in carried(data).items():
        mine = rows & left
        left &= ~mine
        if mine.any():
            kinds.append((kind, np.flatnonzero(mine)))
    if left.any():
        row, wanted = int(data.row[left][0]), "position, markers, distance, contact or tilt"
        text = f"nothing to compare with a pose was measured ({wanted}) in data row {row}; exclude it"
        text = f"orientations alone tell no lengths: add {wanted}" if left.all() else text
        raise DataError(f"{data.source}: {text}", row=row)
    return kinds


def of_rows(data: Dataset, rows: np.ndarray) -> Dataset:
    """Rows by number, in their order."""
    return data if len(rows) == len(data) else data.take(rows)


@lru_cache(maxsize=8)
def observations(data: Dataset) -> list[tuple[AbstractObservation, Int[np.ndarray, " _"]]]:
    """Every kind of observation, with the numbers of its rows; kept for the next call."""
    kinds = observed_kinds(data)
    return [(each, rows) for kind, rows in kinds for each in kind.each(of_rows(data, rows))]


def instrument_start(
    robot: Robot, data: Dataset, freedom: FrameFreedom
) -> tuple[dict[str, float], dict[str, Unknown]]:
    """Initial guesses of an instrument's unknowns from the nominal poses, and constraints on them."""
    start: dict[str, float] = {}
    known: dict[str, Unknown] = {}
    kinds = observed_kinds(data)
    tilts = [(tilt, rows) for kind, rows in kinds for tilt in tilts_beside(of_rows(data, rows), kind)]
    for observation, rows in [*observations(data), *tilts]:
        if observation.unknowns:
            mine = of_rows(data, rows)
            poses = predict(freedom.placed(robot, mine.sessions), mine)
            start |= zip(observation.unknowns, observation.start(poses).tolist(), strict=True)
            known |= {name: observation.known.get(name, Unknown()) for name in observation.unknowns}
    return start, known


def build_blocks(
    robot: Robot,
    data: Dataset,
    parameters: Sequence[Parameter],
    frames: FrameFreedom,
    noise: Noise,
    values: Mapping[str, float],
) -> tuple[RowBlock, ...]:
    """Divide the rows by session, observation and size.

    Args:
        values: Initial guesses and known values of the instruments' unknowns.
    """
    blocks, start, placed = [], 0, frames.placed(robot, data.sessions)
    sized = dict[tuple[float, ...], tuple[AbstractEffect, ...]]()
    loaded, nothing = any(e.loads for e in robot.effects), NO_PLACES
    index = {p.name: i for i, p in enumerate(parameters)}
    names = [p.name for p in parameters if p.is_geometry]
    effects = tuple(p.name for p in parameters if p.is_coefficient)

    def places(some: Iterable[str]) -> np.ndarray:
        return np.array([index[n] for n in some if n in index], np.int64)

    coefficients, free = places(effects), places(robot.inertia)
    for session in data.sessions:
        in_session, arm = data.in_session(session), placed.in_session(session)
        elements, constants = list(arm.chain.indices(names)), [index[n] for n in names]
        for kind, parts, own in frames.by_frame:
            elements += [arm.chain.index[f"{kind}.{part}"] for part in parts]
            constants += [index[f"{frame_name(kind, own, session)}.{part}"] for part in parts]
        angles = places(gravity_names(session, frames))
        acting = angles if loaded else nothing
        for observation, rows, mine in pieces(data, in_session):
            turned = nothing if observation.link is None else angles
            stated = own_sigma_of(mine, observation.channels)
            blocks.append(
                RowBlock(
                    session=session,
                    arm=arm,
                    rows=rows,
                    q=np.ascontiguousarray(mine.q),
                    observation=observation,
                    elements=np.array(elements, np.int64),
                    places=np.concatenate([constants, free, acting if loaded else turned]).astype(int),
                    unknowns=np.array([index.get(n, -1) for n in observation.unknowns], np.int64),
                    known=np.array([values[n] for n in observation.unknowns], float),
                    own_sigma=stated,
                    start=start,
                    noise=noise,
                    turned=turned,
                    deflected=Deflected(arm, Motion.of(mine), effects, coefficients, free, acting, sized)
                    if robot.effects
                    else None,
                )
            )
            start += stated.size
    return tuple(blocks)


def pieces(
    data: Dataset, in_session: Bool[np.ndarray, " rows"]
) -> Iterator[tuple[AbstractObservation, np.ndarray, Dataset]]:
    """The session's rows of every observation, at most `ROWS_AT_ONCE` at a time, by number and in full."""
    for kind, rows in observed_kinds(data):
        rows = rows[in_session[rows]]
        for start in range(0, len(rows), ROWS_AT_ONCE):
            piece = rows[start : start + ROWS_AT_ONCE]
            mine = of_rows(data, piece)
            for observation in (*kind.each(mine), *tilts_beside(mine, kind)):
                yield observation, piece, mine


@lru_cache(maxsize=8)
def own_sigma_of(data: Dataset, channels: tuple[Channel, ...]) -> np.ndarray:
    """The rows' own standard deviations of every component, 0 where they state none; kept for the next call.

    Positions have one per axis, a distance the mean of all three.
    """
    if data.sigma is None or {Channel.OWN, Channel.TILT} & {*channels}:
        return np.zeros((len(data), len(channels)))
    sigma = np.nan_to_num(data.sigma, nan=0.0)
    if len(channels) == 1:
        return np.sqrt((sigma[:, :3] ** 2).mean(1))[:, None]
    return sigma[:, [3 * (c is Channel.ROTATION) + k % 3 for k, c in enumerate(channels)]]
