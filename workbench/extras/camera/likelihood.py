"""One likelihood of pictures: corner noise, what the arm's model lacks, and how far what is given may be off.

What the model lacks moves all corners of a picture together. With B the derivative of these corners by the
tool's twist, their residuals have the covariance

    V = σ² I + B D Bᵀ,      D = diag(s_p², s_p², s_p², s_r², s_r², s_r²)

with σ in px, s_p in m and s_r in rad. Without the second part 40 corners would count as 80 independent
numbers. Groups of unknowns (joint zeros, geometry, intrinsics, size) scatter about what is given by a width τ
each. All are those of maximum restricted likelihood, the unknowns averaged out,

    min  Σ log|V| + log|H| − log|P| + rᵀV⁻¹r + dᵀP d − gᵀH⁻¹g,      H = JᵀV⁻¹J + P,   g = JᵀV⁻¹r − P d

linearised at a fit's answer: r and J its residuals and Jacobian, P and d the prior's information and pull.
A group is let go if that is far likelier than τ → 0: its evidence is the difference.

Source: Patterson, Thompson, Recovery of inter-block information when block sizes are unequal, Biometrika 58,
1971.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from workbench.identification.problem import Noise, Problem

MIN_SIZE, MAX_SIZE = np.array([0.01, 1e-7, 1e-7, 1e-7]), np.array([50.0, 0.05, 0.2, 0.02])
"""Bounds of σ [px], s_p [m], s_r [rad] and every τ [m]."""
FIRST, UNCALIBRATED = np.array([0.5, 3e-4, 3e-4, 3e-4]), np.array([0.5, 2e-3, 2e-3, 3e-4])
"""Sizes from which the likeliest are sought: those of an arm that is calibrated, and of one that is not."""
GRID = np.geomspace(5e-6, 5e-3, 9)
"""Values [m] over which the likelihood of a size is averaged."""
FAR = 10.0
"""Standard deviation of unknowns without any knowledge [natural units], so that H can be inverted."""
WIDTH, NOISE = 3, ("own", "position", "rotation")
"""Place of the first τ among the sizes, and names of those before it."""


@dataclass(frozen=True, eq=False)
class Pictures:
    """What the likelihood needs of every picture, whatever the sizes are.

    Args:
        count: Numbers that were measured.
        square: rᵀr.
        pull: Bᵀr.
        normal: BᵀB.
        cross: BᵀJ.
        information: JᵀJ of all pictures.
        gradient: Jᵀr of all pictures.
    """

    count: Float[np.ndarray, " rows"]
    square: Float[np.ndarray, " rows"]
    pull: Float[np.ndarray, "rows 6"]
    normal: Float[np.ndarray, "rows 6 6"]
    cross: Float[np.ndarray, "rows 6 p"]
    information: Float[np.ndarray, "p p"]
    gradient: Float[np.ndarray, " p"]

    @classmethod
    def of(
        cls, residual: np.ndarray, by_twist: np.ndarray, seen: np.ndarray, jacobian: np.ndarray
    ) -> "Pictures":
        """Sums over each row's components [px]; jacobian (rows, m, p)."""
        swapped, count = np.swapaxes(by_twist, 1, 2), seen.sum(1).astype(float)
        flat, pull = jacobian.reshape(residual.size, jacobian.shape[2]), swapped @ residual[..., None]
        of_rows = count, (residual**2).sum(1), pull[..., 0], swapped @ by_twist, swapped @ jacobian
        return cls(*of_rows, flat.T @ flat, flat.T @ residual.ravel())

    @classmethod
    def at(cls, problem: Problem, x: Float[np.ndarray, " p"]) -> "Pictures":
        """Those of a problem's residuals at x."""
        plain = problem.with_noise(Noise(0.0, 0.0, (), 1.0)).with_row_weights(None)
        parts = []
        for block, piece in plain.pieces(x):
            shape = block.inverse_sigma.shape
            by_twist = block.observation.linearise(block.poses(x), block.unknown(x)).by_twist
            jacobian = piece.jacobian.reshape(*shape, -1)
            parts.append(cls.of(piece.residual.reshape(shape), by_twist, block.inverse_sigma > 0.0, jacobian))
        columns = [[getattr(p, f.name) for p in parts] for f in fields(cls)]
        return cls(*map(np.concatenate, columns[:5]), *(np.sum(column, axis=0) for column in columns[5:]))

    def pixel(self, step: Float[np.ndarray, " p"]) -> float:
        """Error of corners that a step of the unknowns leaves [px, root mean square distance]."""
        square = self.square.sum() + step @ (self.information @ step - 2.0 * self.gradient)
        return float(np.sqrt(2.0 * square / self.count.sum()))

    @property
    def off(self) -> Float[np.ndarray, " rows"]:
        """How far every picture's corners are off where the target is [m, root mean square]."""
        slope = np.einsum("rii->r", self.normal[:, :3, :3])
        return np.sqrt(2.0 * self.square / np.maximum(slope, 1e-12))

    def compressed(self, sizes: Float[np.ndarray, " k"]) -> tuple[Float[np.ndarray, "rows 6 6"], float]:
        """C with V⁻¹ = (I − B C Bᵀ)/σ² for every picture, and Σ log|V|."""
        size = np.repeat(sizes[1:3], 3) / sizes[0]
        k = np.eye(6) + size[:, None] * self.normal * size
        c = size[:, None] * np.linalg.inv(k) * size
        return c, float(2.0 * self.count.sum() * np.log(sizes[0]) + np.linalg.slogdet(k)[1].sum())

    def tool_errors(self, sizes: Float[np.ndarray, " k"]) -> Float[np.ndarray, "2 rows"]:
        """Expected error of the tool [m], [rad] in every picture, given its residuals."""
        c, _ = self.compressed(sizes)
        twist = (c @ self.pull[..., None])[..., 0]
        square = twist**2 + sizes[0] ** 2 * np.einsum("rii->ri", c)
        return np.sqrt(square.reshape(-1, 2, 3).sum(2)).T


class Likeliest(NamedTuple):
    """The likeliest sizes.

    Args:
        sizes: σ [px], s_p [m], s_r [rad], and τ of each group.
        cost: Twice the negative log likelihood.
        x: The unknowns that they lead to, by the linearised problem …
        covariance: … and theirs.
        pixel: Error of corners that these leave [px, root mean square distance].
    """

    sizes: Float[np.ndarray, " k"]
    cost: float
    x: Float[np.ndarray, " p"]
    covariance: Float[np.ndarray, "p p"]
    pixel: float

    @property
    def noise(self) -> Noise:
        """σ, s_p and s_r; 0 for what the pictures do not show."""
        own, position, rotation = np.where(self.sizes[:3] < 2.0 * MIN_SIZE[:3], 0.0, self.sizes[:3]).tolist()
        return Noise(position, rotation, (), max(own, MIN_SIZE[0]))


@dataclass(frozen=True, eq=False)
class Likelihood:
    """Restricted likelihood at a fit's answer.

    Args:
        pictures: Sums there.
        x: The answer.
        off: x less what is given.
        information: P without the groups'.
        pull: P d of it.
        groups: By name, of each unknown of a group its standard deviation for τ = 1; 0 of the others.
    """

    pictures: Pictures
    x: Float[np.ndarray, " p"]
    off: Float[np.ndarray, " p"]
    information: Float[np.ndarray, "p p"]
    pull: Float[np.ndarray, " p"]
    groups: Mapping[str, Float[np.ndarray, " p"]] = field(default_factory=dict)

    @classmethod
    def at(cls, problem: Problem, x: Float[np.ndarray, " p"], **groups: np.ndarray) -> "Likelihood":
        """Of a problem without prior knowledge of the groups."""
        own = problem.prior.T @ problem.prior
        known, pull = own + np.diag((FAR * problem.units) ** -2), own @ (x - problem.prior_centre)
        return cls(Pictures.at(problem, x), x, x - problem.start, known, pull, groups)

    def likeliest(self, **pinned: float) -> Likeliest:
        """The likeliest sizes; widths of groups may be pinned: τ → 0 holds a group, inf lets it go."""
        found = [self._sought(pinned, begin) for begin in (FIRST, UNCALIBRATED)]
        sizes = min(found, key=lambda each: each[1])[0]
        value, step, covariance, _ = self.cost(sizes)
        return Likeliest(sizes, value, self.x + step, covariance, self.pictures.pixel(step))

    def _sought(self, pinned: Mapping[str, float], begin: np.ndarray) -> tuple[np.ndarray, float]:
        """The likeliest sizes from those where the search begins, and their cost."""
        from scipy.optimize import minimize  # which takes a moment, and no other rows need it

        names = (*NOISE, *self.groups)
        rest = [k for k, name in enumerate(names) if name not in pinned]
        sizes = np.array([pinned.get(name, 1.0) for name in names])
        each = 3 * len(self.pictures.count)
        numbers = [self.pictures.count.sum(), each, each, *map(np.count_nonzero, self.groups.values())]
        scale = np.sqrt(np.maximum(numbers, 1)[rest])  # about how well each logarithm is known

        def cost(logs: np.ndarray) -> tuple[float, np.ndarray]:
            sizes[rest] = np.exp(logs / scale)
            value, *_, slope = self.cost(sizes)
            return value, slope[rest] / scale

        start, *bounds = scale * np.log(np.array([begin, MIN_SIZE, MAX_SIZE])[:, np.minimum(rest, WIDTH)])
        walls = np.transpose(bounds)
        found = minimize(cost, start, jac=True, method="L-BFGS-B", bounds=walls, options={"ftol": 1e-7})
        sizes[rest] = np.exp(found.x / scale)
        return sizes, float(found.fun)

    def mean(self, name: str, **pinned: float) -> float:
        """Root mean square of a size over its likelihood, every size alike likely beforehand.

        Few pictures leave a size open by a factor of two or three: the likeliest one alone would promise too
        much.

        Source: Gelman, Prior distributions for variance parameters in hierarchical models, Bayesian Analysis
        1, 2006.
        """
        costs = np.array([self._sought({**pinned, name: size}, UNCALIBRATED)[1] for size in GRID])
        return float(np.sqrt(np.average(GRID**2, weights=GRID * np.exp(-0.5 * (costs - costs.min())))))

    def cost(self, sizes: Float[np.ndarray, " k"]) -> tuple[float, np.ndarray, np.ndarray, np.ndarray]:
        """Twice the negative log likelihood, H⁻¹g, H⁻¹, and its slope by the logarithms of the sizes.

        With S = diag(s)/σ, C = (S⁻² + BᵀB)⁻¹; what is left, e = r − J H⁻¹g, makes the slope by D's parts

            2 Σ (rows − Σ (σ² C + C Bᵀ(e eᵀ + J H⁻¹Jᵀ)B C) / s²)    over their diagonals.
        """
        pictures = self.pictures
        c, log_v = pictures.compressed(sizes)
        mixed, weigh = c @ pictures.cross, 1.0 / sizes[0] ** 2
        measured = weigh * (pictures.information - np.tensordot(pictures.cross, mixed, ([0, 1], [0, 1])))
        g = weigh * (pictures.gradient - np.tensordot(mixed, pictures.pull, ([0, 1], [0, 1]))) - self.pull
        shares = np.reshape([*self.groups.values()], (len(self.groups), len(self.x)))  # added to P's diagonal
        with np.errstate(divide="ignore", invalid="ignore"):
            precision = np.where(shares > 0.0, (shares * sizes[WIDTH:, None]) ** -2.0, 0.0)
        whole = precision.sum(0)
        p = self.information + np.diag(whole)
        h, g = measured + p, g - whole * self.off
        scale = 1.0 / np.sqrt(np.maximum(np.diag(h), np.diag(p)))  # rounding may leave less
        scaled = scale[:, None] * h * scale
        inverse = scale[:, None] * np.linalg.inv(scaled) * scale
        step = inverse @ g
        square = float(pictures.square.sum() - np.einsum("ri,rij,rj->", pictures.pull, c, pictures.pull))
        log_h = np.linalg.slogdet(scaled)[1] - 2.0 * np.log(scale).sum() - np.linalg.slogdet(p)[1]
        cost = log_v + log_h + weigh * square + float(whole @ self.off**2) - float(g @ step)
        spread = inverse + np.outer(step, step)
        left = pictures.square.sum() - 2.0 * step @ pictures.gradient + (spread * pictures.information).sum()
        pull = pictures.pull - pictures.cross @ step
        seen = pull[:, :, None] * pull[:, None] + pictures.cross @ inverse @ np.swapaxes(pictures.cross, 1, 2)
        lack = np.repeat(sizes[1:3], 3) ** -2.0
        kept = sizes[0] ** 2 * lack * np.einsum("rii->i", c)
        taken = lack * np.einsum("rii->i", c @ seen @ c)
        left -= np.einsum("rij,rji->", c, seen) + sizes[0] ** 2 * taken.sum()
        noise = pictures.count.sum() - (len(c) - kept).sum() - weigh * left
        lacks = (len(c) - kept - taken).reshape(2, 3).sum(1)
        widths = precision @ (np.diag(inverse - np.linalg.inv(p)) + (self.off + step) ** 2)
        return cost, step, inverse, 2.0 * np.concatenate([[noise], lacks, -widths])
