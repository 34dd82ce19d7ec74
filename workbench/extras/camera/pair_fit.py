"""Fit of A X B = Z to pairs of poses, and what contradicts it: wrong pairs, a move, another size.

The closed form that suits most pairs (`resection.py`) begins Gauss–Newton on what is left of B, with weights
of positions and rotations from the fit itself. Then what saves most is let go, as long as chance would save
so much in one file of a hundred: a pair by itself (it is wrong), camera or target from a pair on (it was
moved, which ends that), or one factor of all positions of the target (it has another size).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int
from scipy import special

from workbench.base import se3
from workbench.extras.camera.resection import misfit, placed, suiting

CHANCE, MAX_SHARE, MAX_WRONG, CLEARLY = 0.01, 0.25, 0.6, 3.0
"""Probability of setting a good pair apart in a file without bad ones; share of the pairs that may be one by
one, and at once; how many times better pairs fit what they contradict else."""
MAX_ROUNDS = 50
EQUAL, MIN_SIZE = 2.0, 0.05
"""Numbers that speak for positions as uncertain as angles times the hand's way; minimum of that way [m]."""
EXACT = 1e-7
"""Smallest standard deviation of positions [m] and rotations [rad]."""
MIN_PART, MIN_BOTH, MOVE_LEAVES, MIN_SPARE = 4, 10, 0.25, 18
"""Pairs before or after a move of camera or target, and all of them; part of the errors of positions or
rotations that it leaves at most; numbers beyond the unknowns from which on anything is let go."""
WORST, PLACES = 20, 50
"""Most pairs that are tried alone, and from which on a move is tried."""
FLIPPED = np.deg2rad(165.0)
"""Errors of pairs that see the target turned by half a turn: a chessboard counted from its other end."""
FRAMES = ("camera", "target")

Poses = Float[np.ndarray, "rows 4 4"]


@dataclass(frozen=True, eq=False, kw_only=True)
class PairFit:
    """Camera X and target Z, fitted to the pairs that count.

    Args:
        frames: X and Z.
        scale: By which the target's positions are multiplied.
        apart: Pairs that are wrong.
        errors: How far each pair's target is seen from where the fit has it [m, rad].
        left: What is left of the pairs that count, whitened as all that follows.
        columns: What steps of camera, target and scale take off it.
        basis: Of the columns of what is free.
        spread: One standard deviation of each unknown; 0 for a scale that isn't free.
        moved: Camera or target, by how much it was moved [m, rad], and before which pair.
    """

    frames: Float[np.ndarray, "2 4 4"]
    scale: float
    apart: tuple[int, ...]
    errors: Float[np.ndarray, "rows 2"]
    left: Float[np.ndarray, " kept6"]
    columns: Float[np.ndarray, "kept6 13"]
    basis: Float[np.ndarray, "kept6 p"]
    spread: Float[np.ndarray, "13"]
    moved: tuple[str, Float[np.ndarray, "2"], int] | None = None

    @property
    def kept(self) -> Int[np.ndarray, " n"]:
        return np.delete(np.arange(len(self.errors)), self.apart)

    @property
    def spare(self) -> int:
        return self.basis.shape[0] - self.basis.shape[1]

    @property
    def rms(self) -> Float[np.ndarray, "2"]:
        """Root mean square of the errors of the pairs that count [m, rad]."""
        return np.sqrt((self.errors[self.kept] ** 2).mean(0))

    @property
    def half(self) -> Float[np.ndarray, "13"]:
        """Half of the 95 % intervals of the unknowns."""
        return special.stdtrit(self.spare / 2, 0.975) * self.spread

    @property
    def change(self) -> tuple[str, int, Float[np.ndarray, " k"]] | None:
        """What the pairs ask to let go, which of them or from which on, and the step; None for nothing."""
        count, total = len(self.left) // 6, float(self.left @ self.left)
        if self.spare < MIN_SPARE or total < 0.1 * self.spare:  # exact: rounding is left
            return None
        pair, found = np.arange(len(self.left)) // 6, []
        tried = [("scale", 0, self.columns[:, 12:])] if self.spread[12] == 0.0 else []
        if len(self.apart) < int(MAX_SHARE * len(self.errors)):
            worst = np.argsort(-(self.left.reshape(count, 6) ** 2).sum(1))[:WORST].tolist()
            tried += [("pair", k, np.eye(len(self.left))[:, 6 * k : 6 * k + 6]) for k in worst]
        if count >= MIN_BOTH:
            for k in range(MIN_PART, count - MIN_PART + 1, 1 + count // PLACES):
                after = (pair >= k)[:, None]
                tried += [(w, k, self.columns[:, 6 * i :][:, :6] * after) for i, w in enumerate(FRAMES)]
        for what, k, columns in tried:
            new = columns - self.basis @ (self.basis.T @ columns)
            step = np.linalg.lstsq(new, self.left, rcond=1e-9)[0]
            left, size = self.left - new @ step, len(step)
            rest = max(float(left @ left), 1e-12 * total)
            ratio = (total - rest) / size / rest * (self.spare - size)
            chance = special.fdtrc(size, self.spare - size, ratio) * 3 * count
            kinds = [(each.reshape(-1, 2, 3) ** 2).sum((0, 2)) for each in (left, self.left)]
            if chance < CHANCE and (what not in FRAMES or (kinds[0] < MOVE_LEAVES**2 * kinds[1]).any()):
                found.append((self.spare * np.log(rest) + size * np.log(len(left)), what, k, step))
        return min(found, key=lambda each: each[0])[1:] if found else None


def fit_pairs(a: Poses, b: Poses) -> PairFit:
    """X and Z of A X B = Z; what contradicts them is let go.

    Where too many pairs are wrong to be let go one by one, those that belong together judge the others.
    """
    hand, open_pose = se3.inverse(a), np.full((4, 4), np.nan)
    x, z = frames = placed(hand, b, eye=open_pose, board=open_pose)
    turn = np.linalg.norm(se3.pose_error(b, se3.inverse(x) @ hand @ z)[:, 3:], axis=1)
    fit = _let_go(a, b, _refined(a, b, frames, np.flatnonzero(turn > FLIPPED)))
    apart = np.setdiff1d(np.arange(len(a)), suiting(misfit(hand, b, x, z))[1])
    if fit.moved is not None or not 0 < len(apart) <= MAX_WRONG * len(a):
        return fit
    for _ in range(MAX_ROUNDS):
        most = _refined(a, b, frames, apart)
        sizes = 3.0 * ((most.errors / np.maximum(most.rms, EXACT)) ** 2).sum(1)
        before, apart = apart, np.flatnonzero(sizes > special.chdtri(6, CHANCE / len(a)))
        if np.array_equal(before, apart) or len(apart) > MAX_WRONG * len(a):
            break
    return _let_go(a, b, most) if (CLEARLY * most.rms < fit.rms).any() else fit


def _let_go(a: Poses, b: Poses, fit: PairFit) -> PairFit:
    """The fit without what contradicts it, one by one; that camera or target was moved ends it."""
    while (change := fit.change) is not None:
        what, k, step = change
        if what in FRAMES:
            return replace(fit, moved=(what, np.linalg.norm(step.reshape(2, 3), axis=1), int(fit.kept[k])))
        apart = (*fit.apart, int(fit.kept[k])) if what == "pair" else fit.apart
        is_scaled = bool(fit.spread[12] > 0.0) or what == "scale"
        fit = _refined(a, b, fit.frames, apart, fit.scale, is_scaled)
    return fit


def _refined(
    a: Poses,
    b: Poses,
    frames: Sequence[np.ndarray] | np.ndarray,
    apart: Sequence[int] | np.ndarray,
    scale: float = 1.0,
    is_scaled: bool = False,
) -> PairFit:
    """Camera and target, and the scale where it is free, by Gauss–Newton."""
    kept, (x, z), before = np.delete(np.arange(len(a)), np.array(apart, int)), frames, np.zeros(2)
    size = np.array([max(float(np.ptp(a[kept, :3, 3], axis=0).max()), MIN_SIZE), 1.0])
    hand, spare, free = se3.inverse(a), 3 * len(kept) - 6, 12 + is_scaled
    step, spread = np.zeros(13), np.zeros(13)
    for _ in range(MAX_ROUNDS):
        to_camera, columns = x[:3, :3].T, np.zeros((len(a), 6, 13))
        columns[:, :3, :3] = columns[:, 3:, 3:6] = -to_camera
        columns[:, :3, 3:6] = to_camera @ se3.skew(se3.apply(hand, z[:3, 3]) - x[:3, 3])
        columns[:, :3, 6:9] = columns[:, 3:, 9:12] = to_camera @ hand[:, :3, :3]
        columns[:, :3, 12] = -b[:, :3, 3]
        every = se3.pose_error(se3.pose(b[:, :3, :3], scale * b[:, :3, 3]), se3.inverse(x) @ hand @ z)
        squares = (every[kept].reshape(-1, 2, 3) ** 2).sum((0, 2)) / size**2
        variance = (squares + EQUAL * squares.sum() / (2 * spare)) / (spare + EQUAL)
        sigma = np.maximum(size * np.sqrt(variance), EXACT)
        weight = np.repeat(1.0 / sigma, 3)
        left, columns = (every[kept] * weight).ravel(), (columns[kept] * weight[:, None]).reshape(-1, 13)
        u, s, vt = np.linalg.svd(columns[:, :free], full_matrices=False)
        rank = int((s > 1e-9 * s[0]).sum())
        step[:free] = vt[:rank].T @ (u[:, :rank].T @ left / s[:rank])
        if np.abs(step).max() < EXACT and np.allclose(sigma, before, rtol=1e-3):
            break
        x, z = (
            se3.pose(se3.rotvec_to_matrix(by[3:]) @ pose[:3, :3], pose[:3, 3] + by[:3])
            for pose, by in ((x, step[:6]), (z, step[6:12]))
        )
        scale, before = scale + float(step[12]), sigma
    spread[:free] = np.sqrt(((vt / np.maximum(s, 1e-9 * s[0])[:, None]) ** 2).sum(0))
    errors, basis = np.linalg.norm(every.reshape(-1, 2, 3), axis=2), u[:, :rank]
    fitted = {"left": left, "columns": columns, "basis": basis, "spread": spread, "errors": errors}
    return PairFit(frames=np.array([x, z]), scale=scale, apart=tuple(map(int, apart)), **fitted)
