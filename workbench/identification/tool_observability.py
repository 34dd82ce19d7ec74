"""Observability of the tool in a fit, for the record of its calibration (`arm/calibration_record.py`), and
its expected errors at poses like the measured ones and elsewhere.

From the rows: twists of the tool, in base axes and in its own, that change no measured number are
unobservable (a point shows no rotation, two markers none about their line, a plane no motion along itself).
From the covariance: how far the uncertainty of the identified constants moves tool and flange at the measured
poses. The flange counts after the best constant change of the base, the tool after that of base and tool:
rows can't tell the last joint's zero and length from the places of reflectors, and need not.

If all rows share one elbow branch or one region, some combination of constants may be so uncertain that the
model is good only near them; comparing the expected errors near and anywhere shows this. Where rows show no
base, like touches of places that nobody measured, both are those after the best constant motion of base and
tool: the rest, such as the arm's scale, stays.
"""

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from jaxtyping import Float
from scipy import linalg

from workbench.arm.calibration_record import Expected, Observed, representative_rows
from workbench.arm.frame import FRAME_PARTS, Frame
from workbench.arm.gravity import GRAVITY
from workbench.arm.kinematics.forward import identification_jacobian
from workbench.arm.motion import Motion
from workbench.base import se3
from workbench.base.types import Matrix3, frozen

if TYPE_CHECKING:
    from workbench.identification.fit import Fit

LEVER = 0.1
"""Lever that converts rotations of the tool to displacements [m]."""
MIN_INFORMATION = 1e-6
"""Minimum information on a direction, relative to its channel's, for it to be observable."""
JOINT_SPACE_POSES = 400
"""Number of random poses that represent the whole joint space."""


class Transfer(NamedTuple):
    """Expected errors at poses like the measured ones, and anywhere within the joint limits."""

    near: Expected
    anywhere: Expected


def transfer(fit: "Fit", *, rng: np.random.Generator) -> Transfer:
    """Expected errors near the fitted rows and at random joint positions within the limits.

    Drivers of effects (load, temperature …) are those of the rows.
    """
    lower, upper = fit.problem.robot.search_limits.T
    near = Motion.of(fit.problem.data)
    anywhere = near.take(rng.integers(0, len(near), JOINT_SPACE_POSES))
    anywhere = replace(anywhere, q=rng.uniform(lower, upper, (JOINT_SPACE_POSES, len(lower))))
    is_aligned = not fit.problem.sees_base
    return Transfer(*(expected_error(fit, rows, is_aligned=is_aligned) for rows in (near, anywhere)))


def observed_by(fit: "Fit") -> Observed:
    """Observability of the tool in a fit."""
    position, rotation = _directions(fit)
    motion = Motion.of(fit.problem.data).take(representative_rows(fit.problem.data.q))
    tool, flange = (expected_error(fit, motion, at_flange=place) for place in (False, True))
    return Observed(position=position, rotation=rotation, tool=tool, flange=flange, q=frozen(motion.q))


def expected_error(
    fit: "Fit", motion: Motion, *, at_flange: bool = False, is_aligned: bool = True
) -> Expected:
    """Displacement of tool or flange due to the covariance, in the first session after all events, as saved.

    Args:
        at_flange: Whether of the flange, in place of the tool.
        is_aligned: Whether less a constant motion of the base; of the tool less one of the tool, too, as that
            may stand elsewhere.
    """
    session = fit.problem.data.sessions[0]
    arm = fit.arm.in_session(session)
    arm = arm.with_frames(tool=Frame()) if at_flange else arm
    loads = (*arm.inertia, *GRAVITY) if arm.effects else ()
    fixed = {f"tool.{part}" for part in FRAME_PARTS if at_flange}
    moves = {*arm.chain.index, *arm.coefficients, *loads} - fixed
    plain = (name.replace(f"[{session}]", "") for name in fit.problem.names)
    own = {place: name for place, name in enumerate(plain) if name in moves}
    poses, twists = identification_jacobian(arm, replace(motion, row=None), tuple(own.values()))
    covariance = fit.covariance[np.ix_([*own], [*own])]
    turned, still = poses[:, :3, :3], np.tile(np.eye(3), (len(poses), 1, 1))
    rigid = [still, -se3.skew(poses[:, :3, 3])]
    constant = (rigid, []) if at_flange else ([*rigid, turned], [still, turned])
    constant = constant if is_aligned else ([], [])
    parts = ((twists[:, k : k + 3], columns) for k, columns in zip((0, 3), constant, strict=True))
    return Expected(*(_left(field, columns, covariance) for field, columns in parts))


def _left(field: Float[np.ndarray, "rows 3 k"], columns: list[np.ndarray], covariance: np.ndarray) -> float:
    """Root mean square of a field with this covariance of its k sizes, less its part along other columns."""
    left = field.reshape(3 * len(field), field.shape[2])
    if columns:
        basis = linalg.orth(np.concatenate(columns, axis=2).reshape(len(left), -1), rcond=1e-9)
        left = left - basis @ (basis.T @ left)
    return float(np.sqrt(max(((left @ covariance) * left).sum(), 0.0) / len(field)))


def _directions(fit: "Fit") -> tuple[int, int]:
    """Number of directions of the tool's position and orientation that are observable."""
    problem, x = fit.problem, fit.x
    information = np.zeros((2, 6, 6))
    for block in problem.blocks:
        if block.observation.link is not None:
            continue
        poses = block.poses(x)
        part = block.observation.linearise(poses, block.unknown(x))
        by_twist = problem.whiten(block, part.by_twist) / np.repeat([1.0, LEVER], 3)
        turned = np.einsum("rmak,rkj->rmaj", by_twist.reshape(*by_twist.shape[:2], 2, 3), poses[:, :3, :3])
        for k, table in enumerate((by_twist, turned.reshape(by_twist.shape))):
            information[k] += np.einsum("rmi,rmj->ij", table, table)
    position, rotation = slice(3), slice(3, 6)
    sees = min(_rank(i[position, position], i[position, position]) for i in information)
    known = np.linalg.pinv(information[:, position, position], rcond=MIN_INFORMATION)
    cross, own = information[:, rotation, position], information[:, rotation, rotation]
    left = own - cross @ known @ np.swapaxes(cross, 1, 2)  # where positions are unknown
    return sees, min(map(_rank, left, own))


def _rank(information: Matrix3, of: Matrix3) -> int:
    return int((np.linalg.eigvalsh(information) > MIN_INFORMATION * np.trace(of)).sum())
