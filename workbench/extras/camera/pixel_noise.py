"""Maximum-likelihood variances of corner noise and of the tool-pose error in every picture.

What an arm's model lacks moves all corners of a picture together. With B the derivative of these corners by
the tool's twist, their residuals have the covariance

    V = σ² I + B D Bᵀ,      D = diag(s_p², s_p², s_p², s_r², s_r², s_r²)

with σ in px, s_p in m and s_r in rad. Without the second part 40 corners would count as 80 independent
numbers, and every standard error would be several times too small. The variances, and the width τ of prior
knowledge of the arm's geometry where it is identified, are those of maximum restricted likelihood,

    min  Σ log|V| + log|H| − log|P| + rᵀV⁻¹r + dᵀP d − gᵀH⁻¹g,      H = JᵀV⁻¹J + P,   g = JᵀV⁻¹r − P d

linearised at a fit's answer: r and J its residuals and Jacobian, P and d the prior's information and pull.

Source: Patterson, Thompson, Recovery of inter-block information when block sizes are unequal, Biometrika 58,
1971.
"""

from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float
from scipy import optimize

from workbench.identification.problem import Noise, Problem

MIN_SIZE, MAX_SIZE = np.array([0.01, 1e-7, 1e-7, 1e-7]), np.array([50.0, 0.05, 0.2, 0.02])
"""Bounds of σ [px], s_p [m], s_r [rad] and τ [m]."""
SHOWN = 6.0
"""Twice the gain in log likelihood from which on what a picture shares is no chance (χ² of two, 95 %)."""
WIDTHS = np.geomspace(5e-6, 5e-3, 13)
"""Values of τ [m] over which its likelihood is averaged."""
UNCALIBRATED = 1e-3
"""What an arm lacks that isn't calibrated [m], [rad]: from there its variances are sought as well."""
FAR = 10.0
"""Standard deviation of unknowns without any knowledge [natural units], so that H can be inverted."""


@dataclass(frozen=True, eq=False)
class Pictures:
    """What the likelihood needs of every picture, whatever the variances are.

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
        swapped = np.swapaxes(by_twist, 1, 2)
        flat = jacobian.reshape(residual.size, jacobian.shape[2])
        return cls(
            seen.sum(1).astype(float),
            (residual**2).sum(1),
            (swapped @ residual[..., None])[..., 0],
            swapped @ by_twist,
            swapped @ jacobian,
            flat.T @ flat,
            flat.T @ residual.ravel(),
        )

    @classmethod
    def at(cls, problem: Problem, x: Float[np.ndarray, " p"]) -> "Pictures":
        """Those of a problem's residuals at x."""
        plain = problem.with_noise(Noise(0.0, 0.0, (), 1.0)).with_row_weights(None)
        parts = []
        for block, piece in plain.pieces(x):
            if block is None:
                continue
            shape = block.inverse_sigma.shape
            by_twist = block.observation.linearise(block.poses(x), plain.unknown(block, x)).by_twist
            parts.append(
                cls.of(
                    piece.residual.reshape(shape),
                    by_twist,
                    block.inverse_sigma > 0.0,
                    piece.jacobian.reshape(*shape, -1),
                )
            )
        columns = [[getattr(p, f.name) for p in parts] for f in fields(cls)]
        sums = np.sum(columns[5], axis=0), np.sum(columns[6], axis=0)
        count, square, pull, normal, cross = (np.concatenate(column) for column in columns[:5])
        return cls(count, square, pull, normal, cross, *sums)

    @property
    def lever(self) -> float:
        """Distance [m] at which a turn of the tool moves corners as much as a shift of it does."""
        shift, turn = (np.einsum("rii->", self.normal[:, k, k]) for k in (slice(0, 3), slice(3, 6)))
        return float(np.sqrt(turn / max(shift, 1e-12)))

    def compressed(self, noise: Noise) -> tuple[Float[np.ndarray, "rows 6 6"], float]:
        """C with V⁻¹ = (I − B C Bᵀ)/σ² for every picture, and Σ log|V|."""
        size = np.repeat([noise.position, noise.rotation], 3) / noise.own
        k = np.eye(6) + size[:, None] * self.normal * size
        c = size[:, None] * np.linalg.inv(k) * size
        return c, float(2.0 * self.count.sum() * np.log(noise.own) + np.linalg.slogdet(k)[1].sum())

    def errors(self, noise: Noise) -> tuple[Float[np.ndarray, " rows"], Float[np.ndarray, " rows"]]:
        """Expected error of the tool [m], [rad] in every picture, given its residuals."""
        c, _ = self.compressed(noise)
        twist = (c @ self.pull[..., None])[..., 0]
        square = twist**2 + noise.own**2 * np.einsum("rii->ri", c)
        return np.sqrt(square[:, :3].sum(1)), np.sqrt(square[:, 3:].sum(1))


class Variances(NamedTuple):
    """What the pictures say of themselves.

    Args:
        noise: σ, s_p and s_r.
        width: τ [m]; 0 without.
        is_shown: Whether corners of one picture are off together by more than chance.
    """

    noise: Noise
    width: float = 0.0
    is_shown: bool = True

    @property
    def sizes(self) -> Float[np.ndarray, "4"]:
        """σ, s_p, s_r and τ."""
        return np.array([self.noise.own, self.noise.position, self.noise.rotation, self.width])

    def with_sizes(self, sizes: Float[np.ndarray, " k"]) -> "Variances":
        """With other ones; τ stays where it is not among them."""
        own, position, rotation, *width = sizes.tolist()
        noise = self.noise._replace(own=own, position=position, rotation=rotation)
        return self._replace(noise=noise, width=width[0] if width else self.width)


@dataclass(frozen=True, eq=False)
class Likelihood:
    """Restricted likelihood of the variances, and prior knowledge as it takes it.

    Args:
        pictures: Sums at a fit's answer.
        information: P without the geometry's.
        pull: P d of it.
        shares: Of each unknown that τ speaks of, its standard deviation for τ = 1 m; 0 of the others.
        off: x − nominal.
        square: dᵀ P d of it.
    """

    pictures: Pictures
    information: Float[np.ndarray, "p p"]
    pull: Float[np.ndarray, " p"]
    shares: Float[np.ndarray, " p"]
    off: Float[np.ndarray, " p"]
    square: float = 0.0

    @classmethod
    def at(
        cls, problem: Problem, x: Float[np.ndarray, " p"], shares: Float[np.ndarray, " p"] | None = None
    ) -> "Likelihood":
        """Of a problem without the geometry's prior; without `shares` τ has no part in it."""
        information, pull, square = np.diag((FAR * problem.units) ** -2), np.zeros(len(x)), 0.0
        if problem.prior is not None:
            own, off = problem.prior.T @ problem.prior, x - problem.prior_centre
            information, pull, square = information + own, own @ off, float(off @ own @ off)
        shares = np.zeros(len(x)) if shares is None else shares
        return cls(Pictures.at(problem, x), information, pull, shares, x - problem.start, square)

    @property
    def inside(self) -> Bool[np.ndarray, " p"]:
        """The unknowns that τ speaks of."""
        return self.shares > 0.0

    @property
    def count(self) -> int:
        """Number of variances that are sought."""
        return 4 if self.inside.any() else 3

    def most_likely(self, begin: Variances) -> Variances:
        """Variances of maximum restricted likelihood; 0 for what the pictures do not show.

        Args:
            begin: Where to begin; the noise of joint readings is kept.
        """
        low, high = np.log(MIN_SIZE[: self.count]), np.log(MAX_SIZE[: self.count])
        found = optimize.minimize(
            self.cost,
            np.clip(np.log(np.maximum(begin.sizes[: self.count], 1e-6)), low, high),
            method="L-BFGS-B",
            jac=True,
            bounds=list(zip(low, high, strict=True)),
            options={"ftol": 1e-10},
        )
        alone = found.x.copy()
        alone[1:3] = low[1:3]
        size = np.where(found.x < low + 0.7, 0.0, np.exp(found.x))
        size[0] = np.exp(found.x[0])
        is_shown = bool(self.cost(alone)[0] - found.fun > SHOWN)
        return begin._replace(width=0.0, is_shown=is_shown).with_sizes(size)

    def mean_width(self, begin: Variances) -> float:
        """Root mean square of τ [m] over its likelihood, every size alike likely beforehand.

        Few pictures leave τ open by a factor of two or three: the likeliest one alone would promise too much.

        Source: Gelman, Prior distributions for variance parameters in hierarchical models, Bayesian Analysis
        1, 2006.
        """
        return float(np.sqrt(np.average(WIDTHS**2, weights=self._weights(begin, 3))))

    def mean_lack(self, begin: Variances) -> float:
        """The same of s_p [m], what the model lacks of the tool's place along each axis."""
        return float(np.sqrt(np.average(WIDTHS**2, weights=WIDTHS * self._weights(begin, 1))))

    def _weights(self, begin: Variances, which: int) -> Float[np.ndarray, " widths"]:
        """Likelihood of a size at each of `WIDTHS`, relative to the maximum."""
        costs, now = [], begin
        for width in WIDTHS:
            now, cost = self._at_size(now, which, width)
            costs.append(cost)
        return np.exp(-0.5 * (np.array(costs) - min(costs)))

    def evidence(self, begin: Variances) -> float:
        """Twice the gain in log likelihood where the constants with shares are not held at nominal, τ → 0.

        It weighs what all pictures say, and changes little from one half of them to the other.
        """
        found = self.most_likely(begin)
        best = self._at_size(found, 3, max(found.width, MIN_SIZE[3]))[1]
        held = found._replace(noise=found.noise._replace(position=UNCALIBRATED, rotation=UNCALIBRATED))
        return max(min(self._at_size(each, 3, MIN_SIZE[3])[1] for each in (found, held)) - best, 0.0)

    def unlikelihood(self, begin: Variances) -> float:
        """Twice the negative log likelihood of the pictures at the most likely variances, all unknowns
        averaged out over what is known of them: by it problems with other unknowns are compared."""
        sizes = np.maximum(self.most_likely(begin).sizes, MIN_SIZE)[: self.count]
        cost = self.cost(np.log(sizes))[0]
        return float(cost + self.square - np.linalg.slogdet(self.information)[1])

    def largest(self, found: Variances) -> Noise:
        """The most likely variances with s_p and s_r, each alone, as large as the pictures allow (1 σ)."""
        best = np.maximum(found.sizes, MIN_SIZE)[: self.count]
        limit, shown = self.cost(np.log(best))[0] + 1.0, []
        for k in (1, 2):
            tried = best.copy()
            while tried[k] < MAX_SIZE[k] and self.cost(np.log(tried))[0] < limit:
                tried[k] *= 1.2
            shown.append(float(tried[k]))
        return found.noise._replace(position=shown[0], rotation=shown[1])

    def _at_size(self, begin: Variances, which: int, size: float) -> tuple[Variances, float]:
        """The most likely of σ, s_p, s_r and τ where one of them is given, and twice their negative log
        likelihood; with τ given these three alone are sought."""
        rest = np.arange(self.count) != which
        low, high = MIN_SIZE[: self.count][rest], MAX_SIZE[: self.count][rest]
        sizes = np.full(self.count, size)

        def cost(logs: np.ndarray) -> tuple[float, np.ndarray]:
            sizes[rest] = np.exp(logs)
            value, gradient = self.cost(np.log(sizes))
            return value, gradient[rest]

        found = optimize.minimize(
            cost,
            np.log(np.clip(begin.sizes[: self.count][rest], low, high)),
            method="L-BFGS-B",
            jac=True,
            bounds=np.log(np.array([low, high]).T),
            options={"ftol": 1e-7},
        )
        sizes[rest] = np.exp(found.x)
        return begin.with_sizes(sizes[:3] if which == 3 else sizes), float(found.fun)

    def cost(self, logs: np.ndarray) -> tuple[float, Float[np.ndarray, " logs"]]:
        """Twice the negative restricted log likelihood at logarithms of σ, s_p, s_r and, with a prior, τ.

        And its gradient. With S = diag(s)/σ and C = (S⁻² + BᵀB)⁻¹, ∂C/∂log s_k = 2 F_k F_kᵀ, F = C S⁻¹; the
        quadratic part is smallest at the step δ = H⁻¹g, which therefore counts as fixed.
        """
        pictures, inside = self.pictures, self.inside
        sigma, *spread = np.exp(logs)
        noise = Noise(spread[0], spread[1], (), sigma)
        c, log_v = pictures.compressed(noise)
        mixed = c @ pictures.cross
        weigh = 1.0 / sigma**2
        measured = weigh * (pictures.information - np.tensordot(pictures.cross, mixed, ([0, 1], [0, 1])))
        g = weigh * (pictures.gradient - np.tensordot(mixed, pictures.pull, ([0, 1], [0, 1]))) - self.pull
        h, prior, width = measured + self.information, 0.0, np.zeros(0)
        if len(logs) > 3:
            width = (self.shares[inside] * spread[2]) ** -2
            h[inside, inside] += width
            g[inside] -= width * self.off[inside]
            prior = float((width * self.off[inside] ** 2).sum() - np.log(width).sum())
        scale = 1.0 / np.sqrt(np.maximum(np.diag(h), np.diag(self.information)))  # rounding may leave less
        scaled = scale[:, None] * h * scale
        inverse = scale[:, None] * np.linalg.inv(scaled) * scale
        step = inverse @ g
        square = float(pictures.square.sum() - np.einsum("ri,rij,rj->", pictures.pull, c, pictures.pull))
        log_h = np.linalg.slogdet(scaled)[1] - 2.0 * np.log(scale).sum()
        cost = log_v + log_h + weigh * square + prior - float(g @ step)

        size = np.repeat(spread[:2], 3) / sigma
        f = np.swapaxes(c / size, 1, 2)
        left = pictures.pull - pictures.cross @ step
        seen = f @ pictures.cross
        by_h = ((seen @ inverse) * seen).sum(2)
        by_square = (f @ left[..., None])[..., 0] ** 2
        by_v = 1.0 - np.einsum("rii->ri", c) / size**2
        shared = 2.0 * (by_v - weigh * (by_h + by_square)).sum(0)
        rest = pictures.square.sum() - 2.0 * step @ pictures.gradient + step @ pictures.information @ step
        rest -= np.einsum("ri,rij,rj->", left, c, left)
        of_sigma = pictures.count.sum() - (inverse * measured).sum() - weigh * rest
        gradient = [2.0 * of_sigma - shared.sum(), shared[:3].sum(), shared[3:].sum()]
        if len(logs) > 3:
            off = self.off[inside] + step[inside]
            gradient.append(2.0 * float((1.0 - width * (off**2 + np.diag(inverse)[inside])).sum()))
        return cost, np.array(gradient)


FIRST = Variances(Noise(3e-4, 3e-4, (), 0.5))


def of_residuals(residual: np.ndarray, by_twist: np.ndarray, seen: np.ndarray) -> tuple[Pictures, Noise]:
    """Sums and variances of the residuals of a model that was not fitted to them.

    Where corners show nothing of s_p or s_r, it is not 0 but as large as they leave it (1 σ).
    """
    pictures, none = Pictures.of(residual, by_twist, seen, np.zeros((*residual.shape, 0))), np.zeros(0)
    likelihood = Likelihood(pictures, np.zeros((0, 0)), none, none, none)
    noise = likelihood.most_likely(FIRST).noise
    bound = likelihood.largest(Variances(noise))
    return pictures, noise._replace(
        position=noise.position or bound.position, rotation=noise.rotation or bound.rotation
    )
