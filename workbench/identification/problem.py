"""One problem for all identifications: whitened residuals and their derivative in the unknowns.

Rows are split into blocks that share a session and an observation. In every block the chain is evaluated
once; its twists times the observation's derivative give the block's part of the identification Jacobian.
Unknowns x are absolute values [rad or m]: constants of the arm, coefficients of its effects [SI], constants
of the frames (per session where they differ), and of the instrument (anchors, contacts, markers).
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from workbench.arm.parameters import Parameter
from workbench.arm.robot import Robot, SessionFrames
from workbench.arm.statics.deflection import law_sizes
from workbench.base.errors import OptionError
from workbench.base.threads import in_order
from workbench.base.types import frozen
from workbench.data.dataset import Dataset
from workbench.data.observations import Unknown
from workbench.identification.problem_blocks import (
    Block,
    FrameFreedom,
    Noise,
    add_products,
    build_blocks,
    frame_parameters,
    instrument_start,
    moved_frame,
    observed_kinds,
    own_sigma_of,
)

WELL_KNOWN = 10.0
"""Standard deviations of prior knowledge that count as one natural unit, so that it is always seen."""


class Evaluation(NamedTuple):
    """A problem at one x.

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
        noise: Standard deviations on top of those that rows bring themselves.
        frames: What of base and tool is unknown.
        bounded: Unknowns whose bounds the user gave.
        prior: Whitening matrix W of prior knowledge: W (x − centre) joins the residuals.
        prior_centre: Where that knowledge says the unknowns are.
        deviation: How far the arm's constants are expected from nominal [rad, m]; the last rows of `prior`.
        row_weights: Factors of each row's residuals, from a robust loss.
        facts: What is known of the instrument's unknowns.
        known: Values of the instrument's unknowns that are known, such as `anchor[A].x` [m].
    """

    robot: Robot
    data: Dataset
    parameters: tuple[Parameter, ...]
    noise: Noise
    frames: FrameFreedom
    blocks: tuple[Block, ...]
    bounded: frozenset[str] = frozenset()
    prior: Float[np.ndarray, "k p"] | None = None
    prior_centre: Float[np.ndarray, " p"] | None = None
    deviation: float | None = None
    row_weights: Float[np.ndarray, " rows"] | None = None
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
        bounds: Mapping[str, tuple[float, float]] | None = None,
        known: Mapping[str, float] | None = None,
        effects: Sequence[str] = (),
        inertia: bool = False,
    ) -> "Problem":
        """Set up the problem of some rows.

        Args:
            robot: Nominal arm; its session frames are where the search begins.
            free: Constants of the arm that are unknown; the robot's default ones if None.
            frames: What of base and tool is unknown; nothing if None.
            noise: Standard deviations [m], [rad] on top of those that rows bring themselves.
            bounds: Least and greatest value by name, for bounded algorithms.
            known: Values of the instrument's unknowns that are known, such as `anchor[A].x` [m].
            effects: Coefficients of the robot's effects that are unknown, such as `joint3.compliance`; the
                others act as they are.
            inertia: Whether the links' masses and centres are unknowns too, known as well as the robot says.

        Raises:
            DataError: a row carries nothing that can be compared with a pose, or not what drives an effect.
            OptionError: free, effects or bounds name what the robot does not have.
        """
        robot.check_joints(data.q, data.source)
        frames = frames or FrameFreedom()
        noise, known = noise or Noise(), dict(known or {})
        names = tuple(robot.default_free if free is None else free)
        arm = {e.name: e for e in robot.elements}
        if missing := [n for n in names if n not in arm]:
            raise OptionError(
                f"robot '{robot.name}' has no constant '{missing[0]}' to free; it has "
                f"{', '.join(n for n in arm if arm[n].matrix is None)}"
            )
        if missing := [n for n in effects if n not in robot.coefficients]:
            raise OptionError(
                f"robot '{robot.name}' has no effect with the coefficient '{missing[0]}' to free; it has "
                f"{', '.join(robot.coefficients) or 'no effects'}"
            )
        kinds = observed_kinds(data)
        parameters = [Parameter.bounded(n, arm[n].unit, arm[n].value, bounds) for n in names]
        units, sizes = robot.coefficient_units, robot.coefficients
        parameters += [Parameter.bounded(n, units[n], sizes[n], bounds, is_coefficient=True) for n in effects]
        weighing = tuple(robot.inertia) if inertia else ()
        parameters += [
            Parameter(n, "kg" if n.endswith(".mass") else "m", robot.inertia[n], is_inertia=True)
            for n in weighing
        ]
        parameters += frame_parameters(robot, data.sessions, frames, bounds)
        unknown_start, facts = instrument_start(robot, data, kinds, frames)
        parameters += [
            Parameter.bounded(n, facts[n].unit, v, bounds) for n, v in unknown_start.items() if n not in known
        ]
        if bounds and (stray := set(bounds) - {p.name for p in parameters}):
            raise OptionError(f"bounds name '{sorted(stray)[0]}', which is not identified here")
        index = {p.name: i for i, p in enumerate(parameters)}
        values = unknown_start | known
        blocks = build_blocks(robot, data, kinds, names, effects, weighing, frames, noise, index, values)
        problem = cls(
            robot=robot,
            data=data,
            parameters=tuple(parameters),
            noise=noise,
            frames=frames,
            blocks=blocks,
            bounded=frozenset(bounds or ()),
            facts=facts,
            known=known,
        )
        spread = {n: robot.inertia_tolerance[n] for n in weighing}
        spread |= {p.name: s for p in parameters if (s := facts.get(p.name, Unknown()).sigma)}
        centre = np.array([(robot.inertia | unknown_start)[n] for n in spread])
        width = np.diag(1.0 / np.array(list(spread.values())))
        return problem.with_prior(tuple(spread), centre, width) if spread else problem

    def again(self, *, robot: Robot | None = None, data: Dataset | None = None, **choices: Any) -> "Problem":
        """The same unknowns for another arm or other rows, or with other arguments of `build`.

        Bounds, prior knowledge and weights of rows are not taken over.
        """
        own: dict[str, Any] = {
            "free": [p.name for p in self.parameters if p.is_geometry],
            "frames": self.frames,
            "noise": self.noise,
            "known": self.known,
            "effects": [p.name for p in self.parameters if p.is_coefficient],
            "inertia": any(p.is_inertia for p in self.parameters),
        }
        rows = self.data if data is None else data
        return Problem.build(robot or self.robot, rows, **own | choices)

    @cached_property
    def start(self) -> Float[np.ndarray, " p"]:
        """Nominal values, where every search begins."""
        return frozen(np.array([p.nominal for p in self.parameters]))

    @cached_property
    def bounds(self) -> tuple[Float[np.ndarray, " p"], Float[np.ndarray, " p"]]:
        """Least and greatest values."""
        return (
            frozen(np.array([p.lower for p in self.parameters])),
            frozen(np.array([p.upper for p in self.parameters])),
        )

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the unknowns, in the order of x."""
        return tuple(p.name for p in self.parameters)

    def named(self, x: Float[np.ndarray, " p"]) -> dict[str, float]:
        """The unknowns at x, or what x holds of each of them, by name."""
        return dict(zip(self.names, x.tolist(), strict=True))

    def instrument(self, x: Float[np.ndarray, " p"]) -> dict[str, float]:
        """The places of anchors, contacts, markers or cameras at x by name."""
        values = self.named(x)
        return {p.name: values[p.name] for p in self.parameters if p.is_instrument}

    def at(self, found: Mapping[str, float]) -> Float[np.ndarray, " p"]:
        """The unknowns where they were found, else where the search begins."""
        return np.array([found.get(p.name, p.nominal) for p in self.parameters])

    @cached_property
    def units(self) -> Float[np.ndarray, " p"]:
        """What of each unknown changes the arm by 1 rad or 1 m: itself, or for a coefficient of an effect the
        reciprocal of its law's largest value over the rows [unit of the unknown]. Of masses, which are known
        beforehand, it is `WELL_KNOWN` of their standard deviations."""
        largest: dict[str, float] = {}
        for bent in (b.bent for b in self.blocks if b.bent is not None):
            for name, size in law_sizes(bent.robot, bent.motion, bent.names).items():
                largest[name] = max(size, largest.get(name, 0.0))
        known = {n: WELL_KNOWN * s for n, s in self.robot.inertia_tolerance.items()}
        known |= {
            n: WELL_KNOWN * fact.sigma if fact.sigma else fact.natural for n, fact in self.facts.items()
        }
        return frozen(
            np.array([known.get(p.name) or 1.0 / (largest.get(p.name) or 1.0) for p in self.parameters])
        )

    @property
    def size(self) -> int:
        """Number of measured residual components."""
        return self.blocks[-1].stop if self.blocks else 0

    @cached_property
    def count(self) -> int:
        """Number of components that were measured; those of hidden markers were not."""
        return int((self.inverse_sigma > 0.0).sum())

    @cached_property
    def component_rows(self) -> np.ndarray:
        """Row of the data that each residual component belongs to."""
        return frozen(np.concatenate([np.repeat(b.rows, b.inverse_sigma.shape[1]) for b in self.blocks]))

    @cached_property
    def component_channels(self) -> np.ndarray:
        """True for rotation components, false for positions."""
        return frozen(np.concatenate([np.tile(b.observation.is_rotation, len(b.rows)) for b in self.blocks]))

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
        """Root mean square of all standard deviations, rows' own and joint readings' included; NaN for a
        channel without any."""
        if self.data.rig is not None:
            return self.noise
        live, turned = self.inverse_sigma > 0.0, self.component_channels
        variances = [self.sigma[live & mine] ** 2 for mine in (~turned, turned)]
        position, rotation = (float(np.sqrt(v.mean())) if len(v) else np.nan for v in variances)
        return Noise(position, rotation)

    @cached_property
    def own_sigma(self) -> Float[np.ndarray, " m"]:
        """Standard deviation of each residual component that its row brings itself [m or rad]; 0 for none."""
        own = [own_sigma_of(self.data.take(b.rows), b.observation) for b in self.blocks]
        return frozen(np.concatenate([o.ravel() for o in own]))

    def evaluate(self, x: Float[np.ndarray, " p"]) -> Evaluation:
        """Whitened residual and Jacobian."""
        extra = 0 if self.prior is None else len(self.prior)
        residual = np.empty(self.size + extra)
        jacobian = np.zeros((self.size + extra, len(x)))
        for block in self.blocks:
            rows = slice(block.start, block.stop)
            self._fill(block, x, residual[rows], jacobian[rows])
        if self.prior is not None:
            residual[self.size :] = -self.prior @ (x - self.prior_centre)
            jacobian[self.size :] = self.prior
        return Evaluation(residual, jacobian)

    def pieces(self, x: Float[np.ndarray, " p"]) -> Iterator[tuple[Block | None, Evaluation]]:
        """Whitened residual and Jacobian block by block, the prior's last, so that no large matrix stands."""

        def filled(block: Block) -> Evaluation:
            rows = block.stop - block.start
            piece = Evaluation(np.empty(rows), np.zeros((rows, len(x))))
            self._fill(block, x, *piece)
            return piece

        yield from zip(self.blocks, in_order(filled, self.blocks), strict=True)
        if self.prior is not None:
            yield None, Evaluation(-self.prior @ (x - self.prior_centre), self.prior)

    def _fill(self, block: Block, x: np.ndarray, residual: np.ndarray, jacobian: np.ndarray) -> None:
        poses, twists = block.twists(x)
        part = block.observation.see(poses, self.unknown(block, x))
        residual[:] = self.whiten(block, part.residual).ravel()
        add_products(self.whiten(block, part.by_twist), twists, block.places, jacobian)
        if len(block.unknowns):
            mine = block.unknowns >= 0
            product = self.whiten(block, part.by_unknown).reshape(len(residual), -1)
            jacobian[:, block.unknowns[mine]] = product[:, mine]

    def cost_and_gradient(self, x: Float[np.ndarray, " p"]) -> tuple[float, Float[np.ndarray, " p"]]:
        """½|r|² and its gradient −Jᵀr, without the Jacobian: each row's residual acts as a wrench."""
        cost, gradient = 0.0, np.zeros(len(x))
        moved = in_order(lambda block: block.twists(x), self.blocks)
        for block, (poses, twists) in zip(self.blocks, moved, strict=True):
            part = block.observation.see(poses, self.unknown(block, x))
            pull = self.whiten(block, part.residual)
            cost += 0.5 * float((pull**2).sum())
            wrench = (pull[:, None] @ self.whiten(block, part.by_twist))[:, 0]
            gradient[block.places] -= wrench.ravel() @ twists.reshape(wrench.size, len(block.places))
            if len(block.unknowns):
                mine = block.unknowns >= 0
                by_unknown = np.einsum("rm,rmu->u", pull, self.whiten(block, part.by_unknown))
                np.subtract.at(gradient, block.unknowns[mine], by_unknown[mine])
        if self.prior is not None:
            off = self.prior @ (x - self.prior_centre)
            cost += 0.5 * float(off @ off)
            gradient += self.prior.T @ off
        return cost, gradient

    def residual(self, x: Float[np.ndarray, " p"]) -> Float[np.ndarray, " m"]:
        """Whitened residual alone."""
        parts = []
        for block in self.blocks:
            part = block.observation.see(block.poses(x), self.unknown(block, x))
            parts.append(self.whiten(block, part.residual).ravel())
        if self.prior is not None:
            parts.append(-self.prior @ (x - self.prior_centre))
        return np.concatenate(parts)

    def jacobian(self, x: Float[np.ndarray, " p"]) -> Float[np.ndarray, "m p"]:
        """Whitened identification Jacobian alone."""
        return self.evaluate(x).jacobian

    def physical(self, whitened: Float[np.ndarray, " _"]) -> Float[np.ndarray, " m"]:
        """Measured residual components in m and rad from whitened ones; without robust weights or prior."""
        parts = []
        for block in self.blocks:
            table = whitened[block.start : block.stop].reshape(block.inverse_sigma.shape)
            if self.row_weights is not None:
                weights = self.row_weights[block.rows, None]
                table = np.where(weights > 0.0, table / np.where(weights > 0.0, weights, 1.0), 0.0)
            parts.append(block.physical(table).ravel())
        return np.concatenate(parts)

    def with_noise(self, noise: Noise) -> "Problem":
        """The same problem whitened by other standard deviations."""
        blocks = tuple(b.with_noise(self.data.take(b.rows), noise) for b in self.blocks)
        return replace(self, noise=noise, blocks=blocks)

    def with_row_weights(self, weights: Float[np.ndarray, " rows"] | None) -> "Problem":
        """The same problem with rows weighted, as a robust loss does."""
        return replace(self, row_weights=weights)

    def with_prior(
        self, names: Sequence[str], values: Float[np.ndarray, " k"], whitening: Float[np.ndarray, "k k"]
    ) -> "Problem":
        """The same problem with knowledge of some unknowns, beside what it knows of others already.

        Args:
            names: Unknowns that it speaks of.
            values: What they were found to be [rad or m].
            whitening: W, so that W (x − values) has unit variance.
        """
        if missing := [n for n in names if n not in self.names]:
            raise OptionError(f"the prior speaks of '{missing[0]}', which is not identified here")
        columns = [self.names.index(n) for n in names]
        own = self.without_deviation()
        wide, centre = np.zeros((len(whitening), len(self.names))), self.start.copy()
        if own.prior is not None and own.prior_centre is not None:
            wide, centre = np.concatenate([own.prior, wide]), own.prior_centre.copy()
        wide[-len(whitening) :, columns], centre[columns] = whitening, values
        known = replace(own, prior=frozen(wide), prior_centre=frozen(centre))
        return known if self.deviation is None else known.with_deviation(self.deviation)

    def with_deviation(self, deviation: float) -> "Problem":
        """The same problem with every constant of the arm expected this close to nominal [rad, m].

        Constants that it knows already are expected where that knowledge has them.
        """
        own = self.without_deviation()
        names = [p.name for p in self.parameters if p.is_geometry]
        centre = own.start if own.prior_centre is None else own.prior_centre
        at = dict(zip(own.names, centre.tolist(), strict=True))
        wall = np.eye(len(names)) / deviation
        return replace(own.with_prior(names, np.array([at[n] for n in names]), wall), deviation=deviation)

    def without_deviation(self) -> "Problem":
        """The same problem with nothing expected of the constants but what is known of them."""
        if self.deviation is None or self.prior is None:
            return self
        known = self.prior[: -sum(p.is_geometry for p in self.parameters)]
        if not len(known):
            return replace(self, prior=None, prior_centre=None, deviation=None)
        return replace(self, prior=known, deviation=None)

    def robot_at(self, x: Float[np.ndarray, " p"]) -> Robot:
        """The robot with the unknowns set, its session frames included."""
        pairs = zip(self.parameters, x.tolist(), strict=True)
        values = {p.name: value for p, value in pairs if not p.is_instrument}
        arm = {n: v for n, v in values.items() if "[" not in n}
        robot = self.robot.with_values(arm)
        freedom = self.frames
        if not (freedom.base_per_session or freedom.tool_per_session or self.robot.sessions):
            return robot
        names = dict.fromkeys([*(s.name for s in self.robot.sessions), *self.data.sessions])
        sessions = []
        for name in names:
            old = freedom.session_frames(self.robot, name)
            base, tool = old.base, old.tool
            if freedom.base:
                base = moved_frame(base, "base", name, values) if freedom.base_per_session else robot.base
            if freedom.tool:
                tool = moved_frame(tool, "tool", name, values) if freedom.tool_per_session else robot.tool
            sessions.append(SessionFrames(name, base, tool))
        return replace(robot, sessions=tuple(sessions))

    def unknown(self, block: Block, x: np.ndarray) -> np.ndarray:
        """Values of a block's instrument unknowns at x."""
        values = block.known.copy()
        mine = block.unknowns >= 0
        values[mine] = x[block.unknowns[mine]]
        return values

    def whiten(self, block: Block, table: Float[np.ndarray, "rows m ..."]) -> Float[np.ndarray, "rows m ..."]:
        """A block's residual components, or derivatives of them, whitened and weighed as its rows are."""
        out = block.whiten(table)
        if self.row_weights is not None:
            out *= self.row_weights[block.rows].reshape(-1, *(1,) * (table.ndim - 1))
        return out
