"""What visits of fresh poses show of an arm: AP and RP of ISO 9283, and intervals.

With the n attained positions p_j of a command pose p_c, their barycentre p̄, and l_j = ‖p_j − p̄‖:

    AP = ‖p̄ − p_c‖,        RP = l̄ + 3 S_l,        S_l the standard deviation over n − 1

The command pose of a row is where the model expects the tool at the row's joints, so that rows whose joints
differ by a controller's rounding still belong together.

The interval of a mean comes from a bootstrap that draws all visits of a pose together, and whole groups where
the data have them. Where m of n poses keep a limit at every visit, the share of all poses that keep it is at
least the Clopper–Pearson bound, whatever the errors' distribution.

Sources: ISO 9283:1998, 7.2; Efron, Tibshirani, An Introduction to the Bootstrap, 1993, ch. 13; Clopper,
Pearson, Biometrika 26, 1934.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy import special
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from workbench.base.types import frozen
from workbench.data.dataset import Dataset

SAME_POSE = np.deg2rad(0.06)
"""Rows of a session whose joints differ by less are visits of one pose [rad or m]."""
CONFIDENCE = 0.95
DRAWS, PIECE = 2000, 100


@dataclass(frozen=True, eq=False, kw_only=True)
class RepeatedPose:
    """One pose that was visited several times.

    Args:
        rows: Data rows of the visits.
        accuracy: AP [m].
        repeatability: RP [m].
    """

    rows: Int[np.ndarray, " visits"]
    accuracy: float
    repeatability: float

    @classmethod
    def of(cls, rows: Int[np.ndarray, " n"], off: Float[np.ndarray, "n 3"]) -> "RepeatedPose":
        """AP and RP from deviations attained − command of at least two visits [m]."""
        length = np.linalg.norm(off - off.mean(0), axis=1)
        repeatability = float(length.mean() + 3.0 * length.std(ddof=1))
        accuracy = float(np.linalg.norm(off.mean(0)))
        return cls(rows=frozen(rows), accuracy=accuracy, repeatability=repeatability)


def pose_labels(data: Dataset) -> Int[np.ndarray, " rows"]:
    """Which pose each row visits: 0, 1 … in the order of the first visits, other ones in each session."""
    session = np.zeros(len(data)) if data.session is None else np.unique(data.session, return_inverse=True)[1]
    links = cKDTree(np.column_stack([data.q, session])).query_pairs(
        SAME_POSE, p=np.inf, output_type="ndarray"
    )
    graph = coo_matrix((np.ones(len(links)), links.T), (len(data), len(data)))
    return connected_components(graph, directed=False)[1]


def mean_interval(
    errors: Float[np.ndarray, " rows"], group: np.ndarray, rng: np.random.Generator
) -> tuple[float, float]:
    """Where the mean of all errors like these lies, low and high.

    Args:
        group: Label of what is drawn together: the pose that a row visits, or the data's own groups.
    """
    label = np.unique(group, return_inverse=True)[1]
    sums = np.stack([np.bincount(label), np.bincount(label, errors)], 1)
    even = np.full(len(sums), 1.0 / len(sums))
    pieces = [rng.multinomial(len(sums), even, PIECE) @ sums for _ in range(DRAWS // PIECE)]
    rows, total = np.concatenate(pieces).T
    low, high = np.quantile(total / rows, [0.5 - 0.5 * CONFIDENCE, 0.5 + 0.5 * CONFIDENCE])
    return float(low), float(high)


def minimum_share(within: int, poses: int) -> float:
    """Share of all poses that keep a limit, at least, with 95 % confidence, if so many of some poses do."""
    return float(special.betaincinv(within, poses - within + 1, 1.0 - CONFIDENCE)) if within else 0.0
