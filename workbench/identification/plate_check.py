"""A real plate compared with its drawing: which of its blocks is not where it should be (ARIA §4.1.2).

A calibrated arm visits every target of the real plate; forward kinematics says where each one is. Two
things may be wrong: the whole plate was put down elsewhere (a rigid motion X that moves all targets), or
single blocks were made or mounted wrongly. With y the deviations of all targets, A their change with a
small motion ξ of the plate and Σ their covariance,

    y = A ξ + displaced blocks + noise,      Σ = J C Jᵀ + diag(σ²),      M = Σ⁻¹ − Σ⁻¹A (AᵀΣ⁻¹A)⁻¹ AᵀΣ⁻¹

ξ is the generalised least-squares placement. Whether block k is displaced is tested by the statistic that
would not change if the block were left out of the placement, t_k = (M y)_kᵀ (M_kk)⁻¹ (M y)_k, which is
χ² with as many degrees of freedom as the target has coordinates. The worst block beyond chance (Holm) is
set apart and the rest is tested anew, so that one displaced block does not make its neighbours look wrong.

C is the covariance of the calibration; its errors are common to all targets, so J C Jᵀ is full. An arm
that was calibrated *with this plate, taken as true,* has already absorbed part of the plate's errors:
calibrate it with something else for this comparison.

Sources: ARIA §4.1.2 (third method); Cook & Weisberg, Residuals and Influence in Regression (1982), §2.2
(mean-shift outliers); Holm, Scand. J. Statistics 6 (1979).
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy import linalg, special

from workbench.arm.kinematics.forward import sensitivity
from workbench.arm.motion import Motion
from workbench.arm.robot import Frame, Robot
from workbench.base import se3
from workbench.base.errors import DataError, OptionError, ShapeError
from workbench.base.types import Matrix4
from workbench.identification.problem import Noise
from workbench.plate.plate import Kind, Plate

SEATING = Noise(position=5e-5, rotation=float(np.deg2rad(0.01)))
"""How well the tool returns to a target, unless said otherwise."""
SIGNIFICANCE = 1e-3
"""Chance of calling any block of a good plate displaced."""
PLACEMENTS = 20
"""Greatest number of Gauss–Newton steps of the placement."""


class Calibration(NamedTuple):
    """What is known of the calibrated arm's constants.

    Args:
        names: Constants of the arm and the tool.
        covariance: Their covariance [rad, m].
    """

    names: tuple[str, ...]
    covariance: Float[np.ndarray, "p p"]


@dataclass(frozen=True, eq=False, kw_only=True)
class PlateComparison:
    """A real plate against its drawing; target by target, in the order of the plate.

    Args:
        plate: The nominal plate.
        visits: How often each target was measured; 0 where the rest is NaN.
        deviations: Measured minus nominal [m, rad], base axes; rotation NaN for sockets and points.
        placement: Motion of the whole plate in the robot's base frame: real = placement · nominal.
        placement_twist: The same as [v; w] about the targets' centre [m, rad].
        placement_std: Standard errors of that twist.
        blocks: What remains of each deviation after the placement [m, rad].
        std: Standard errors of what remains.
        p_values: Chance that a block in its place would look as far off, one by one.
        displaced: Blocks that are displaced beyond chance, all tries counted (Holm).
        notes: What limits the comparison, one sentence each.
    """

    plate: Plate
    visits: Int[np.ndarray, " targets"]
    deviations: Float[np.ndarray, "targets 6"]
    placement: Matrix4
    placement_twist: Float[np.ndarray, "6"]
    placement_std: Float[np.ndarray, "6"]
    blocks: Float[np.ndarray, "targets 6"]
    std: Float[np.ndarray, "targets 6"]
    p_values: Float[np.ndarray, " targets"]
    displaced: Bool[np.ndarray, " targets"]
    notes: tuple[str, ...] = ()

    @property
    def distances(self) -> Float[np.ndarray, " targets"]:
        """How far each target is from its nominal place [m]."""
        return np.linalg.norm(self.deviations[:, :3], axis=1)

    @property
    def block_distances(self) -> Float[np.ndarray, " targets"]:
        """How far each target is from its place on the plate as it stands [m]."""
        return np.linalg.norm(self.blocks[:, :3], axis=1)

    @property
    def block_angles(self) -> Float[np.ndarray, " targets"]:
        """How far each seat is turned on the plate as it stands [rad]; NaN for sockets and points."""
        return np.linalg.norm(self.blocks[:, 3:], axis=1)


def compare_plates(
    plate: Plate,
    robot: Robot,
    q: Float[np.ndarray, "rows n"],
    *,
    targets: Int[np.ndarray, " rows"] | None = None,
    calibration: Calibration | None = None,
    seating: Noise = SEATING,
) -> PlateComparison:
    """Where the real plate's targets are, and which of its blocks is not where the others say.

    Args:
        plate: The nominal plate, in the robot's base frame.
        robot: Calibrated arm with its tool; where its base stands plays no part.
        q: Joint positions at the real targets [rad or m].
        targets: Target of each row, counted from 0; in order if None. Repeats are averaged.
        calibration: Covariance of the arm's constants; only the seating counts if None.
        seating: Standard deviations of one visit to a target [m], [rad].

    Raises:
        ShapeError: rows and targets differ in number.
        DataError: fewer than three targets were measured.
        OptionError: the calibration speaks of constants that the arm does not have.
    """
    robot.check_joints(q, f"plate '{plate.name}'")
    targets = np.arange(len(q)) if targets is None else targets
    _check_targets(plate, q, targets)
    arm = robot.with_frames(base=Frame())
    names = _known_names(arm, calibration)
    poses, twists = sensitivity(arm, Motion(q), names)
    visited, visits = np.unique(targets, return_counts=True)
    real = np.stack([_mean_pose(poses[targets == k]) for k in visited])
    change = np.stack([twists[targets == k].mean(axis=0) for k in visited])
    entries = np.stack([_entries(plate.targets[k].kind) for k in visited])
    sigma = _covariance(plate, visited, visits, change, calibration, names, seating)
    seen = entries.ravel()
    sigma = sigma[np.ix_(seen, seen)]
    apart, notes = np.zeros(len(visited), bool), []
    while True:
        fit = _Fit.of(real, plate.poses[visited], sigma, entries, apart)
        log_p = fit.log_p_values()
        worst = int(np.argmin(np.where(apart, np.inf, log_p)))
        left = int((~apart).sum())
        if log_p[worst] >= np.log(SIGNIFICANCE / left):
            break
        if left - 1 < max(3, (len(visited) + 1) // 2):
            notes.append(
                "more than half of the blocks contradict each other, so none can be blamed; is this the "
                "plate, the tool and the calibration that belong together?"
            )
            break
        apart[worst] = True
    if calibration is None:
        notes.append("the calibration's own uncertainty was not given, so every significance is too high")
    return _comparison(plate, visited, visits, real, fit, log_p, apart, entries, tuple(notes))


@dataclass(frozen=True, eq=False)
class _Fit:
    """Placement of the plate by the targets that are not set apart, and what remains of all."""

    placement: np.ndarray
    twist: np.ndarray
    twist_covariance: np.ndarray
    rest: np.ndarray
    rest_covariance: np.ndarray
    design: np.ndarray
    sigma: np.ndarray
    blocks: np.ndarray
    apart: np.ndarray

    @classmethod
    def of(cls, real, nominal, sigma, entries, apart) -> "_Fit":
        seen = entries.ravel()
        blocks = np.repeat(np.arange(len(real)), 6)[seen]
        keep = ~apart[blocks]
        centre = nominal[:, :3, 3].mean(axis=0)
        there, back = np.eye(4), np.eye(4)
        there[:3, 3], back[:3, 3] = centre, -centre
        placement = np.eye(4)
        inverse = np.linalg.inv(sigma[np.ix_(keep, keep)])
        for _ in range(PLACEMENTS):
            placed = placement @ nominal
            rest = se3.pose_error(real, placed).ravel()[seen]
            arm = placed[:, :3, 3] - centre
            design = np.zeros((len(real), 6, 6))
            design[:, :3, :3] = design[:, 3:, 3:] = np.eye(3)
            design[:, :3, 3:] = -se3.skew(arm)
            design = design.reshape(-1, 6)[seen]
            normal = design[keep].T @ inverse @ design[keep]
            twist_covariance = np.linalg.pinv(normal, rcond=1e-12, hermitian=True)
            step = twist_covariance @ (design[keep].T @ inverse @ rest[keep])
            if np.abs(step).max() < 1e-13:
                break
            turn = se3.pose(se3.rotvec_to_matrix(step[3:]), step[:3])
            placement = there @ turn @ back @ placement
        gain = np.zeros((6, len(rest)))
        gain[:, keep] = twist_covariance @ design[keep].T @ inverse
        left = np.eye(len(rest)) - design @ gain
        local = back @ placement @ there
        twist = np.concatenate([local[:3, 3], se3.matrix_to_rotvec(local[:3, :3])])
        rest_covariance = left @ sigma @ left.T
        return cls(placement, twist, twist_covariance, rest, rest_covariance, design, sigma, blocks, apart)

    def log_p_values(self) -> np.ndarray:
        """Logarithm of each block's chance; blocks set apart are judged by the placement of the others."""
        keep = ~self.apart[self.blocks]
        inverse = np.linalg.inv(self.sigma[np.ix_(keep, keep)])
        weighted = inverse @ self.design[keep]
        m = inverse - weighted @ np.linalg.pinv(self.design[keep].T @ weighted, hermitian=True) @ weighted.T
        pull, kept_blocks = m @ self.rest[keep], self.blocks[keep]
        result = np.empty(len(self.apart))
        for k in range(len(self.apart)):
            if self.apart[k]:
                mine = self.blocks == k
                vector, covariance = self.rest[mine], self.rest_covariance[np.ix_(mine, mine)]
            else:
                mine = kept_blocks == k
                vector, covariance = pull[mine], m[np.ix_(mine, mine)]
            t = float(vector @ linalg.solve(covariance, vector, assume_a="pos"))
            result[k] = special.chdtrc(len(vector), t)
        with np.errstate(divide="ignore"):
            return np.log(result)


def _check_targets(plate: Plate, q: np.ndarray, targets: np.ndarray) -> None:
    if len(targets) != len(q) or (len(targets) and not 0 <= targets.min() <= targets.max() < len(plate)):
        raise ShapeError(
            f"plate '{plate.name}' has {len(plate)} targets, numbered from 0; {len(q)} rows of joints came "
            f"with {len(targets)} target numbers up to {targets.max(initial=-1)}; "
            "name the target of every row",
            expected=len(plate),
            found=len(q),
        )
    if len(np.unique(targets)) < 3:
        raise DataError(
            f"{len(np.unique(targets))} targets of plate '{plate.name}' were measured; three are needed to "
            "tell a displaced plate from a displaced block"
        )


def _known_names(arm: Robot, calibration: Calibration | None) -> tuple[str, ...]:
    if calibration is None:
        return ()
    names = tuple(n for n in calibration.names if n.split(".")[0].split("[")[0] != "base")
    if missing := [n for n in names if n not in arm.chain.index]:
        raise OptionError(
            f"robot '{arm.name}' has no constant '{missing[0]}'; give the covariance of its own calibration"
        )
    return names


def _entries(kind: Kind) -> np.ndarray:
    """Which of [p; φ] a target fixes."""
    return np.array([True] * 3 + [kind is Kind.SEAT] * 3)


def _mean_pose(poses: np.ndarray) -> np.ndarray:
    """Mean of nearly equal poses."""
    error = se3.pose_error(poses, np.broadcast_to(poses[0], poses.shape)).mean(axis=0)
    return se3.pose(se3.rotvec_to_matrix(error[3:]) @ poses[0, :3, :3], poses[0, :3, 3] + error[:3])


def _covariance(plate, visited, visits, change, calibration, names, seating) -> np.ndarray:
    """Σ of all six entries of every visited target."""
    variance = np.repeat([seating.position**2, seating.rotation**2], 3) / visits[:, None]
    for row, k in enumerate(visited):
        if plate.targets[k].sigma is not None:
            variance[row] += np.repeat(np.square(plate.targets[k].sigma), 3)
    sigma = np.diag(variance.ravel())
    if calibration is not None:
        chosen = [calibration.names.index(n) for n in names]
        flat = change.reshape(-1, len(names))
        sigma += flat @ calibration.covariance[np.ix_(chosen, chosen)] @ flat.T
    return sigma


def _comparison(plate, visited, visits, real, fit, log_p, apart, entries, notes) -> PlateComparison:
    def spread(values: np.ndarray, fill=np.nan) -> np.ndarray:
        whole = np.full((len(plate), *values.shape[1:]), fill)
        whole[visited] = values
        return whole

    def entrywise(flat: np.ndarray) -> np.ndarray:
        table = np.full(entries.shape, np.nan)
        table[entries] = flat
        return spread(table)

    deviations = se3.pose_error(real, plate.poses[visited])
    return PlateComparison(
        plate=plate,
        visits=spread(visits, 0),
        deviations=spread(np.where(entries, deviations, np.nan)),
        placement=fit.placement,
        placement_twist=fit.twist,
        placement_std=np.sqrt(np.diag(fit.twist_covariance)),
        blocks=entrywise(fit.rest),
        std=entrywise(np.sqrt(np.maximum(np.diag(fit.rest_covariance), 0.0))),
        p_values=spread(np.exp(log_p)),
        displaced=spread(apart, False),
        notes=notes,
    )
