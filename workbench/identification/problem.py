"""One problem for all identifications: whitened residuals and their derivative in the unknowns.

Rows are split into blocks of one session and one observation, whose chain is evaluated at once. Its twists
(`chain.twists`, `effect_columns`) times the observation's derivative are the block's part of the Jacobian.
Unknowns x are absolute values [rad or m]: constants of the arm, coefficients of its effects [SI], constants
of the frames (per session where they differ), and of the instrument (anchors, contacts, markers).
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from workbench.arm.frame import revised
from workbench.arm.joint import MIN_DEVIATION
from workbench.arm.parameters import Parameter
from workbench.arm.robot import Robot
from workbench.arm.statics.deflection import law_sizes
from workbench.base.errors import OptionError
from workbench.base.threads import in_order
from workbench.base.types import frozen
from workbench.data.dataset import Dataset
from workbench.data.observation import Channel, Unknown
from workbench.data.postures import repeats
from workbench.identification.frame_freedom import (
    FrameFreedom,
    frame_parameters,
    gravity_names,
    level_constraint,
    moved_robot,
)
from workbench.identification.problem_blocks import (
    Noise,
    RowBlock,
    build_blocks,
    instrument_start,
    observed_kinds,
    of_rows,
    tilts_beside,
)

PRIOR_UNITS = 10.0
"""Natural unit in standard deviations of the prior, for constants that are always observable because of
it."""

CHANNELS = {Channel.POSITION: 0, Channel.OWN: 0, Channel.ROTATION: 1, Channel.TILT: 2}
"""Which components are weighed together: positions, rotations, tilts beside other observations."""


class LinearisedProblem(NamedTuple):
    """A problem linearised at one x.

    Args:
        residual: Whitened, measured minus predicted.
        jacobian: Whitened, of the prediction: the residual's derivative is its negative.
    """

    residual: Float[np.ndarray, " m"]
    jacobian: Float[np.ndarray, "m p"]


@dataclass(frozen=True, eq=False, kw_only=True)
class Problem:
    """Unknowns and measured rows; algorithms need nothing else.

    Args:
        robot: Nominal arm with the frames from which the search begins.
        data: Rows that are used.
        parameters: The unknowns.
        noise: Standard deviations on top of the rows' own.
        frames: Which parts of base and tool are unknown.
        knowledge: Whitening matrix W of prior knowledge: W (x − centre) joins the residuals.
        prior_centre: Prior mean of the unknowns.
        deviation: Prior standard deviation of the arm's constants about it, too [rad, m].
        row_weights: Factors of each row's residuals, from a robust loss.
        shares: What each row counts for, where others repeat its posture.
        facts: Prior knowledge of masses, centres and the instrument's unknowns.
        known: Values of the instrument's unknowns that are known, such as `anchor[A].x` [m].
    """

    robot: Robot
    data: Dataset
    parameters: tuple[Parameter, ...]
    noise: Noise
    frames: FrameFreedom
    blocks: tuple[RowBlock, ...]
    knowledge: Float[np.ndarray, "k p"]
    prior_centre: Float[np.ndarray, " p"]
    deviation: float | None = None
    row_weights: Float[np.ndarray, " rows"] | None = None
    shares: Float[np.ndarray, " rows"] | None = None
    facts: Mapping[str, Unknown] = field(default_factory=dict)
    known: Mapping[str, float] = field(default_factory=dict)

    @classmethod
    def build(
        cls,
        robot: Robot,
        data: Dataset,
        *,
        free: Sequence[str] | None = None,
        frames: FrameFreedom | None = None,
        noise: Noise | None = None,
        known: Mapping[str, float] | None = None,
        effects: Sequence[str] = (),
        inertia: bool = False,
    ) -> "Problem":
        """Set up the problem for some rows; further arguments as of the class.

        Args:
            free: Constants of the arm that are unknown; the robot's default ones if None.
            effects: Coefficients of the robot's effects that are unknown, such as `joint3.compliance`; the
                others keep their values.
            inertia: Whether the links' masses and centres are unknowns too, with the robot's tolerances as
                prior.
        """
        robot.check_joints(data.q, data.source)
        frames = frames or FrameFreedom()
        noise, known = noise or Noise(), dict(known or {})
        names = tuple(robot.default_free if free is None else free)
        start, facts = instrument_start(robot, data, frames)
        masses, tolerance = robot.inertia if inertia else {}, robot.inertia_tolerance
        facts |= {n: Unknown("kg" if n.endswith(".mass") else "m", sigma=tolerance[n]) for n in masses}
        has_tilts = any(tilts_beside(of_rows(data, rows), kind) for kind, rows in observed_kinds(data))
        has_loads = any(e.loads and not e.has_play for e in robot.effects)  # play needs their signs only
        free_gravity = ((bool(masses) and has_loads) or has_tilts) and np.any(robot.gravity)
        angles = dict.fromkeys(n for s in data.sessions for n in gravity_names(s, frames) if free_gravity)
        parameters = (
            *_arm_parameters(robot, names, tuple(effects)),
            *(Parameter(n, facts[n].unit, v, is_inertia=True) for n, v in masses.items()),
            *(Parameter(n, "rad", 0.0, is_inertia=not has_tilts) for n in angles),
            *frame_parameters(robot, data.sessions, frames),
            *(Parameter(n, facts[n].unit, v, is_instrument=True) for n, v in start.items() if n not in known),
        )
        problem = cls(
            robot=robot,
            data=data,
            parameters=parameters,
            noise=noise,
            frames=frames,
            blocks=build_blocks(robot, data, parameters, frames, noise, start | known),
            knowledge=np.zeros((0, len(parameters))),
            prior_centre=np.array([p.nominal for p in parameters]),
            facts=facts,
            known=known,
        )
        sigma = {name: fact.sigma for name, fact in facts.items()}
        if not frames.levelled:
            sigma |= dict.fromkeys(angles, max(robot.mounting.gravity_tolerance, MIN_DEVIATION))
        held = {p.name: (p.nominal, 1.0 / s) for p in parameters if (s := sigma.get(p.name))}
        if held:
            centre, weight = np.array([*held.values()]).T
            problem = problem.with_prior(tuple(held), centre, np.diag(weight))
        if angles and frames.levelled:
            for turning, wall in level_constraint(robot, data.sessions, frames, problem.names):
                problem = problem.with_prior(turning, np.zeros(len(turning)), wall)
        return problem

    def again(self, *, robot: Robot | None = None, data: Dataset | None = None, **choices: Any) -> "Problem":
        """The same unknowns for another arm or other rows, or with other arguments of `build`.

        Prior knowledge and weights of rows are not taken over.
        """
        own: dict[str, Any] = {"frames": self.frames, "noise": self.noise, "known": self.known}
        own["free"] = [p.name for p in self.parameters if p.is_geometry]
        own["effects"] = [p.name for p in self.parameters if p.is_coefficient]
        own["inertia"] = any(p.is_inertia and p.unit == "kg" for p in self.parameters)
        rows = self.data if data is None else data
        return Problem.build(robot or self.robot, rows, **own | choices)

    @cached_property
    def start(self) -> Float[np.ndarray, " p"]:
        return frozen(np.array([p.nominal for p in self.parameters]))

    @cached_property
    def bounds(self) -> tuple[Float[np.ndarray, " p"], Float[np.ndarray, " p"]]:
        lower, upper = np.array([p.bounds for p in self.parameters]).reshape(-1, 2).T
        return frozen(lower), frozen(upper)

    @cached_property
    def names(self) -> tuple[str, ...]:
        return tuple(p.name for p in self.parameters)

    @cached_property
    def geometry(self) -> Bool[np.ndarray, " p"]:
        """Which unknowns are constants of the arm."""
        return frozen(np.array([p.is_geometry for p in self.parameters], bool))

    def named(self, x: Float[np.ndarray, " p"]) -> dict[str, float]:
        """The unknowns at x, or their entries in x, by name."""
        return dict(zip(self.names, x.tolist(), strict=True))

    def instrument(self, x: Float[np.ndarray, " p"]) -> dict[str, float]:
        """The places of anchors, contacts or markers at x by name."""
        return {p.name: v for p, v in zip(self.parameters, x.tolist(), strict=True) if p.is_instrument}

    def at(self, found: Mapping[str, float]) -> Float[np.ndarray, " p"]:
        """Values by name where given, else those of the start."""
        return np.array([found.get(p.name, p.nominal) for p in self.parameters])

    @cached_property
    def units(self) -> Float[np.ndarray, " p"]:
        """Natural unit of each unknown, which changes the arm by 1 rad or 1 m: of constants 1 rad or 1 m; of
        coefficients the reciprocal of their law's maximum over the rows; of masses `PRIOR_UNITS` prior
        standard deviations."""
        largest: dict[str, float] = {}
        for deflected in (b.deflected for b in self.blocks if b.deflected is not None):
            for name, size in law_sizes(deflected.robot, deflected.motion, deflected.names).items():
                largest[name] = max(size, largest.get(name, 0.0))
        known = {n: PRIOR_UNITS * f.sigma if f.sigma else f.natural for n, f in self.facts.items()}
        own = (known.get(p.name) or 1.0 / (largest.get(p.name) or 1.0) for p in self.parameters)
        return frozen(np.array([*own]))

    @cached_property
    def inertia_tolerance(self) -> dict[str, float]:
        """Standard deviations of unknowns that act through loads only: masses, centres, angles of gravity."""
        angle, known = max(self.robot.mounting.gravity_tolerance, MIN_DEVIATION), self.robot.inertia_tolerance
        return {p.name: known.get(p.name, angle) for p in self.parameters if p.is_inertia}

    @property
    def size(self) -> int:
        return self.blocks[-1].stop if self.blocks else 0

    @cached_property
    def count(self) -> int:
        """Number of measured components by the shares of their rows; hidden markers have none."""
        seen = self.inverse_sigma > 0.0
        each = seen if self.shares is None else self.shares[self.component_rows][seen]
        return round(float(each.sum()))

    @cached_property
    def component_rows(self) -> np.ndarray:
        """Row of the data that each residual component belongs to."""
        return frozen(np.concatenate([np.repeat(b.rows, b.inverse_sigma.shape[1]) for b in self.blocks]))

    @cached_property
    def sees_base(self) -> bool:
        """Whether rows show where the base stands, by themselves, known places, or a rig of theirs."""
        by_itself = any(b.observation.sees_base for b in self.blocks)
        return by_itself or bool(self.known) or self.data.readings is not None

    @cached_property
    def sees_rotation(self) -> bool:
        """Whether orientations were measured, apart from additional tilts."""
        return bool(self.channels[1].any())

    @cached_property
    def channels(self) -> tuple[Bool[np.ndarray, " m"], ...]:
        """Components of position, of rotation, and of additional tilts that were measured."""
        parts = [np.tile([CHANNELS[c] for c in b.observation.channels], len(b.rows)) for b in self.blocks]
        live, kinds = self.inverse_sigma > 0.0, np.concatenate(parts)
        return tuple(live & (kinds == k) for k in range(3))

    @cached_property
    def inverse_sigma(self) -> Float[np.ndarray, " m"]:
        """Reciprocal standard deviation of each residual component [1/m or 1/rad], joint readings exact."""
        return frozen(np.concatenate([b.inverse_sigma.ravel() for b in self.blocks]))

    @cached_property
    def sigma(self) -> Float[np.ndarray, " m"]:
        """Standard deviation of each residual component [m or rad], joint readings included."""
        return frozen(np.concatenate([b.sigma.ravel() for b in self.blocks]))

    @cached_property
    def typical_noise(self) -> Noise:
        """Root mean square of all standard deviations, joint readings included; NaN for a channel without
        any."""
        return self.noise if self.data.readings is not None else self.root_mean_square(self.sigma)

    def root_mean_square(self, components: Float[np.ndarray, " m"]) -> Noise:
        """That of some residual components, per channel; NaN for a channel without any."""
        squares = (components[mine] ** 2 for mine in self.channels)
        position, rotation, tilt = (float(np.sqrt(v.mean())) if len(v) else np.nan for v in squares)
        return Noise(position, rotation, tilt=tilt)

    @cached_property
    def own_sigma(self) -> Float[np.ndarray, " m"]:
        """Standard deviation of each residual component stated by its row [m or rad]; 0 if it states none."""
        return frozen(np.concatenate([b.own_sigma.ravel() for b in self.blocks]))

    @cached_property
    def prior(self) -> Float[np.ndarray, "k p"]:
        """Whitening matrix of all that is known before: the knowledge, then the expected deviation."""
        if self.deviation is None:
            return self.knowledge
        expected = np.eye(len(self.names))[self.geometry] / self.deviation
        return frozen(np.concatenate([self.knowledge, expected]))

    def prior_at(self, x: Float[np.ndarray, " p"]) -> LinearisedProblem:
        """What follows the rows: whitened differences from what is known before, and their derivative."""
        return LinearisedProblem(-self.prior @ (x - self.prior_centre), self.prior)

    def evaluate(self, x: Float[np.ndarray, " p"]) -> LinearisedProblem:
        parts = [piece for _, piece in self.pieces(x)]
        if len(parts) == 1 and not len(self.prior):
            return parts[0]
        return LinearisedProblem(*map(np.concatenate, zip(*parts, self.prior_at(x), strict=True)))

    def pieces(
        self, x: Float[np.ndarray, " p"], *, only: Bool[np.ndarray, " p"] | None = None
    ) -> Iterator[tuple[RowBlock, LinearisedProblem]]:
        """Whitened residual and Jacobian of the rows, or some of its columns, block by block."""
        columns = None if only is None else np.where(only, np.cumsum(only) - 1, -1)
        size = len(x) if only is None else only.sum()

        def filled(block: RowBlock) -> LinearisedProblem:
            (part, twists), jacobian = block.at(x), np.zeros((block.own_sigma.size, size))
            given = block.places, block.coefficients, block.unknowns
            own, more, known = given if columns is None else (columns[mine] for mine in given)
            twists.add_derivatives(self.whiten(block, part.by_twist), jacobian, own, more)
            if len(block.unknowns):
                places = np.where(block.unknowns >= 0, known, -1)
                product = self.whiten(block, part.by_unknown).reshape(len(jacobian), -1)
                jacobian[:, places[places >= 0]] = product[:, places >= 0]
            return LinearisedProblem(self.whiten(block, part.residual).ravel(), jacobian)

        return zip(self.blocks, in_order(filled, self.blocks), strict=True)

    def cost_and_gradient(self, x: Float[np.ndarray, " p"]) -> tuple[float, Float[np.ndarray, " p"]]:
        """½|r|² and its gradient −Jᵀr without the Jacobian: each row's residual acts as a wrench."""
        cost, work = 0.0, np.zeros(len(x))
        moved = in_order(lambda block: block.at(x), self.blocks)
        for block, (part, twists) in zip(self.blocks, moved, strict=True):
            pull = self.whiten(block, part.residual)
            cost += 0.5 * float((pull**2).sum())
            wrench = (pull[:, None] @ self.whiten(block, part.by_twist))[:, 0]
            twists.pulled(wrench, work, block.places, block.coefficients)
            if len(block.unknowns):
                mine = block.unknowns >= 0
                by_unknown = np.einsum("rm,rmu->u", pull, self.whiten(block, part.by_unknown))
                np.add.at(work, block.unknowns[mine], by_unknown[mine])
        off = self.prior @ (x - self.prior_centre)
        return cost + 0.5 * float(off @ off), self.prior.T @ off - work

    def residual(self, x: Float[np.ndarray, " p"]) -> Float[np.ndarray, " m"]:
        parts = [self.whiten(block, block.residual(x)).ravel() for block in self.blocks]
        return np.concatenate([*parts, self.prior_at(x).residual])

    def physical(self, whitened: Float[np.ndarray, " _"]) -> Float[np.ndarray, " m"]:
        """Measured residual components in m and rad from whitened ones, without robust weights and prior."""
        parts = []
        for block in self.blocks:
            table = whitened[block.start : block.stop].reshape(block.inverse_sigma.shape)
            if (factors := self._factors) is not None:
                weights = factors[block.rows, None]
                table = np.where(weights > 0.0, table / np.where(weights > 0.0, weights, 1.0), 0.0)
            parts.append(block.physical(table).ravel())
        return np.concatenate(parts)

    def with_noise(self, noise: Noise) -> "Problem":
        """The same problem whitened by other standard deviations."""
        blocks = tuple(revised(b, noise=noise) for b in self.blocks)
        return self._with("inverse_sigma", "sigma", "typical_noise", noise=noise, blocks=blocks)

    def with_row_weights(self, weights: Float[np.ndarray, " rows"] | None) -> "Problem":
        """The same problem with rows weighted, as a robust loss does."""
        return self._with("_factors", row_weights=weights)

    def with_shares(self) -> "Problem":
        """The same problem with all rows of a posture counting as one: what it lacks there is the same."""
        if self.shares is not None:
            return self
        kept = vars(self.data)  # problems of the same rows have the same shares
        if "shares" not in kept:
            count = np.bincount(same := repeats(self.data))[same]
            kept["shares"] = None if count.max(initial=1) == 1 else 1.0 / count
        return self if kept["shares"] is None else self._with("_factors", "count", shares=kept["shares"])

    def with_prior(
        self, names: Sequence[str], values: Float[np.ndarray, " k"], whitening: Float[np.ndarray, "k k"]
    ) -> "Problem":
        """The same problem with further knowledge of some unknowns.

        Args:
            names: Unknowns concerned.
            values: Prior mean [rad or m].
            whitening: W, so that W (x − values) has unit variance.
        """
        if missing := [n for n in names if n not in self.names]:
            raise OptionError(f"the prior's '{missing[0]}' is not free", option="prior", found=missing[0])
        columns = [self.names.index(n) for n in names]
        wide, centre = np.zeros((len(whitening), len(self.names))), self.prior_centre.copy()
        wide[:, columns], centre[columns] = whitening, values
        knowledge = frozen(np.concatenate([self.knowledge, wide]))
        return self._with("prior", knowledge=knowledge, prior_centre=frozen(centre))

    def with_deviation(self, deviation: float | None) -> "Problem":
        """The same problem with a prior of this standard deviation about nominal on every constant [rad, m],
        or without; prior knowledge, and the mean of what it is of, are kept."""
        return self._with("prior", deviation=deviation)

    def _with(self, *stale: str, **changes: Any) -> "Problem":
        """The same problem with other fields; all that was computed is kept except what is stale."""
        computed = {n: v for n, v in vars(self).items() if n not in stale}
        changed = object.__new__(Problem)
        vars(changed).update(computed | changes)
        return changed

    def robot_at(self, x: Float[np.ndarray, " p"]) -> Robot:
        """The robot with the unknowns set, its session frames included."""
        values = {p.name: v for p, v in zip(self.parameters, x.tolist(), strict=True) if not p.is_instrument}
        return moved_robot(self.robot, self.frames, self.data.sessions, values)

    def whiten(
        self, block: RowBlock, table: Float[np.ndarray, "rows m ..."]
    ) -> Float[np.ndarray, "rows m ..."]:
        """Residual components of a block, or their derivatives, whitened and weighted like its rows."""
        out = block.whiten(table)
        if (factors := self._factors) is not None:
            out *= factors[block.rows].reshape(-1, *(1,) * (table.ndim - 1))
        return out

    @cached_property
    def _factors(self) -> Float[np.ndarray, " rows"] | None:
        """Factors of each row's residuals: its weight, and the root of its share."""
        if self.shares is None:
            return self.row_weights
        return np.sqrt(self.shares) * (1.0 if self.row_weights is None else self.row_weights)


@lru_cache(maxsize=8)
def _arm_parameters(robot: Robot, names: tuple[str, ...], effects: tuple[str, ...]) -> list[Parameter]:
    """Constants and coefficients of effects by name; kept for the next problem."""
    arm = {e.name: e for e in robot.elements}
    units, sizes = robot.coefficient_units, robot.coefficients
    shown = [n for n in arm if arm[n].matrix is None]
    for option, what, wanted, known, listed in (
        ("free", "constant", names, arm, shown),
        ("effects", "effect with the coefficient", effects, sizes, sizes),
    ):
        if missing := [n for n in wanted if n not in known]:
            has = f"has no {what} '{missing[0]}' to free; it has {', '.join(listed) or 'no effects'}"
            raise OptionError(f"robot '{robot.name}' {has}", option=option, found=missing[0])
    return [
        *(Parameter(n, arm[n].unit, arm[n].value) for n in names),
        *(Parameter(n, units[n], sizes[n], is_coefficient=True) for n in effects),
    ]
