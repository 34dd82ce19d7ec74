"""Standard errors of a diagnosis' coefficients: with what hides in them, and where rows share an error.

With H = JᵀJ of the whitened rows, Λ what was expected beforehand and A = H + Λ, the covariance is σ² A⁻¹ if
rows err independently. Rows of one place (a group, or one posture measured again) may share an error; then
it is

    A⁻¹ (M + σ² Λ) A⁻¹,      M = G/(G−1) Σ_g s_g s_gᵀ,      s_g = Σ_{i in g} J_iᵀ r_i

over the G places. It counts where it is larger, from `MIN_PLACES` places on.

Source: Liang, Zeger, Longitudinal data analysis using generalized linear models, Biometrika 73(1), 1986.
"""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from jaxtyping import Float, Int

from workbench.data.dataset import Dataset
from workbench.identification.fit import Fit

REPEATED = 1e-3
"""Joint positions [rad or m] that differ less count as one posture."""
MIN_PLACES = 20
"""Places below which what their rows share can't be told."""
MIN_ROWS = 1.5
"""Mean number of rows of a place below which rows count one by one."""


class StandardErrors(Mapping[str, float]):
    """Of a fit's unknowns by name [SI].

    Args:
        fit: The saved arm's.
        hidden: What effects that are lost in the noise add to the variance of its unknowns [SI²].
    """

    def __init__(self, fit: Fit, hidden: Mapping[str, float]):
        self._places = {name: i for i, name in enumerate(fit.problem.names)}
        own = fit.std
        more = np.sqrt([hidden.get(name, 0.0) for name in self._places])
        self._covariance, self._std = fit.covariance, np.hypot(own * dependence(fit), more)
        self._ratio = self._std / np.where(own > 0.0, own, 1.0)

    def __getitem__(self, name: str) -> float:
        return float(self._std[self._places[name]])

    def __iter__(self) -> Iterator[str]:
        return iter(self._places)

    def __len__(self) -> int:
        return len(self._places)

    def covariance(self, names: Sequence[str]) -> Float[np.ndarray, "k k"]:
        """Of some unknowns [SI²], with these standard errors."""
        mine = [self._places[n] for n in names]
        return self._covariance[np.ix_(mine, mine)] * np.outer(self._ratio[mine], self._ratio[mine])


def dependence(fit: Fit) -> Float[np.ndarray, " p"]:
    """How many times larger each standard error is where rows of one place share an error, at least 1."""
    problem, ones = fit.problem, np.ones(len(fit.problem.names))
    place = places(problem.data)
    count = int(place.max(initial=-1)) + 1
    if count < MIN_PLACES or len(place) < MIN_ROWS * count:
        return ones
    root, variance = fit.factor.root, fit.variance_factor
    scores, expected = np.zeros((count, len(root))), np.zeros((len(root), len(root)))
    for block, piece in problem.pieces(fit.x):
        if block is None:
            expected += piece.jacobian.T @ piece.jacobian
            continue
        label = np.repeat(place[block.rows], len(piece.residual) // len(block.rows))
        order = np.argsort(label, kind="stable")
        starts = np.flatnonzero(np.diff(label[order], prepend=-1))
        products = (piece.jacobian * piece.residual[:, None])[order]
        scores[label[order][starts]] += np.add.reduceat(products, starts)
    inner = np.eye(root.shape[1]) - root.T @ expected @ root  # of the rows alone: rootᵀ A root is 1
    mine = scores @ root
    shared = mine.T @ mine * count / (count - 1.0) - variance * inner
    more = np.einsum("pi,ij,pj->p", root, shared, root, optimize=True)
    own = variance * (root**2).sum(1)
    return np.sqrt(1.0 + np.maximum(more, 0.0) / np.where(own > 0.0, own, np.inf))


def places(data: Dataset) -> Int[np.ndarray, " rows"]:
    """Number of every row's place: its group, or else its posture within its session."""
    if data.group is not None:
        return np.unique(data.group, return_inverse=True)[1]
    session = np.zeros(len(data)) if data.session is None else np.unique(data.session, return_inverse=True)[1]
    key = np.column_stack([session, np.round(data.q / REPEATED)])
    return np.unique(key, axis=0, return_inverse=True)[1].ravel()
