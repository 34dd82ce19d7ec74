"""Residuals along the motion of every joint, and the laws of effects plotted over them.

A vector at the tool is projected onto the direction in which the tool moves when one joint moves: an error
that a joint makes shows as a curve over its own position.
"""

from functools import lru_cache

import numpy as np
from jaxtyping import Float

from workbench.arm.effects import AbstractEffect
from workbench.arm.kinematics.forward import geometric_jacobian
from workbench.arm.robot import Robot
from workbench.base.errors import WorkbenchError
from workbench.data.dataset import Dataset
from workbench.data.prediction import predict
from workbench.diagnosis.result import Diagnosis
from workbench.session.comparison import into_base
from workbench.session.state import Session

MIN_LEVER = 0.005
"""Motion of the tool [m/rad] below which a row tells nothing along a joint."""
MAX_LAW_ROWS = 300
"""Rows at which laws are worked out; of more, evenly chosen ones."""
NO_LAW = "none"


def along_joints(
    robot: Robot, q: Float[np.ndarray, "rows n"], vectors: Float[np.ndarray, "rows k 3"]
) -> Float[np.ndarray, "rows n k"]:
    """Vectors at the tool laid along each joint's motion [m]; NaN where the joint hardly moves the tool.

    Args:
        robot: The arm.
        q: Joint positions [rad or m].
        vectors: Along the axes of the robot's base [m].
    """
    directions = robot.base.pose[:3, :3].T @ geometric_jacobian(robot, q)[:, :3]
    length = np.linalg.norm(directions, axis=1, keepdims=True)
    unit = np.divide(directions, length, out=np.full_like(directions, np.nan), where=length > MIN_LEVER)
    return np.einsum("rxn,rkx->rnk", unit, vectors)


def shown_effect(session: Session) -> AbstractEffect | None:
    """The effect whose law is shown: the chosen one, or the strongest cause; None where there is none."""
    found, wanted = session.results.diagnosis, session.choices.overlay.law
    if found is None or wanted == NO_LAW:
        return None
    known = {accepted.effect.label: accepted.effect for accepted in found.effects}
    causes = [effect for cause in found.causes for effect in cause.effects]
    return known.get(wanted) or (causes[0] if causes else None)


@lru_cache(maxsize=4)
def law_along_joints(
    found: Diagnosis, label: str
) -> tuple[Float[np.ndarray, "rows n"], Float[np.ndarray, "rows n"]] | None:
    """Joint positions of some rows, and what a found effect does there along every joint's motion [m].

    None where that can't be told.
    """
    arm, data = found.after_fit.calibrated, found.after_fit.problem.data
    some = np.linspace(0, len(data) - 1, min(len(data), MAX_LAW_ROWS))
    data = data.take(np.unique(some.round().astype(int)))
    without = arm.with_effects(*(e for e in arm.effects if e.label != label))
    if data.position is None or len(without.effects) == len(arm.effects):
        return None
    try:
        moved = _positions(arm, data) - _positions(without, data)
    except WorkbenchError:  # it needs what these rows don't tell
        return None
    turned = into_base(arm, data)[:, :3, :3]
    vectors = np.einsum("rij,rj->ri", turned, moved)[:, None]
    return data.q, along_joints(arm.with_effects(), data.q, vectors)[..., 0]


def _positions(robot: Robot, data: Dataset) -> Float[np.ndarray, "rows 3"]:
    return predict(robot, data)[:, :3, 3]
