"""Pose accuracy AP and pose repeatability RP of ISO 9283 where a pose was visited several times.

With the n attained positions p_j of a command pose p_c, their barycentre p̄, and l_j = ‖p_j − p̄‖:

    AP_p = ‖p̄ − p_c‖        AP_a = ā − a_c   (likewise b, c)
    RP_l = l̄ + 3 S_l        RP_a = ±3 S_a    (likewise b, c)

S_l and S_a are standard deviations over n − 1. The command pose of a row is where the model expects the tool
at the row's joints, so that rows whose joints differ by a controller's rounding still belong together; with
equal joints these are the standard's formulae. Angles a, b, c are the turn from the command pose to the
attained one about x, y, z of the measuring frame, a rotation vector: for deviations of a degree the
standard's Euler angles differ from it in the fourth digit.

The standard's cycle visits five poses P1 … P5 in the cube of the arm's work space, 30 times each, at rated
load and speed.

Source: ISO 9283:1998, 7.2.1 (AP), 7.2.2 (RP).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.types import frozen
from workbench.base.wording import plural
from workbench.data.dataset import Dataset
from workbench.data.prediction import predict

SAME_POSE = np.deg2rad(0.02)
"""Rows of a session whose joints differ by less are visits of one pose [rad or m]."""
POSES, VISITS = 5, 30
"""Cycle of the standard."""


@dataclass(frozen=True, eq=False, kw_only=True)
class RepeatedPose:
    """One pose that was visited several times; NaN for angles that were not measured.

    Args:
        rows: Data rows of the visits.
        accuracy: AP_p [m].
        repeatability: RP_l [m].
        angle_accuracy: AP_a, AP_b, AP_c [rad].
        angle_repeatability: Halves of the intervals RP_a, RP_b, RP_c, each ±3 S [rad].
    """

    rows: Int[np.ndarray, " visits"]
    accuracy: float
    repeatability: float
    angle_accuracy: Float[np.ndarray, "3"]
    angle_repeatability: Float[np.ndarray, "3"]

    @property
    def visits(self) -> int:
        return len(self.rows)

    @classmethod
    def of(
        cls, rows: Int[np.ndarray, " n"], off: Float[np.ndarray, "n 3"], turn: Float[np.ndarray, "n 3"]
    ) -> "RepeatedPose":
        """AP and RP from deviations attained − command of at least two visits [m], [rad]."""
        length = np.linalg.norm(off - off.mean(0), axis=1)
        return cls(
            rows=frozen(rows),
            accuracy=float(np.linalg.norm(off.mean(0))),
            repeatability=float(length.mean() + 3.0 * length.std(ddof=1)),
            angle_accuracy=frozen(turn.mean(0)),
            angle_repeatability=frozen(3.0 * turn.std(0, ddof=1)),
        )


def repeated_poses(robot: Robot, data: Dataset, pose: Int[np.ndarray, " rows"]) -> tuple[RepeatedPose, ...]:
    """AP and RP of every pose with two or more measured positions, in the order of the first visit.

    Args:
        robot: The model that says where the command pose is.
        pose: Which pose each row visits, as `pose_labels` has it.
    """
    if data.position is None:
        return ()
    seen = np.isfinite(data.position).all(1)
    data, pose = data.take(seen), pose[seen]
    command = predict(robot, data)
    off = data.position - command[:, :3, 3]
    turn = np.full((len(data), 3), np.nan)
    if data.rotation is not None:
        turn = se3.matrix_to_rotvec(data.rotation @ np.swapaxes(command[:, :3, :3], 1, 2))
    order = np.argsort(pose, kind="stable")
    visits = np.split(order, np.flatnonzero(np.diff(pose[order])) + 1)
    return tuple(RepeatedPose.of(data.row[rows], off[rows], turn[rows]) for rows in visits if len(rows) > 1)


def pose_labels(data: Dataset, *, same: float = SAME_POSE) -> Int[np.ndarray, " rows"]:
    """Which pose each row visits: 0, 1 … in the order of the first visits.

    Args:
        data: Rows; those of different sessions are different poses.
        same: Maximum difference of any joint between visits of a pose [rad or m].
    """
    pairs = [np.zeros((0, 2), np.int64)]
    for session in data.sessions:
        rows = np.flatnonzero(data.in_session(session))
        near = cKDTree(data.q[rows]).query_pairs(same, p=np.inf, output_type="ndarray")
        pairs.append(rows[near])
    links = np.concatenate(pairs)
    graph = coo_matrix((np.ones(len(links)), links.T), (len(data), len(data)))
    label = connected_components(graph, directed=False)[1]
    _, first, place = np.unique(label, return_index=True, return_inverse=True)
    return np.argsort(np.argsort(first))[place]


def cycle_text(poses: Sequence[RepeatedPose]) -> str:
    """How the visits compare with the standard's cycle, in one sentence."""
    visits = [pose.visits for pose in poses]
    if not visits:
        return (
            f"no pose was visited twice, so there is no repeatability; ISO 9283 requires {POSES} poses, "
            f"{VISITS} times each"
        )
    minimum, maximum = min(visits), max(visits)
    times = f"{minimum}" if minimum == maximum else f"{minimum} to {maximum}"
    done = f"{plural(len(poses), 'pose')} visited {times} times"
    if len(poses) >= POSES and minimum >= VISITS:
        return f"{done}: the cycle of ISO 9283 ({POSES} poses, {VISITS} times each) is met"
    return f"{done}; ISO 9283 requires {POSES} poses, {VISITS} times each, so AP and RP are indications"
