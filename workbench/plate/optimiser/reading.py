"""Readings: what is read at a target, as whitened rows of an identification Jacobian.

A reading looks at the tool's pose and says how its m components change with the tool's twist [v; w] and with
unknowns of its own, such as where a ball-bar's anchor stands:

    y = B ξ + U u + noise,      ξ = J δp + e_target,      Σ = diag(σ²/visits) + B diag(σ_t²) Bᵀ

The target itself is uncertain by σ_t, as it was made or measured; repeated visits lower the noise, not that.
Rows are whitened with the Cholesky factor of Σ. Unknowns of the reading are projected out of the rows of a
whole set together with what is known of them beforehand, which is exact for a linear model (Golub & Pereyra's
variable projection).
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from workbench.arm.kinematics.forward import sensitivity
from workbench.arm.linearisation import Linearisation, linearise
from workbench.arm.robot import Robot
from workbench.base.types import frozen
from workbench.plate.plate import Kind


class Look(NamedTuple):
    """How components change: per twist of the tool (base axes, at its origin) and per unknown.

    Args:
        by_twist: [1 or m].
        by_unknown: The same for the reading's own unknowns, u of them.
    """

    by_twist: Float[np.ndarray, "rows m 6"]
    by_unknown: Float[np.ndarray, "rows m u"]


@dataclass(frozen=True, eq=False, kw_only=True)
class Reading:
    """One way to read a target.

    Args:
        name: For people.
        kind: What the target holds of the tool.
        look: Derivatives of the components at poses of the tool in the measuring frame.
        sigma: Standard deviation of every component at one visit [m or rad].
        unknown_sigma: How well each of its own unknowns is known beforehand [m].
        visits: How often each target is visited.
        blocks: Whether a block stands under each target.
    """

    name: str
    kind: Kind
    look: Callable[[Float[np.ndarray, "rows 4 4"]], Look]
    sigma: Float[np.ndarray, " m"]
    unknown_sigma: Float[np.ndarray, " u"] = field(default_factory=lambda: np.zeros(0))
    visits: int = 1
    blocks: bool = True

    def rows(
        self,
        poses: Float[np.ndarray, "rows 4 4"],
        twists: Float[np.ndarray, "rows 6 p"],
        target_sigma: Float[np.ndarray, "rows 2"],
    ) -> tuple[Float[np.ndarray, "rows m p"], Float[np.ndarray, "rows m u"]]:
        """Whitened rows per parameter and per unknown.

        Args:
            poses: Of the tool in the measuring frame.
            twists: Of the tool per parameter.
            target_sigma: How well each target is known: position [m] and rotation [rad].
        """
        by_twist, by_unknown = self.look(poses)
        made = np.repeat(target_sigma**2, 3, axis=1)
        covariance = (by_twist * made[:, None]) @ np.swapaxes(by_twist, 1, 2)
        covariance += np.diag(self.sigma**2 / self.visits)
        factor = np.linalg.cholesky(covariance)
        both = np.linalg.solve(factor, np.concatenate([by_twist @ twists, by_unknown], axis=2))
        return both[..., : twists.shape[2]], both[..., twists.shape[2] :]


def linearise_reading(
    robot: Robot,
    q: Float[np.ndarray, "rows n"],
    reading: Reading,
    *,
    target_sigma: Float[np.ndarray, "rows 2"],
    names: tuple[str, ...],
) -> Linearisation:
    """Linearisation of a set of targets, the reading's unknowns projected out.

    Args:
        robot: Geometry with base and tool.
        q: Joint positions at the targets [rad or m].
        reading: What is read there.
        target_sigma: How well each target is known [m], [rad].
        names: Constants to identify.
    """
    poses, twists = sensitivity(robot, q, names)
    jacobian, unknown = reading.rows(poses, twists, target_sigma)
    count, components = jacobian.shape[:2]
    prior = reading.unknown_sigma
    flat = np.concatenate([jacobian.reshape(-1, len(names)), np.zeros((len(prior), len(names)))])
    beside = np.linalg.qr(
        np.concatenate([unknown.reshape(count * components, len(prior)), np.diag(1.0 / prior)])
    )[0]
    like = linearise(robot, q[:1], names=names)
    return Linearisation(
        jacobian=frozen(flat - beside @ (beside.T @ flat)),
        names=names,
        units=like.units,
        sigma=frozen(np.concatenate([np.tile(reading.sigma, count), prior])),
        measurement=frozen(np.repeat(np.arange(count + 1), [components] * count + [len(prior)])),
        length=like.length,
    )
