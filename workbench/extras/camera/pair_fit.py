"""Fit of A X B = Z to pairs of poses, and what contradicts it: wrong pairs, a move, another size.

The closed form that suits most pairs (`resection.py`) begins Gauss–Newton on what is left of B, with weights
of positions and rotations from the fit itself. Then each pair is judged by the others, which settles it in a
few rounds: it is wrong if chance would have one so far off in one file of a hundred. As rarely may camera or
target from a pair on (it was moved, which ends that), or one factor of all positions of the target (it has
another size) or of its depths (another focal length), save as much. Rounds begin from all pairs, and, as too
many wrong ones hide each other, from those that suit one closed form.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy import special

from workbench.base import se3
from workbench.extras.camera.resection import SURE, Poses, placed

CHANCE, CLEARLY = 0.01, 3.0
"""Probability of setting a good pair apart in a file without bad ones, of which a third each is of pairs and
moves of camera and target; how many times better pairs fit what they contradict else."""
MAX_ROUNDS, MAX_WRONG = 20, 1.0 - SURE
"""Of the fit, and of judging pairs; share of the pairs that may be wrong."""
EQUAL, MIN_SIZE = 2.0, 0.05
"""Numbers that speak for positions as uncertain as angles times the hand's way; minimum of that way [m]."""
EXACT, ROUNDING = 1e-7, 0.1
"""Smallest standard deviation of positions [m] and rotations [rad], and share of a variance that is none."""
MIN_PART, MIN_BOTH, MOVE_LEAVES, MIN_PAIRS = 4, 10, 0.25, 5
"""Pairs before or after a move of camera or target, and all of them; part of the errors of positions or
rotations that it leaves at most; pairs from which on anything is judged."""
PLACES = 50
"""Pairs from which on not every place of a move is tried."""
SIZE, DEPTH = np.ones(3), np.array([0.0, 0.0, 1.0])
"""Along the camera's axes, what a factor multiplies."""
FLIPPED = np.deg2rad(165.0)
"""Errors of pairs that see the target turned by half a turn: a chessboard counted from its other end."""


@dataclass(frozen=True, eq=False, kw_only=True)
class PairFit:
    """Camera X and target Z, fitted to the pairs that count.

    Args:
        frames: X and Z.
        scale: By which the target's positions are multiplied.
        along: Which of them, along the camera's axes.
        apart: Pairs that are wrong.
        errors: How far each pair's target is seen from where the fit has it [m, rad].
        left: The same along and about axes, whitened as all that follows.
        columns: What steps of camera, target and scale take off it.
        basis: Of the columns of what is free, of length 1 over the pairs that count.
        spread: One standard deviation of each unknown; 0 for a scale that isn't free.
        moved: Camera or target, by how much it was moved [m, rad], and before which pair.
    """

    frames: Float[np.ndarray, "2 4 4"]
    scale: float
    along: Float[np.ndarray, "3"]
    apart: tuple[int, ...]
    errors: Float[np.ndarray, "rows 2"]
    left: Float[np.ndarray, "rows 6"]
    columns: Float[np.ndarray, "rows 6 13"]
    basis: Float[np.ndarray, "rows 6 p"]
    spread: Float[np.ndarray, "13"]
    moved: tuple[str, Float[np.ndarray, "2"], int] | None = None

    @property
    def kept(self) -> Int[np.ndarray, " n"]:
        return np.delete(np.arange(len(self.errors)), np.array(self.apart, int))

    @property
    def spare(self) -> int:
        return 6 * len(self.kept) - self.basis.shape[2]

    @property
    def rms(self) -> Float[np.ndarray, "2"]:
        """Root mean square of the errors of the pairs that count [m, rad]."""
        return np.sqrt((self.errors[self.kept] ** 2).mean(0))

    @property
    def half(self) -> Float[np.ndarray, "13"]:
        """Half of the 95 % intervals of the unknowns."""
        return special.stdtrit(self.spare / 2, 0.975) * self.spread

    @property
    def wrong(self) -> tuple[int, ...]:
        """Pairs that are too far from where the others that count have them."""
        counts = np.isin(np.arange(len(self.errors)), self.kept)
        own = self.basis @ self.basis.transpose(0, 2, 1) * np.where(counts, -1.0, 1.0)[:, None, None]
        off = np.linalg.solve((1.0 + EXACT) * np.eye(6) + own, self.left[..., None])[..., 0]
        off = (off * self.left).sum(1)
        return tuple(np.flatnonzero(self._chance(6, off, counts) < CHANCE).tolist())

    @property
    def is_scaled(self) -> bool:
        """Whether the target's positions fit far better if multiplied."""
        far = (self.scale - 1.0) / (self.spread[12] or 1.0)  # 0 where it isn't free
        return bool(self._chance(1, far**2, False) < CHANCE)

    @property
    def move(self) -> tuple[str, Float[np.ndarray, "2"], int] | None:
        """What was moved, by how much and before which pair, if chance would hardly save as much."""
        kept, count = self.kept, len(self.kept)
        if count < MIN_BOTH:
            return None
        cuts = np.arange(MIN_PART, count - MIN_PART + 1, 1 + count // PLACES)
        left, basis = self.left[kept].ravel(), self.basis[kept].reshape(6 * count, -1)
        both = self.columns[kept, :, :12].reshape(6 * count, 2, 1, 6).transpose(1, 2, 0, 3)
        new = both * np.repeat(np.arange(count) >= cuts[:, None], 6, axis=1)[..., None]
        new -= basis @ (basis.T @ new)
        step = np.linalg.pinv(new, rcond=1e-9) @ left
        rest = left - (new @ step[..., None])[..., 0]
        kinds = [(each.reshape(*each.shape[:-1], -1, 2, 3) ** 2).sum((-3, -1)) for each in (rest, left)]
        saved = (kinds[1] - kinds[0]).sum(-1)
        fits = (kinds[0] < MOVE_LEAVES**2 * kinds[1]).any(-1) & (self._chance(6, saved, True) < CHANCE)
        if not fits.any():
            return None
        what, k = np.unravel_index(np.argmax(np.where(fits, saved, 0.0)), fits.shape)
        by = np.linalg.norm(step[what, k].reshape(2, 3), axis=1)
        return ("camera", "target")[what], by, int(kept[cuts[k]])

    def _chance(self, size: int, saved: Any, within: Any) -> Float[np.ndarray, "..."]:
        """How often chance saves as much by so many unknowns, of squares in the fit or beside it."""
        spare = self.spare - size * np.asarray(within, int)
        rest = float((self.left[self.kept] ** 2).sum()) - np.where(within, saved, 0.0)
        ratio = saved / size / np.maximum(rest / np.maximum(spare, 1), ROUNDING)
        return np.asarray(special.fdtrc(size, spare, ratio) * 3 * len(self.errors))


def fit_pairs(a: Poses, b: Poses) -> PairFit:
    """X and Z of A X B = Z; what contradicts them is let go."""
    hand, open_pose = se3.inverse(a), np.full((4, 4), np.nan)
    x, z, suits = placed(hand, b, eye=open_pose, board=open_pose)
    turn = np.linalg.norm(se3.pose_error(b, se3.inverse(x) @ hand @ z)[:, 3:], axis=1)
    wrong = ~np.isin(np.arange(len(a)), suits) & (len(a) >= MIN_PAIRS)
    fit, most = (_judged(a, b, np.array([x, z]), apart) for apart in (turn > FLIPPED, wrong))
    is_better = len(most.apart) <= MAX_WRONG * len(a) and (CLEARLY * most.rms < fit.rms).any()
    fit = most if fit.moved is None and is_better else fit
    deep = _judged(a, b, fit.frames, np.isin(np.arange(len(a)), fit.apart), DEPTH)
    is_deep = deep.is_scaled and fit.moved is deep.moved is None and EQUAL * deep.rms[0] < fit.rms[0]
    return deep if is_deep else fit


def _judged(
    a: Poses, b: Poses, frames: np.ndarray, apart: Bool[np.ndarray, " rows"], along: np.ndarray = SIZE
) -> PairFit:
    """The fit from some pairs, without those that contradict it; that camera or target was moved ends it."""
    rounds = MAX_ROUNDS if len(a) >= MIN_PAIRS else 0
    fit = _refined(a, b, frames, tuple(np.flatnonzero(apart).tolist()), along, 1.0 if rounds else None)
    for _ in range(rounds):
        if (move := fit.move) is not None:
            return replace(fit, moved=move)
        wrong, is_scaled = fit.wrong, fit.spread[12] > 0.0
        if wrong == fit.apart or len(wrong) > MAX_WRONG * len(a):
            if fit.is_scaled == is_scaled:
                break
            wrong, is_scaled = fit.apart, False
        fit = _refined(a, b, fit.frames, wrong, along, fit.scale if is_scaled else None)
    return fit


def _refined(
    a: Poses, b: Poses, frames: np.ndarray, apart: tuple[int, ...], along: np.ndarray, factor: float | None
) -> PairFit:
    """Camera and target, and the factor where it is free, by Gauss–Newton."""
    kept, (x, z), before = np.delete(np.arange(len(a)), np.array(apart, int)), frames, np.zeros(2)
    size = np.array([max(float(np.ptp(a[kept, :3, 3], axis=0).max()), MIN_SIZE), 1.0])
    hand, spare, free = se3.inverse(a), 3 * len(kept) - 6, 12 + (factor is not None)
    step, spread, scale = np.zeros(13), np.zeros(13), factor or 1.0
    for _ in range(MAX_ROUNDS):
        to_camera, columns = x[:3, :3].T, np.zeros((len(a), 6, 13))
        columns[:, :3, :3] = columns[:, 3:, 3:6] = -to_camera
        columns[:, :3, 3:6] = to_camera @ se3.skew(se3.apply(hand, z[:3, 3]) - x[:3, 3])
        columns[:, :3, 6:9] = columns[:, 3:, 9:12] = to_camera @ hand[:, :3, :3]
        columns[:, :3, 12] = -along * b[:, :3, 3]
        seen = (1.0 + (scale - 1.0) * along) * b[:, :3, 3]
        every = se3.pose_error(se3.pose(b[:, :3, :3], seen), se3.inverse(x) @ hand @ z)
        squares = (every[kept].reshape(-1, 2, 3) ** 2).sum((0, 2)) / size**2
        variance = (squares + EQUAL * squares.sum() / (2 * spare)) / (spare + EQUAL)
        sigma = np.maximum(size * np.sqrt(variance), EXACT)
        weight = np.repeat(1.0 / sigma, 3)
        left, columns = every * weight, columns * weight[:, None]
        _, s, vt = np.linalg.svd(columns[kept, :, :free].reshape(-1, free), full_matrices=False)
        rank = int((s > 1e-9 * s[0]).sum())
        basis = columns[..., :free] @ (vt[:rank].T / s[:rank])
        step[:free] = vt[:rank].T @ (np.einsum("ijk,ij", basis[kept], left[kept]) / s[:rank])
        if np.abs(step).max() < EXACT and np.allclose(sigma, before, rtol=1e-3):
            break
        old, by = np.array([x, z]), step[:12].reshape(2, 6)
        x, z = se3.pose(se3.rotvec_to_matrix(by[:, 3:]) @ old[:, :3, :3], old[:, :3, 3] + by[:, :3])
        scale, before = scale + float(step[12]), sigma
    spread[:free] = np.sqrt(((vt / np.maximum(s, 1e-9 * s[0])[:, None]) ** 2).sum(0))
    errors = np.linalg.norm(every.reshape(-1, 2, 3), axis=2)
    fitted = {"left": left, "columns": columns, "basis": basis, "spread": spread, "errors": errors}
    return PairFit(frames=np.array([x, z]), scale=scale, along=along, apart=apart, **fitted)
