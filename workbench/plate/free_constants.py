"""Free constants: those that a calibration identifies, and those that are observable at all.

A free base and the first joint's zero are confounded, and so are a free tool and the last joint's zero: no
measurements can separate them. Indices of the whole parameter vector would all be zero. They are therefore
computed in an orthonormal basis of the combinations that are observable with generic poses. If all are,
nothing changes.
"""

from dataclasses import replace
from functools import lru_cache

import numpy as np
from jaxtyping import Float

from workbench.arm.frame import FRAME_PARTS
from workbench.arm.linearisation import Linearisation, linearise
from workbench.arm.robot import Robot
from workbench.base.errors import RobotError
from workbench.base.types import Freedom, frozen
from workbench.plate.poses.sampling import random_poses

GENERIC_POSES = 60
"""Number of random poses that represent all possible measurements."""


def identified_names(robot: Robot, *, base: bool | None = None, tool: bool | None = None) -> tuple[str, ...]:
    """Constants that a calibration identifies: the arm's free ones, and the frames that are unknown.

    Args:
        base: Whether its base in the measuring frame is unknown; as its file says if None.
        tool: Whether the tool is unknown; as its file says if None.
    """
    base = robot.base.free is Freedom.FREE if base is None else base
    tool = robot.tool.free is Freedom.FREE if tool is None else tool
    unknown = [name for name, is_unknown in (("base", base), ("tool", tool)) if is_unknown]
    return (*robot.default_free, *(f"{frame}.{part}" for frame in unknown for part in FRAME_PARTS))


@lru_cache(maxsize=8)
def visible_basis(robot: Robot, names: tuple[str, ...] | None = None) -> Float[np.ndarray, "p r"] | None:
    """Observable combinations of scaled parameters, as columns; None if all are observable.

    Kept, since a drag asks for it again and again.

    Args:
        names: What is identified; the robot's default free constants if None.

    Raises:
        RobotError: nothing is.
    """
    if not (robot.default_free if names is None else names):
        where = "write free = true at its elements, or [base] or [tool] free = true"
        raise RobotError(f"robot '{robot.name}' has nothing free to identify: {where}")
    q = random_poses(robot, GENERIC_POSES, rng=np.random.default_rng(0))
    generic = linearise(robot, q, names=names)
    rank = generic.rank()
    return None if rank == len(generic.names) else frozen(generic.factors[2][:rank].T)


def visible(linearisation: Linearisation, basis: Float[np.ndarray, "p r"] | None) -> Linearisation:
    """The linearisation in a basis of combinations, in metres; unchanged without a basis."""
    if basis is None:
        return linearisation
    count = basis.shape[1]
    return replace(
        linearisation,
        jacobian=frozen(linearisation.scaled @ basis),
        names=tuple(f"combination {k + 1}" for k in range(count)),
        units=("m",) * count,
    )


def visible_weight(
    weight: Float[np.ndarray, "p p"], basis: Float[np.ndarray, "p r"] | None
) -> Float[np.ndarray, "r r"]:
    """A quadratic form of scaled parameters in the combinations of a basis."""
    return weight if basis is None else basis.T @ weight @ basis
