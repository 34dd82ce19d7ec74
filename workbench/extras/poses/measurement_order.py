"""Measuring order of poses: short moves from each to the next.

The length of a move is the largest joint travel, as all joints move together. The path through all poses with
the smallest total length is approximated by the best nearest-neighbour path, improved by 2-opt.

Source: Croes, Operations Research 6(6), 1958 (2-opt).
"""

import numpy as np
from jaxtyping import Float, Int


def measuring_order(q: Float[np.ndarray, "rows n"]) -> Int[np.ndarray, " rows"]:
    """An order of poses with short moves; its total length never exceeds that of the given order."""
    moves = np.abs(q[:, None] - q[None]).max(2)

    def length(path: np.ndarray) -> float:
        return float(moves[path[:-1], path[1:]].sum())

    paths = sorted((np.arange(len(q)), *(_nearest_first(moves, k) for k in range(len(q)))), key=length)
    return min((_two_opt(moves, path) for path in paths[:3]), key=length)


def _nearest_first(moves: np.ndarray, start: int) -> np.ndarray:
    path, left = [start], np.ones(len(moves), bool)
    left[start] = False
    while left.any():
        nearest = int(np.argmin(np.where(left, moves[path[-1]], np.inf)))
        path.append(nearest)
        left[nearest] = False
    return np.array(path)


def _two_opt(moves: np.ndarray, path: np.ndarray) -> np.ndarray:
    """2-opt of an open path: reverse the best stretch until none shortens it."""
    count = len(path)
    if count < 3:
        return path
    first, last = np.triu_indices(count, 1)
    while True:
        # the ends of the path have no neighbour: nothing is cut there, and nothing joined
        before, after = np.maximum(first - 1, 0), np.minimum(last + 1, count - 1)
        a, b, c, d = path[before], path[first], path[last], path[after]
        gain = (moves[a, b] - moves[a, c]) * (first > 0) + (moves[c, d] - moves[b, d]) * (last < count - 1)
        best = int(np.argmax(gain))
        if gain[best] <= 1e-9:
            return path
        i, k = first[best], last[best]
        path = np.concatenate([path[:i], path[i : k + 1][::-1], path[k + 1 :]])
