"""Residuals along the motion of every joint, and the laws of effects plotted over them.

A vector at the tool is projected onto the direction in which the tool moves when one joint moves: an error
that a joint makes shows as a curve over its own position.
"""

from dataclasses import replace
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
MAX_CANDIDATES = 6
"""Candidates, besides what was accepted, whose laws can be laid over the rows."""
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
    known = {effect.label: effect for effect in candidates(found)}
    causes = [effect for cause in found.causes for effect in cause.effects]
    return known.get(wanted) or (causes[0] if causes else None)


def candidates(found: Diagnosis) -> tuple[AbstractEffect, ...]:
    """Effects whose laws can be shown: what was accepted, then what was tried."""
    accepted = [a.effect for a in found.effects]
    labels = {effect.label for effect in accepted}
    tried = [r.effect for r in found.ranking if r.effect.label not in labels]
    return (*accepted, *tried[:MAX_CANDIDATES])


@lru_cache(maxsize=4)
def law_along_joints(
    found: Diagnosis, label: str
) -> tuple[Float[np.ndarray, "rows n"], Float[np.ndarray, "rows n"]] | None:
    """Joint positions of some rows, and what an effect does there along every joint's motion [m].

    An accepted effect is as it was found; another one is fitted to what the geometry leaves. None where that
    can't be done.
    """
    effect = next((e for e in candidates(found) if e.label == label), None)
    data = found.after_fit.problem.data
    rows = np.unique(np.linspace(0, len(data) - 1, min(len(data), MAX_LAW_ROWS)).round().astype(int))
    data = data.take(rows)
    if effect is None or data.position is None:
        return None
    try:
        if label in {a.effect.label for a in found.effects}:
            arm = found.after_fit.calibrated
            without = arm.with_effects(*(e for e in arm.effects if e.label != label))
            moved = _positions(arm, data) - _positions(without, data)
        else:
            arm = found.before_fit.calibrated
            moved = _fitted(arm, effect, data)
    except WorkbenchError:  # it needs what these rows don't tell
        return None
    turned = into_base(arm, data)[:, :3, :3]
    vectors = np.einsum("rij,rj->ri", turned, moved)[:, None]
    return data.q, along_joints(arm.with_effects(), data.q, vectors)[..., 0]


def _fitted(arm: Robot, effect: AbstractEffect, data: Dataset) -> Float[np.ndarray, "rows 3"]:
    """What an effect would do at the tool with the coefficients that fit what is left best [m]."""
    plain, columns = _positions(arm, data), []
    for k in range(len(effect.names)):
        unit = tuple(LINEAR_COEFFICIENT if i == k else 0.0 for i in range(len(effect.names)))
        deflected = arm.with_effects(*arm.effects, replace(effect, coefficients=unit))
        columns.append((_positions(deflected, data) - plain).ravel())
    assert data.position is not None
    left = (data.position - plain).ravel()
    basis, seen = np.stack(columns, axis=1), np.isfinite(left)
    size = np.linalg.lstsq(basis[seen], left[seen])[0]
    return (basis @ size).reshape(-1, 3)


LINEAR_COEFFICIENT = 1e-4
"""Coefficient with which a law's effect at the tool is worked out, small so that it is linear."""


def _positions(robot: Robot, data: Dataset) -> Float[np.ndarray, "rows 3"]:
    return predict(robot, data)[:, :3, 3]
