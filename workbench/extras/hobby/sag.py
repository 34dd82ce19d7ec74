"""Sag of servo arms, found in what the zeros leave of a few poses.

    W r = W N n + W S c        r the residuals, W whitens them; N: what zeros, base and tool can do,
                               S: what a unit of each effect does

The motors of an arm are of one make: compliance has one size for all joints, or one a joint. Every servo arm
sags: one size for all is always fitted, which costs less than to leave it out where scatter hides it. Of no
sag (where it would act upwards) and both forms, the one with the smallest Bayesian information criterion is
chosen. Masses are known roughly or not at all: what a joint carries is then fitted term by term
(`gravity-sag`), expected near c times the masses, c near that of servos.

Source: Schwarz, Estimating the dimension of a model, Ann. Stat. 6(2), 1978.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from workbench.arm.effects.effect import AbstractEffect
from workbench.arm.effects.gravity_sag import GravitySag, sags
from workbench.arm.effects.joint_compliance import JointCompliance
from workbench.arm.kinematics.forward import geometric_jacobian, identification_jacobian
from workbench.arm.masses import with_assumed_masses
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.identification.problem import Noise

MIN_GAIN = 2.0
"""By how much sag must beat the criterion; what acts upwards by seven times that."""
MASS, TOLERANCE = 0.1, 0.2
"""Of a link whose mass is unknown [kg]; standard deviation of first moments, as a part of the largest."""
SOFT = 0.03
"""Compliance that is expected of a servo's joint, as a standard deviation [rad/(N m)]."""
FRESH = 200
"""Postures anywhere within the limits, at which what is uncertain of the sag is looked at."""


class Sag(NamedTuple):
    """What the zeros leave.

    Args:
        effects: What was found.
        error: Root mean square by which the tip is uncertain for that of the sag, anywhere [m].
        up: Whether it acts upwards: the poses also fit an arm that hangs, its joints counting the other way.
    """

    effects: tuple[AbstractEffect, ...] = ()
    error: float = 0.0
    up: bool = False


def sag_of(
    robot: Robot, q: Float[np.ndarray, "rows n"], poses: Float[np.ndarray, "rows 4 4"], noise: Noise
) -> Sag:
    """Sag of the joints between the first and the last."""
    robot = with_assumed_masses(robot, otherwise=MASS)
    shown = robot.predict(q)
    clear = _Cleared(robot, q, shown, noise)
    count, left = clear.count, clear(se3.pose_error(poses, shown))
    joints = tuple(range(1, robot.dof - 1))
    twists = _twists(robot, JointCompliance(joints), q)
    lowest, found = count * np.log(left @ left) - MIN_GAIN, Sag()
    for share in (np.ones((1, len(joints))), np.eye(len(joints))):
        design = np.column_stack([clear(unit) for unit in np.tensordot(share, twists, 1)])
        size = np.linalg.lstsq(design, left, rcond=1e-9)[0]
        rest, is_up = left - design @ size, bool(size[0] < 0.0)
        is_usual = len(size) == 1 and not is_up
        score = count * np.log(rest @ rest) + (-MIN_GAIN if is_usual else len(size) * np.log(count))
        score += 6.0 * MIN_GAIN * is_up
        if abs(np.sign(size).sum()) == len(size) and score < lowest:
            scatter = float(np.sqrt(rest @ rest / count))
            lowest, found = score, Sag(*_sags(robot, q, size @ share, clear, left, scatter), is_up)
    return found


def _sags(
    robot: Robot, q: np.ndarray, soft: np.ndarray, clear: "_Cleared", left: np.ndarray, noise: float
) -> tuple[tuple[AbstractEffect, ...], float]:
    """Sag of each joint by the first moments that it carries, expected near the file's times compliance."""
    own = [s for s in sags(robot, Motion(q)) if 0 < s.joints[0] < robot.dof - 1]
    terms = list(dict.fromkeys(term for sag in own for term in sag.terms.split()))
    share = soft / soft.mean()

    def columns(q: np.ndarray) -> np.ndarray:
        """Twists by a unit of each term."""
        out = np.zeros((len(terms), len(q), 6))
        for sag, part in zip(own, share, strict=True):
            for term, twist in zip(sag.terms.split(), _twists(robot, sag, q), strict=True):
                out[terms.index(term)] += part * twist
        return out

    known, seen = _known(robot, own[0], terms), columns(q)
    spread = TOLERANCE * np.abs(known).max() * abs(soft.mean())
    design = np.column_stack([np.zeros_like(left), *(clear(column) for column in seen)]) / noise
    expected = np.column_stack([-known, np.eye(len(terms))]) / spread
    usual = np.eye(1, 1 + len(terms)) / SOFT
    rows = np.vstack([design, expected, usual])
    size = np.linalg.lstsq(rows, np.append(left / noise, np.zeros(len(terms) + 1)), rcond=1e-12)[0]
    by_term = dict(zip(terms, size[1:].tolist(), strict=True))
    low, high = robot.search_limits.T
    fresh = np.random.default_rng(0).uniform(low, high, (FRESH, robot.dof))
    off = columns(fresh) - clear.absorbed(seen, fresh, robot.predict(fresh))
    covariance = np.linalg.inv(rows.T @ rows)[1:, 1:]
    error = np.einsum("tri,tu,uri->r", off[..., :3], covariance, off[..., :3]).mean() ** 0.5
    found = (
        replace(sag, coefficients=tuple(part * by_term[term] for term in sag.terms.split()))
        for sag, part in zip(own, share.tolist(), strict=True)
    )
    return tuple(found), float(error)


def _known(robot: Robot, sag: GravitySag, terms: Sequence[str]) -> np.ndarray:
    """First moments by the file's masses, times gravity [N m]; of a joint that carries all of them."""
    low, high = robot.search_limits.T
    q = np.random.default_rng(0).uniform(low, high, (20 * len(terms), robot.dof))
    whole, units = _twists(robot, JointCompliance(sag.joints), q)[0], _twists(robot, sag, q)
    found = np.linalg.lstsq(units.reshape(len(units), -1).T, whole.ravel(), rcond=1e-9)[0]
    by_term = dict(zip(sag.terms.split(), found.tolist(), strict=True))
    return np.array([by_term[term] for term in terms])


def _still(robot: Robot, q: np.ndarray, shown: np.ndarray) -> Float[np.ndarray, "rows 6 p"]:
    """What zeros, base and tool do to poses."""
    still = np.zeros((len(q), 6, 12))
    still[:, :, :6] = np.eye(6)
    still[:, :3, 3:6] = -se3.skew(shown[:, :3, 3])
    still[:, :3, 6:9] = still[:, 3:, 9:] = shown[:, :3, :3]
    return np.concatenate([geometric_jacobian(robot, q), still], 2)


class _Cleared:
    """What zeros, base and tool leave of twists, whitened; `count`: how many numbers that is."""

    def __init__(self, robot: Robot, q: np.ndarray, shown: np.ndarray, noise: Noise):
        self._robot, still = robot, _still(robot, q, shown)
        by_joint = still[:, :, : robot.dof] * np.array(noise.joints)
        own = np.diag(np.repeat([noise.position, noise.rotation], 3) ** 2)
        self._white = np.linalg.inv(np.linalg.cholesky(by_joint @ by_joint.swapaxes(1, 2) + own))
        self._nuisance = (self._white @ still).reshape(-1, still.shape[2])
        basis, sizes, _ = np.linalg.svd(self._nuisance, full_matrices=False)
        self._basis = basis[:, sizes > 1e-9 * sizes[0]]
        self.count = len(self._basis) - self._basis.shape[1]

    def __call__(self, twists: np.ndarray) -> np.ndarray:
        flat = (self._white @ twists[..., None]).reshape(-1)
        return flat - self._basis @ (self._basis.T @ flat)

    def absorbed(self, seen: np.ndarray, q: np.ndarray, shown: np.ndarray) -> np.ndarray:
        """What zeros, base and tool do at other poses to make up for twists here (effects, rows, 6)."""
        flat = np.stack([(self._white @ twists[..., None]).reshape(-1) for twists in seen], 1)
        size = np.linalg.lstsq(self._nuisance, flat, rcond=1e-9)[0]
        return (_still(self._robot, q, shown) @ size).transpose(2, 0, 1)


def _twists(robot: Robot, effect: AbstractEffect, q: np.ndarray) -> np.ndarray:
    """What a unit of each coefficient of an effect does to the poses (coefficients, rows, 6)."""
    return identification_jacobian(robot.with_effects(effect), Motion(q), effect.names)[1].transpose(2, 0, 1)
