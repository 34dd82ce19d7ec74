"""Standard errors of a diagnosis' coefficients, with errors shared by rows, and joints clear by them.

With H = JᵀJ of the whitened rows, Λ the prior precision and A = H + Λ, the covariance is σ² A⁻¹ if errors of
rows are independent. Rows of one place (a group, or a repeated posture) may share an error; then it is

    A⁻¹ (M + σ² Λ) A⁻¹,      M = G/(G−1) Σ_g s_g s_gᵀ,      s_g = Σ_{i in g} J_iᵀ r_i

over the G places. The larger one is used, with at least `MIN_PLACES` places.

Source: Liang, Zeger, Longitudinal data analysis using generalized linear models, Biometrika 73(1), 1986.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from workbench.arm.effects import AbstractEffect
from workbench.arm.effects.effect import MIN_STATED_ERRORS as STATED
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base.advice import beside
from workbench.base.wording import joint_list
from workbench.data.postures import pose_units
from workbench.identification.fit import Fit

MIN_NAMED_ERRORS = 4.0
"""Minimum standard errors of a coefficient for its joint to be named in a certain cause."""
MIN_PLACES = 20
"""Minimum number of places to estimate shared errors."""
MIN_ROWS = 1.5
"""Minimum mean number of rows per place; below it rows count as independent."""


class StandardErrors(dict[str, float]):
    """Of the saved arm's unknowns by name [SI]."""

    def __init__(self, fit: Fit):
        self._fit, self._ratio = fit, dependence(fit)
        super().__init__(fit.problem.named(fit.std * self._ratio))

    def covariance(self, names: Sequence[str]) -> Float[np.ndarray, "k k"]:
        """Covariance of some unknowns [SI²], consistent with these standard errors."""
        mine = [self._fit.problem.names.index(n) for n in names]
        return self._fit.covariance[np.ix_(mine, mine)] * np.outer(self._ratio[mine], self._ratio[mine])


def dependence(fit: Fit) -> Float[np.ndarray, " p"]:
    """Factor of each standard error due to errors shared within places, at least 1."""
    problem, ones = fit.problem, np.ones(len(fit.problem.names))
    place = pose_units(problem.data)
    count = int(place.max(initial=-1)) + 1
    if count < MIN_PLACES or len(place) < MIN_ROWS * count:
        return ones
    root, variance = fit.factor.root, fit.variance_factor
    scores, expected = np.zeros((count, len(root))), problem.prior.T @ problem.prior
    for block, piece in problem.pieces(fit.x):
        label = np.repeat(place[block.rows], len(piece.residual) // len(block.rows))
        np.add.at(scores, label, piece.jacobian * piece.residual[:, None])
    inner = np.eye(root.shape[1]) - root.T @ expected @ root  # of the rows alone: rootᵀ A root is 1
    mine = scores @ root
    shared = mine.T @ mine * count / (count - 1.0) - variance * inner
    more = np.einsum("pi,ij,pj->p", root, shared, root, optimize=True)
    own = variance * (root**2).sum(1)
    return np.sqrt(1.0 + np.maximum(more, 0.0) / np.where(own > 0.0, own, np.inf))


def without_joints(effect: AbstractEffect, joints: Sequence[int]) -> AbstractEffect:
    if not joints:
        return effect
    kept = [i for i, j in enumerate(effect.joints) if j not in joints]
    sizes = np.reshape(effect.coefficients, (len(effect.joints), -1))[kept].ravel().tolist()
    return replace(effect, joints=tuple(effect.joints[i] for i in kept), coefficients=tuple(sizes))


def clearness(effects: Sequence[AbstractEffect], std: Mapping[str, float]) -> dict[int | None, float]:
    """Standard errors by which the largest coefficient differs from zero, per joint if joints share such
    effects; under None for other effects."""
    out: dict[int | None, float] = {}
    for effect in effects:
        z = [abs(c) / std[n] for n, c in zip(effect.names, effect.coefficients, strict=True)]
        joints = effect.joints if effect.of_many_joints else (None,)
        for joint, mine in zip(joints, np.array_split(z, len(joints)), strict=True):
            out[joint] = max(out.get(joint, 0.0), float(mine.max()))
    return out


@beside("the description of an effect", "an effect")
def sentence_of(
    effect: AbstractEffect, unsure: Sequence[int], std: StandardErrors, arm: Robot, motion: Motion
) -> str:
    """Description of an effect in its sure joints, and which others may have it too.

    Args:
        effect: With its identified coefficients.
        unsure: Joints that may not be named.
        std: Of its coefficients; insignificant sizes are not stated.
    """
    sizes = clearness([effect], std)
    hidden = [j for j, z in sizes.items() if j is not None and (z < STATED or j in unsure)]
    hidden = [*unsure] if len(hidden) == len(sizes) else hidden
    shown = without_joints(effect, hidden)
    text = shown.stated(arm.chain, motion, std.covariance(shown.names))
    return f"{text}; not clear for {joint_list(hidden)}" if hidden else text
