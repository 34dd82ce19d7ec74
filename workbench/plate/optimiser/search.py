"""Search: exchange among candidates, then polish, for the smallest predicted error in the region.

The exchange replaces one target at a time by the candidate that lowers the criterion most among those that
are far enough from the other targets and free of collisions, until a round changes nothing. The polish is the
same exchange with ever smaller changes of the current targets as candidates, in the same branch. Neither ever
raises the criterion

    tr W (G + P)⁻¹,      P = 1/σ_vague²: a very weak prior.

P makes sets below full rank comparable; results are evaluated without it. With C = (G + P)⁻¹ of the targets
that stay and B_j the whitened rows of candidate j, Woodbury's identity gives the criterion with the candidate
added,

    tr W (C⁻¹ + B_jᵀB_j)⁻¹ = tr W C − tr (I + B_j C B_jᵀ)⁻¹ (B_j C W C B_jᵀ),

so that all candidates cost two products with C and C W C and one small factorisation each.

Sources: Fedorov, Theory of Optimal Experiments (1972), §3; Meyer & Nachtsheim, Technometrics 37(1), 1995.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from workbench.arm.inverse.branch_names import plain_names
from workbench.arm.inverse.follow import follow_many
from workbench.arm.inverse.reduced_arm import compile_arm
from workbench.base.progress import cancelled, progress
from workbench.plate.exchange import Exchange
from workbench.plate.optimiser.candidates import Candidates, Neighbours, Setting
from workbench.plate.optimiser.target_blocks import tool_poses_at

VAGUE = 3.0
"""Standard deviation of a constant before anything is measured, as the tool feels it [m]: next to nothing is
known, but enough to tell sets apart that leave something open."""
BETTER = 1e-6
"""An exchange must lower the criterion by more than this share."""
POLISH_STEP_SIZES = (1.0, 0.7, 0.5, 0.35, 0.25, 0.17, 0.12, 0.08, 0.06, 0.04)
"""Sizes of the polish's successive changes, in units of `CHANGE`."""
CHANGE = np.array([0.05, 0.05, 0.03, np.deg2rad(12.0), np.deg2rad(40.0), np.deg2rad(40.0)])
"""Standard deviation of the changes of u, v, h [m], tilt, azimuth, spin [rad]."""
VARIANTS = 100
"""Number of changes of a target tried at once."""


@dataclass(frozen=True, eq=False)
class Search:
    """One search.

    Args:
        setting: Everything that it does not change.
        weight: W: mean square position error over the region per covariance of scaled parameters [m²].
    """

    setting: Setting
    weight: Float[np.ndarray, "p p"]
    rng: np.random.Generator

    def cost(self, rows: Float[np.ndarray, "targets m p"]) -> float:
        """The criterion of a set [m²]."""
        return float((self._covariance(rows) * self.weight).sum())

    def exchange(self, near: Neighbours) -> Exchange:
        """Among candidates that may stand on one plate."""
        rows = near.pool.rows

        def costs(chosen: list[int], slot: int) -> Float[np.ndarray, " options"]:
            others = chosen[:slot] + chosen[slot + 1 :]
            covariance = self._covariance(rows[others])
            found = float((covariance * self.weight).sum()) - gains(rows, covariance, self.weight)
            return np.where(near.options(slot, others), found, np.inf)

        return Exchange(costs, lambda chosen: self.cost(rows[chosen]), near.clear, BETTER)

    def drawn(self, near: Neighbours) -> Exchange:
        """The same with random costs, for a start."""

        def costs(chosen: list[int], slot: int) -> Float[np.ndarray, " options"]:
            return np.where(near.options(slot, chosen), -self.rng.uniform(size=len(near.pool)), np.inf)

        return replace(self.exchange(near), costs=costs)

    def polish(self, targets: Candidates, locked: int = 0) -> Candidates:
        """Move every target slightly where that lowers the criterion; the first ones are locked."""
        moves = [(step, slot) for step in POLISH_STEP_SIZES for slot in range(locked, len(targets))]
        for k, (step, slot) in enumerate(moves):
            progress(k / len(moves), "moving the targets slightly")
            if cancelled():
                break
            pool = Candidates.joined(targets, self._variants(targets, slot, step))
            chosen, near = list(range(len(targets))), Neighbours(self.setting, pool)
            self.exchange(near).improve(chosen, slot, self.cost(targets.rows))
            targets = pool.take(np.array(chosen))
        return targets

    def _variants(self, targets: Candidates, slot: int, step: float) -> Candidates:
        """Small changes of a target that keep their constraints, in its branch."""
        changes = self.rng.normal(0.0, step * CHANGE, (VARIANTS, 6))
        changes *= self.rng.uniform(size=changes.shape) < 0.5
        setting, robot = self.setting, self.setting.robot
        places = setting.blocks.makeable(targets.places[slot] + changes, setting.half)
        poses = robot.base.pose @ tool_poses_at(setting.plate, places)
        followed = follow_many(robot, poses, np.tile(targets.q[slot], (VARIANTS, 1)))
        met = followed.converged
        arm = compile_arm(self.setting.robot)
        *each, own = plain_names(arm, np.concatenate([followed.q[met], targets.q[slot][None]]))
        met[met] = [name == own for name in each]
        names = np.full(int(met.sum()), targets.branches[slot])
        return self.setting.examine(places[met], followed.q[met], names)[0]

    def _covariance(self, rows: Float[np.ndarray, "targets m p"]) -> Float[np.ndarray, "p p"]:
        flat = rows.reshape(-1, rows.shape[2])
        return np.linalg.inv(flat.T @ flat + VAGUE**-2 * np.eye(rows.shape[2]))


def gains(
    blocks: Float[np.ndarray, "options r p"],
    covariance: Float[np.ndarray, "p p"],
    weight: Float[np.ndarray, "p p"],
) -> Float[np.ndarray, " options"]:
    """Decrease of tr(weight · covariance) by each candidate.

    Args:
        blocks: Whitened rows of each candidate.
        covariance: C of the remaining targets.
        weight: W.
    """
    flat, across = blocks.reshape(-1, blocks.shape[2]), blocks.transpose(0, 2, 1)
    spread = (flat @ covariance).reshape(blocks.shape) @ across
    felt = (flat @ (covariance @ weight @ covariance)).reshape(blocks.shape) @ across
    return (np.linalg.inv(np.eye(blocks.shape[1]) + spread) * felt).sum((1, 2))  # trace: both are symmetric
