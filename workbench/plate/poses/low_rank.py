"""Low-rank algebra of choosing measurements: what one more, or one less, does to log det of the information.

With C the inverse of the information and V_j = B_j C B_jᵀ of every candidate's block B_j, the determinant
grows by det(I + V_j) when j is taken in. C and all V_j follow each change by a product with C B_jᵀ; nothing
is inverted but matrices of one block's size. The loops over candidates are compiled.

Source: Harville, Matrix Algebra from a Statistician's Perspective (1997), §18.1, §18.2.
"""

from typing import no_type_check

import numpy as np
from jaxtyping import Float
from numba import njit

RIDGE = 1e-10
"""Information known beforehand, as a share of the candidates' mean."""


def prior(blocks: Float[np.ndarray, "options r p"]) -> Float[np.ndarray, "p p"]:
    """Information known beforehand, so that C exists before the first measurement."""
    count, _, size = blocks.shape
    return RIDGE * (blocks**2).sum() / (count * size) * np.eye(size)


def flattened(blocks: Float[np.ndarray, "options r p"]) -> Float[np.ndarray, "rows p"]:
    """All rows of all candidates, for one product with C."""
    return np.ascontiguousarray(blocks.reshape(-1, blocks.shape[2]))


def spreads(
    blocks: Float[np.ndarray, "options r p"],
    flat: Float[np.ndarray, "rows p"],
    inverse: Float[np.ndarray, "p p"],
) -> Float[np.ndarray, "options r r"]:
    """V_j = B_j C B_jᵀ of every candidate."""
    return _products((flat @ inverse).reshape(blocks.shape), blocks)


def take_in(
    blocks: Float[np.ndarray, "options r p"],
    flat: Float[np.ndarray, "rows p"],
    inverse: Float[np.ndarray, "p p"],
    spread: Float[np.ndarray, "options r r"],
    new: int,
) -> Float[np.ndarray, "p p"]:
    """C with one more block; every V_j is updated in place."""
    count, rows, _ = blocks.shape
    reach = inverse @ blocks[new].T
    middle = -np.linalg.inv(np.eye(rows) + blocks[new] @ reach)
    add(spread, (flat @ reach).reshape(count, rows, rows), middle)
    return inverse + reach @ middle @ reach.T


@njit(cache=True)
@no_type_check
def _products(left, right):
    """L_j R_jᵀ of every candidate."""
    count, rows, size = left.shape
    result = np.empty((count, rows, rows))
    for j in range(count):
        for i in range(rows):
            for k in range(rows):
                total = 0.0
                for m in range(size):
                    total += left[j, i, m] * right[j, k, m]
                result[j, i, k] = total
    return result


@njit(cache=True)
@no_type_check
def growths(spread, cross, middle):
    """det(I + V_j + W_j S W_jᵀ) of every candidate, by elimination without pivots (the matrix is s.p.d.)."""
    count, rows = spread.shape[0], spread.shape[1]
    result = np.empty(count)
    a = np.empty((rows, rows))
    half = np.empty((rows, rows))
    for j in range(count):
        _sandwich(cross[j], middle, half, a)
        for i in range(rows):
            for k in range(rows):
                a[i, k] += spread[j, i, k]
            a[i, i] += 1.0
        determinant = 1.0
        for i in range(rows):
            determinant *= a[i, i]
            for k in range(i + 1, rows):
                factor = a[k, i] / a[i, i]
                for m in range(i + 1, rows):
                    a[k, m] -= factor * a[i, m]
        result[j] = determinant
    return result


@njit(cache=True)
@no_type_check
def add(spread, cross, middle):
    """V_j += W_j S W_jᵀ for every candidate, in place."""
    rows = spread.shape[1]
    a = np.empty((rows, rows))
    half = np.empty((rows, rows))
    for j in range(spread.shape[0]):
        _sandwich(cross[j], middle, half, a)
        for i in range(rows):
            for k in range(rows):
                spread[j, i, k] += a[i, k]


@njit(cache=True)
@no_type_check
def _sandwich(w, s, half, out):
    """W S Wᵀ into out."""
    rows = w.shape[0]
    for i in range(rows):
        for k in range(rows):
            total = 0.0
            for m in range(rows):
                total += w[i, m] * s[m, k]
            half[i, k] = total
    for i in range(rows):
        for k in range(rows):
            total = 0.0
            for m in range(rows):
                total += half[i, m] * w[k, m]
            out[i, k] = total
