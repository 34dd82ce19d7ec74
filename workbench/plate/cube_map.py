"""Map over the cubes of a region: reachability, observability, and accuracy after calibration.

Every cube is evaluated at its centre in several orientations of the tool. Of the reachable ones, the posture
with the highest index O (ARIA eq. 17) represents the cube, as in the paper's workspace clustering (ARIA
§4.2).
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from workbench.arm.kinematics.forward import identification_jacobian
from workbench.arm.kinematics.reachable import reachable
from workbench.arm.linearisation import Linearisation
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.progress import check_cancelled, progress
from workbench.base.types import frozen
from workbench.plate.observability import inverse_condition
from workbench.plate.predicted_error import UNSEEN
from workbench.plate.region import Region

POSES_PER_CHECK = 2000
"""Number of poses solved between two checks of `cancelled`."""


@dataclass(frozen=True, eq=False, kw_only=True)
class CubeMap:
    """Data of every cube of a region, in the order of `Region.centres`.

    Args:
        names: The parameters of index and errors.
        reached: Number of tried orientations in which the centre is reached.
        tried: Number of orientations tried.
        index: Highest index O there; NaN where not reached.
        q: The posture with that index [rad or m]; NaN where not reached.
        moves: Motion of the tool's position per parameter there [m per unit]; zero where not reached.
    """

    region: Region
    names: tuple[str, ...]
    reached: Int[np.ndarray, " cubes"]
    tried: int
    index: Float[np.ndarray, " cubes"]
    q: Float[np.ndarray, "cubes n"]
    moves: Float[np.ndarray, "cubes 3 p"]

    def __len__(self) -> int:
        return len(self.reached)

    def errors(self, linearisation: Linearisation | None) -> Float[np.ndarray, " cubes"]:
        """Expected root mean square position error in each cube after these measurements [m].

        NaN where the cube is not reached, infinite where the measurements, if any, don't determine it.
        """
        if linearisation is None:
            return np.where(self.reached > 0, np.inf, np.nan)
        rank = linearisation.rank()
        _, values, vt = linearisation.factors
        root = (vt[:rank] / values[:rank, None]) * linearisation.weights
        flat = self.moves.reshape(-1, len(self.names))
        spread = flat @ root.T
        variance = np.einsum("ij,ij->i", spread, spread).reshape(-1, 3).sum(1)
        errors = np.where(self.reached > 0, np.sqrt(variance), np.nan)
        if rank < len(self.names):
            blind = np.abs(flat * linearisation.weights @ linearisation.unidentifiable) > UNSEEN
            errors[blind.reshape(len(self), -1).any(1)] = np.inf
        return errors


def map_cubes(
    robot: Robot, region: Region, rotations: Float[np.ndarray, "orientations 3 3"], *, names: tuple[str, ...]
) -> CubeMap:
    """Evaluate every cube of a region.

    Args:
        rotations: Orientations of the tool that are tried at every centre, robot's base.
        names: Parameters of index and errors.
    """
    tried, cubes = len(rotations), len(region.centres)
    step = max(POSES_PER_CHECK // tried, 1)
    found = []
    for start in range(0, cubes, step):
        check_cancelled()
        places = np.repeat(region.centres[start : start + step], tried, axis=0)
        turns = np.tile(rotations, (len(places) // tried, 1, 1))
        mask, q_tried = reachable(robot, robot.base.pose @ se3.pose(turns, places))
        found.append(_best(robot, names, mask, q_tried, tried))
        progress(min(start + step, cubes) / cubes, "solving for every cube")
    reached, index, q, moves = (frozen(np.concatenate(part)) for part in zip(*found, strict=True))
    return CubeMap(region=region, names=names, reached=reached, tried=tried, index=index, q=q, moves=moves)


def _best(robot: Robot, names: tuple[str, ...], mask: np.ndarray, q_tried: np.ndarray, tried: int):
    """Of the tried orientations of each cube the one with the highest index, with its motion."""
    _, twists = identification_jacobian(robot, Motion(np.where(mask[:, None], q_tried, 0.0)), names)
    index = np.where(mask, inverse_condition(twists), -np.inf).reshape(-1, tried)
    best = index.argmax(1) + tried * np.arange(len(index))
    reached = mask.reshape(-1, tried).sum(1)
    seen = reached > 0
    return (
        reached,
        np.where(seen, index.max(1), np.nan),
        np.where(seen[:, None], q_tried[best], np.nan),
        np.where(seen[:, None, None], twists[best, :3], 0.0),
    )
