"""Fit of A X B = Z to pairs of poses, and what contradicts it: wrong pairs, moves, another size.

The closed form (`base/hand_eye.py`) begins Gauss–Newton on what is left of B, with weights of positions and
rotations from the fit itself. With r what is left, J its columns (both whitened) and E those of unknowns that
are not free yet, freeing them saves

    rᵀ E⊥ (E⊥ᵀ E⊥)⁻¹ E⊥ᵀ r,      E⊥ = E − J (JᵀJ)⁻¹ Jᵀ E.

Six of a pair by itself (it is wrong), six of camera or target from a pair on (it was moved), or one factor of
all positions of the target (it has another size): what saves most is freed, one at a time, as long as chance
would save so much in one file of a hundred.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int
from scipy import special

from workbench.base import se3
from workbench.base.hand_eye import base_and_tool
from workbench.base.wording import in_mm

CHANCE, MAX_SHARE = 0.01, 0.25
"""Probability of setting a good pair apart in a file without bad ones; share of the pairs that may be."""
MAX_ROUNDS = 50
EQUAL, MIN_SIZE = 2.0, 0.05
"""Numbers that speak for positions as uncertain as angles times the hand's way; minimum of that way [m]."""
EXACT = 1e-7
"""Smallest standard deviation of positions [m] and rotations [rad]."""
MIN_PART, MIN_BOTH, MOVE_LEAVES, MIN_SPARE = 4, 10, 0.25, 18
"""Pairs before or after a move of camera or target, and all of them; part of the errors of positions or
rotations that it leaves at most; numbers beyond the unknowns from which on anything is let go."""
MAX_SCALE = 0.01
"""Deviation from 1 of the target's scale that may be corrected by it."""

CAMERA, TARGET, SCALE, PAIR = range(4)
"""What may be let go: poses of camera or target from a pair on, the target's size, a pair."""

Poses = Float[np.ndarray, "rows 4 4"]


@dataclass(frozen=True, eq=False)
class PairModel:
    """Cameras and targets as the pairs have them.

    Args:
        frames: Their poses X and Z.
        at: Which X and which Z each pair has.
        apart: Pairs that are wrong, the worst first.
        scale: By which the target's positions are multiplied …
        is_scaled: … and whether that is free.
    """

    frames: Float[np.ndarray, "n 4 4"]
    at: Int[np.ndarray, "rows 2"]
    apart: tuple[int, ...] = ()
    scale: float = 1.0
    is_scaled: bool = False

    @property
    def kept(self) -> Int[np.ndarray, " n"]:
        return np.delete(np.arange(len(self.at)), self.apart)

    def without(self, change: int, pair: int) -> "PairModel":
        """The same where a pair is wrong, camera or target was moved before it, or the size is free."""
        if change == PAIR:
            return replace(self, apart=(*self.apart, pair))
        if change == SCALE:
            return replace(self, is_scaled=True)
        at, before = self.at.copy(), self.at[pair, change]
        at[pair:, change][at[pair:, change] == before] = len(self.frames)
        return replace(self, frames=np.concatenate([self.frames, self.frames[[before]]]), at=at)

    def stepped(self, step: Float[np.ndarray, " p"]) -> "PairModel":
        """After a small step along and about each frame's parent's axes [m, rad], and of the scale."""
        six = step[:-1].reshape(-1, 6)
        turned = se3.rotvec_to_matrix(six[:, 3:]) @ self.frames[:, :3, :3]
        frames = se3.pose(turned, self.frames[:, :3, 3] + six[:, :3])
        return replace(self, frames=frames, scale=self.scale + float(step[-1]))

    def linearised(self, a: Poses, b: Poses) -> tuple[np.ndarray, list[np.ndarray]]:
        """B as measured minus X⁻¹ A⁻¹ Z [m, rad], and what steps of X, of Z and of the scale take off it."""
        x, z = self.frames[self.at.T]
        hand, to_camera = se3.inverse(a), np.swapaxes(x[:, :3, :3], 1, 2)
        by_x, by_z, by_scale = (np.zeros((len(a), 6, k)) for k in (6, 6, 1))
        by_x[:, :3, :3] = by_x[:, 3:, 3:] = -to_camera
        by_x[:, :3, 3:] = to_camera @ se3.skew(se3.apply(hand, z[:, :3, 3]) - x[:, :3, 3])
        by_z[:, :3, :3] = by_z[:, 3:, 3:] = to_camera @ hand[:, :3, :3]
        by_scale[:, :3, 0] = -b[:, :3, 3]
        seen = se3.pose(b[:, :3, :3], self.scale * b[:, :3, 3])
        return se3.pose_error(seen, se3.inverse(x) @ hand @ z), [by_x, by_z, by_scale]


@dataclass(frozen=True, eq=False)
class PairFit:
    """A model that was fitted to the pairs that count.

    Args:
        model: The answer.
        sigma: Standard deviations of positions [m] and rotations [rad].
        errors: How far each pair's target is seen from where the model has it [m, rad].
        left: What is left of each pair that counts, whitened as all that follows.
        columns: What steps of camera, target and scale take off it.
        basis: Of the columns of what is free.
        spread: One standard deviation of each unknown, the scale's last.
    """

    model: PairModel
    sigma: Float[np.ndarray, "2"]
    errors: Float[np.ndarray, "rows 2"]
    left: Float[np.ndarray, "kept 6"]
    columns: list[np.ndarray]
    basis: Float[np.ndarray, "kept 6 p"]
    spread: Float[np.ndarray, " n"]

    @property
    def spare(self) -> int:
        return self.left.size - self.basis.shape[2]

    @property
    def rms(self) -> Float[np.ndarray, "2"]:
        """Root mean square of the errors of the pairs that count [m, rad]."""
        return np.sqrt((self.errors[self.model.kept] ** 2).mean(0))

    @property
    def half(self) -> Float[np.ndarray, " n"]:
        """Half of the 95 % intervals of the unknowns."""
        return special.stdtrit(self.spare / 2, 0.975) * self.spread

    @property
    def last(self) -> tuple[Float[np.ndarray, "2 4 4"], Float[np.ndarray, "2 6"]]:
        """Camera and target as they were at last, and half of their 95 % intervals [m, rad]."""
        own = self.model.at[self.model.kept[-1]]
        return self.model.frames[own], self.half[:-1].reshape(-1, 6)[own]

    @property
    def changes(self) -> Iterator[tuple[int, int]]:
        """What the pairs ask to let go, of which pair or from which on, the likeliest first."""
        count, kept = len(self.left), self.model.kept
        may_be_wrong = len(self.model.apart) < int(MAX_SHARE * len(self.errors))
        alone = np.tile(may_be_wrong * np.eye(6), (count, 1, 1))
        inside = (np.minimum(np.arange(count), count - np.arange(count)) >= MIN_PART) & (count >= MIN_BOTH)
        camera, target, scale = self.columns
        saved = [
            inside * self._saved(c, lambda s: np.cumsum(s[::-1], axis=0)[::-1]) for c in (camera, target)
        ]
        saved.append(self._saved(scale * (not self.model.is_scaled), lambda s: s.sum(0)[None]))
        saved.append(self._saved(alone))
        total, tests, found = float((self.left**2).sum()), sum(map(len, saved)), []
        floor = (self.spare - 6) * (EXACT / self.sigma.max()) ** 2
        for change, gains in enumerate(saved):
            size = 1 if change == SCALE else 6
            rest = max(total - float(gains.max()), floor)
            ratio = max(total - rest, 0.0) / size / rest * (self.spare - size)
            if self.spare >= MIN_SPARE and special.fdtrc(size, self.spare - size, ratio) * tests < CHANCE:
                cost = self.spare * np.log(rest) + size * np.log(self.left.size)
                found.append((cost, change, int(kept[gains.argmax()])))
        yield from (each[1:] for each in sorted(found))

    def _saved(
        self, columns: Float[np.ndarray, "kept 6 k"], total: Callable[[np.ndarray], np.ndarray] = np.asarray
    ) -> Float[np.ndarray, " n"]:
        """What unknowns with these columns would save, free in each pair, from each on, or in all."""
        turned, basis = np.swapaxes(columns, 1, 2), np.swapaxes(self.basis, 1, 2)
        own, seen, pull = map(total, (turned @ columns, basis @ columns, turned @ self.left[..., None]))
        through = np.linalg.pinv(own - np.swapaxes(seen, 1, 2) @ seen, rcond=1e-9, hermitian=True)
        return (np.swapaxes(pull, 1, 2) @ through @ pull)[:, 0, 0]

    @property
    def scaled(self) -> str:
        """What the target's positions were multiplied by; "" if by nothing."""
        by = f"{self.model.scale:.4g} ± {self.half[-1]:.2g}"
        is_other = self.model.is_scaled and abs(self.model.scale - 1.0) > self.half[-1]
        return f"the target's positions fit if multiplied by {by}" if is_other else ""

    def contradictions(self, row: Int[np.ndarray, " rows"]) -> Iterator[str]:
        """What else than wrong pairs was let go, and what to do, a clause each, by the pairs' numbers."""
        kept, frames = self.model.kept, self.model.frames
        for what, own in zip(("camera", "target"), self.model.at[kept].T, strict=True):
            for k in np.flatnonzero(np.diff(own)):
                moved = se3.inverse(frames[own[k]]) @ frames[own[k + 1]]
                angle = np.rad2deg(np.linalg.norm(se3.matrix_to_rotvec(moved[:3, :3])))
                by = f"{in_mm(float(np.linalg.norm(moved[:3, 3])))}, {angle:.2g}°"
                pairs = f"between pairs {row[kept[k]]} and {row[kept[k + 1]]}"
                yield f"the {what} moved by {by} {pairs}: give those before or after alone"
        if abs(self.model.scale - 1.0) > MAX_SCALE:
            yield f"{self.scaled}: correct the target's size, the focal length or the unit"


def fit_pairs(a: Poses, b: Poses) -> PairFit:
    """X and Z of A X B = Z; what contradicts them is let go."""
    inverse_x, z = base_and_tool(se3.inverse(a), b)
    start = PairModel(np.array([se3.inverse(inverse_x), z]), np.tile([0, 1], (len(a), 1)))
    best, found = None, _refined(a, b, start)
    while found is not best:
        best = found
        for change, pair in best.changes:
            tried = _refined(a, b, best.model.without(change, pair))
            if change >= SCALE or (tried.sigma < MOVE_LEAVES * best.sigma).any():
                found = tried
                break
    return found


def _refined(a: Poses, b: Poses, model: PairModel) -> PairFit:
    """The model by Gauss–Newton."""
    kept, at = model.kept, model.at[model.kept].T
    size = np.array([max(float(np.ptp(a[kept, :3, 3], axis=0).max()), MIN_SIZE), 1.0])
    before, spare, free = np.zeros(2), 3 * len(kept) - 6, np.arange(len(model.frames))
    for _ in range(MAX_ROUNDS):
        every, columns = model.linearised(a, b)
        left = every[kept]
        squares = (left.reshape(-1, 2, 3) ** 2).sum((0, 2)) / size**2
        variance = (squares + EQUAL * squares.sum() / (2 * spare)) / (spare + EQUAL)
        sigma = np.maximum(size * np.sqrt(variance), EXACT)
        weight = np.repeat(1.0 / sigma, 3)
        left, columns = left * weight, [each[kept] * weight[:, None] for each in columns]
        parts = [
            by[:, :, None] * (own[:, None] == free)[:, None, :, None]
            for own, by in zip(at, columns, strict=False)
        ]
        flat = np.sum(parts, axis=0).reshape(left.size, -1)
        flat = np.hstack([flat, (columns[2] * model.is_scaled).reshape(-1, 1)])
        u, s, vt = np.linalg.svd(flat, full_matrices=False)
        rank = int((s > 1e-9 * s[0]).sum())
        step = vt[:rank].T @ (u[:, :rank].T @ left.ravel() / s[:rank])
        if np.abs(step).max() < EXACT and np.allclose(sigma, before, rtol=1e-3):
            break
        model, before = model.stepped(step), sigma
    spread = np.sqrt(((vt / np.maximum(s, 1e-9 * s[0])[:, None]) ** 2).sum(0))
    errors = np.linalg.norm(every.reshape(-1, 2, 3), axis=2)
    return PairFit(model, sigma, errors, left, columns, u[:, :rank].reshape(len(kept), 6, -1), spread)
