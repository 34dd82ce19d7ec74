"""Whether a column parts rows that have no arm, or no base and tool, in common: two robots in one file."""

import re

import numpy as np
from jaxtyping import Bool, Float

from workbench.base.advice import beside
from workbench.base.remedy import remedy
from workbench.data.dataset import Dataset
from workbench.data.postures import repeats
from workbench.data.readers.column_meanings import CHOOSE_ON_PAGE
from workbench.identification.fit import Fit

MIN_PART, MANY = 10, 100
"""Minimum number of rows of a part, and the number that is enough."""
PARTED, ALIKE = 0.5, 1.3
"""Ratio of errors that parts by themselves leave at most, and up to which base and tool alone explain it."""
LOOSER = 0.1
"""Factor of the prior's weight: the noise that it was weighed against was found with all parts together."""


@beside("columns that part the rows", "")
def parted_by_column(fit: Fit, data: Dataset) -> str:
    """`rows with the same 'robot' need constants of their own, which leave A 5 %, B 6 % of …`, or empty.

    Errors are predicted from the other rows, to first order about the fit: parts drawn by lot are predicted
    worse by themselves, since fewer rows determine as many constants.

    Args:
        fit: Fit to most of the rows.
        data: They and those that were excluded as outliers.
    """
    columns = dict(data.unread)
    if data.session is not None and len(data.sessions) > 1:
        columns["session"] = data.session
    if not columns or data.readings is not None:
        return ""
    problem = fit.problem.again(data=data)
    if problem.names != fit.problem.names:
        return ""
    residual, jacobian = (part[: problem.size] for part in problem.evaluate(fit.x))
    prior, posture = fit.problem.prior, repeats(data)
    pull = prior @ (fit.problem.prior_centre - fit.x)
    frames = np.array([re.split(r"[.[]", name)[0] in ("base", "tool") for name in problem.names])
    for heading, cells in columns.items():
        rows = {value: np.flatnonzero(cells == value) for value in dict.fromkeys(cells.tolist())}
        rows = {value: own[np.unique(posture[own], return_index=True)[1]] for value, own in rows.items()}
        rows = {value: own[:: 1 + len(own) // MANY] for value, own in rows.items() if len(own) >= MIN_PART}
        if len(rows) < 2:
            continue
        parts = np.array([np.isin(problem.component_rows, own) for own in rows.values()])
        used = parts.any(0) & (problem.inverse_sigma > 0.0)
        known = residual[used], jacobian[used], parts[:, used], prior, pull
        kinds = np.array([frames & False, frames, frames | True])
        together, moved, apart = (_predicted(*known, own) for own in kinds)
        is_moved = moved @ moved < ALIKE**2 * (apart @ apart)
        best = moved if is_moved else apart
        if best @ best > PARTED**2 * (together @ together):
            continue
        sizes = [np.sqrt(np.mean(np.square(off))) for off in (*(best[p] for p in parts[:, used]), together)]
        each = zip(rows, sizes, strict=False)
        shares = [f"{value or 'blank'} {size / sizes[-1]:.0%}" for value, size in each]
        said = remedy(f"give columns='session={heading}' (--columns)", page=f"{CHOOSE_ON_PAGE}: session")
        own = "a base and tool" if is_moved else "constants"
        return (
            f"rows with the same '{heading}' need {own} of their own, which leave {', '.join(shares[:4])} of "
            f"the error that they have together: {said if is_moved else 'another arm? fit them one by one'}"
        )
    return ""


def _predicted(
    residual: Float[np.ndarray, " m"],
    jacobian: Float[np.ndarray, "m p"],
    parts: Bool[np.ndarray, "parts m"],
    prior: Float[np.ndarray, "k p"],
    pull: Float[np.ndarray, " k"],
    own: Bool[np.ndarray, " p"],
) -> Float[np.ndarray, " m"]:
    """Residuals as predicted from the other rows, if every part has some unknowns of its own."""

    def spread(matrix: np.ndarray, parts: np.ndarray) -> np.ndarray:
        return np.concatenate([matrix[:, ~own], *(part[:, None] * matrix[:, own] for part in parts)], axis=1)

    count, looser = len(parts), LOOSER / np.sqrt(len(parts))
    known = spread(np.tile(prior, (count, 1)), np.repeat(np.eye(count), len(prior), axis=1))
    whole = np.concatenate([spread(jacobian, parts), looser * known])
    wanted = np.concatenate([residual, looser * np.tile(pull, count)])
    whole /= np.maximum(np.linalg.norm(whole, axis=0), 1e-12)
    values, vectors = np.linalg.eigh(whole.T @ whole)
    seen = values > 1e-12 * values[-1]
    basis = whole @ (vectors[:, seen] / np.sqrt(values[seen]))
    left = wanted - basis @ (basis.T @ wanted)
    return (left / np.maximum(1.0 - (basis**2).sum(1), 1e-3))[: len(residual)]
