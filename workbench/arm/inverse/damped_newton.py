"""Damped Newton for one arm and one target at a time, compiled, with or without joint limits.

Minimises |p* − p|² + w² |ρ|², where ρ is the remaining rotation vector: of R* Rᵀ for a pose, the one that
rotates the tool's z axis onto the target's for an axis, none for a position. Steps solve
(JᵀJ + λ I) δ = Jᵀ r on the joints that no limit holds, and are clipped to the limits; λ follows the
success of the steps and never exceeds the squared residual, which keeps the convergence quadratic even
where J is singular at the solution (Fan and Yuan, Computing 74, 2005).
"""

from dataclasses import dataclass
from enum import IntEnum
from typing import no_type_check

import numpy as np
from jaxtyping import Bool, Float, Int
from numba import njit

from workbench.arm.chain import inner
from workbench.arm.inverse.reduced_arm import ReducedArm, forward
from workbench.base.types import frozen


class Task(IntEnum):
    """Which part of the target the tool must meet."""

    POSE = 6
    POSITION_AXIS = 5
    POSITION = 3

    @classmethod
    def default(cls, dof: int) -> "Task":
        """The most constraining task that an arm with this number of joints can meet in general."""
        return cls.POSE if dof >= 6 else cls.POSITION_AXIS if dof == 5 else cls.POSITION


MAX_ITERATIONS = 60
"""Maximum number of steps per start."""
POSITION_TOLERANCE = 1e-9
"""Maximum position error of a solution [m]."""
ROTATION_TOLERANCE = 1e-9
"""Maximum orientation error of a solution [rad]."""
ROTATION_WEIGHT = 0.25
"""w, as a share of the arm's length [1/rad]."""
MIN_DAMPING = 1e-11
"""Minimum damping, relative to the mean square column: with less, rounding moves a redundant arm along its
self-motion."""


@dataclass(frozen=True, eq=False)
class Reached:
    """How near some runs came to their targets; one of them without an axis of rows.

    Args:
        q: Joint coordinates [rad or m].
        position_error: Distance of the tool from its target [m].
        rotation_error: Angle between the two, as far as the task asks [rad].
    """

    q: Float[np.ndarray, "*rows n"]
    position_error: Float[np.ndarray, "*rows"]
    rotation_error: Float[np.ndarray, "*rows"]

    @property
    def converged(self) -> Bool[np.ndarray, "*rows"]:
        """Whether the targets are met; of one an array as well."""
        return ((self.position_error < POSITION_TOLERANCE) & (self.rotation_error < ROTATION_TOLERANCE))[...]

    def cost(self, weight: float) -> Float[np.ndarray, "*rows"]:
        """|p* − p|² + w² |ρ|² [m²]."""
        return self.position_error**2 + (weight * self.rotation_error) ** 2

    def row(self, i: int) -> "Reached":
        """A single run."""
        return Reached(self.q[i], self.position_error[i, ...], self.rotation_error[i, ...])


def unlimited(n: int) -> Float[np.ndarray, "n 2"]:
    """Infinite limits."""
    return frozen(np.tile([-np.inf, np.inf], (n, 1)))


def refine(
    arm: ReducedArm,
    targets: Float[np.ndarray, "targets 4 4"],
    starts: Float[np.ndarray, "rows n"],
    *,
    task: Task,
    target_of: Int[np.ndarray, " rows"] | None = None,
    limits: Float[np.ndarray, "n 2"] | None = None,
    iterations: int = MAX_ITERATIONS,
) -> Reached:
    """Run every start to a solution, or as near to the target as it gets.

    Args:
        targets: Poses of the tool in the measuring frame.
        starts: Joint coordinates [rad or m].
        task: What of the target must be met.
        target_of: Target of each start; if None row by row, or the only one.
        limits: Joint limits; none if None.
        iterations: Steps before giving up.
    """
    if target_of is None:
        target_of = np.zeros(len(starts)) if len(targets) == 1 else np.arange(len(starts))
    # fresh arrays, as a read-only one would make numba compile the loop again
    x, errors = np.array(starts, float, order="C"), np.empty((len(starts), 2))
    _refine_many(
        arm.constants,
        arm.slides,
        arm.shares,
        np.array(targets, float, order="C"),
        np.array(target_of, np.int64),
        int(task),
        ROTATION_WEIGHT * arm.length,
        np.array(unlimited(arm.dof) if limits is None else limits, float, order="C"),
        iterations,
        x,
        errors,
    )
    return Reached(x, errors[:, 0], errors[:, 1])


@inner
@no_type_check
def _missing(tool, target, task, r, m):
    """Remaining position and rotation error [p* − p; ρ], into r; returns their norms.

    `m` is workspace.
    """
    for i in range(3):
        r[i] = target[i, 3] - tool[i, 3]
        r[3 + i] = 0.0
    distance = np.sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2])
    if task == 3:
        return distance, 0.0
    if task == 5:
        x, y, z = tool[0, 2], tool[1, 2], tool[2, 2]
        u, v, w = target[0, 2], target[1, 2], target[2, 2]
        r[3], r[4], r[5] = y * w - z * v, z * u - x * w, x * v - y * u
        sine, cosine = np.sqrt(r[3] ** 2 + r[4] ** 2 + r[5] ** 2), x * u + y * v + z * w
        if sine < 1e-12 and cosine < 0.0:  # exactly opposite: any perpendicular axis will do
            r[3], r[4], r[5], sine = tool[0, 0], tool[1, 0], tool[2, 0], 1.0
            angle = np.pi
        else:
            angle = np.arctan2(sine, cosine)
    else:
        # vector part of the quaternion of R* Rᵀ, times 4 w; near a half-turn from the symmetric part
        for i in range(3):
            for j in range(3):
                m[i, j] = target[i, 0] * tool[j, 0] + target[i, 1] * tool[j, 1] + target[i, 2] * tool[j, 2]
        trace = m[0, 0] + m[1, 1] + m[2, 2]
        r[3], r[4], r[5] = m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]
        sine, cosine = 0.5 * np.sqrt(r[3] ** 2 + r[4] ** 2 + r[5] ** 2), 0.5 * (trace - 1.0)
        angle = np.arctan2(sine, cosine)
        if cosine < -0.99:
            k = 0
            for i in range(1, 3):
                if m[i, i] > m[k, k]:
                    k = i
            sign = 1.0 if r[3 + k] >= 0.0 else -1.0
            for i in range(3):
                r[3 + i] = sign * (0.5 * (m[i, k] + m[k, i]) - (cosine if i == k else 0.0))
        sine = np.sqrt(r[3] ** 2 + r[4] ** 2 + r[5] ** 2)
    scale = 1.0 if sine < 1e-300 else angle / sine
    for i in range(3, 6):
        r[i] *= scale
    return distance, angle


@inner
@no_type_check
def _normal_equations(tool, axes, points, slides, shares, r, task, w2, j, own, h, g):
    """JᵀJ (its lower half) and Jᵀr, with rotations weighted by w² (w2) and projected for the task.

    `own` holds every axis's part of `j`, Jᵀ; entries outside the task must be zero before.
    """
    for k in range(len(slides)):
        a, b, c = axes[k, 0], axes[k, 1], axes[k, 2]
        if slides[k]:
            own[k] = a, b, c, 0.0, 0.0, 0.0
            continue
        x, y, z = tool[0, 3] - points[k, 0], tool[1, 3] - points[k, 1], tool[2, 3] - points[k, 2]
        own[k, 0], own[k, 1], own[k, 2] = b * z - c * y, c * x - a * z, a * y - b * x
        if task == 6:
            own[k, 3], own[k, 4], own[k, 5] = a, b, c
        elif task == 5:
            along = a * tool[0, 2] + b * tool[1, 2] + c * tool[2, 2]
            own[k, 3] = a - along * tool[0, 2]
            own[k, 4] = b - along * tool[1, 2]
            own[k, 5] = c - along * tool[2, 2]
    j[:] = 0.0
    for k in range(len(shares)):
        into, axis = int(shares[k, 1]), int(shares[k, 0])
        for i in range(6):
            j[into, i] += shares[k, 2] * own[axis, i]
    for a in range(len(g)):
        x, y, z, u, v, w = j[a, 0], j[a, 1], j[a, 2], w2 * j[a, 3], w2 * j[a, 4], w2 * j[a, 5]
        g[a] = x * r[0] + y * r[1] + z * r[2] + u * r[3] + v * r[4] + w * r[5]
        for b in range(a + 1):
            h[a, b] = x * j[b, 0] + y * j[b, 1] + z * j[b, 2] + u * j[b, 3] + v * j[b, 4] + w * j[b, 5]


@inner
@no_type_check
def _solve_damped(h, g, damping, held, low, step):
    """Cholesky solution of (H + λ I) δ = g with δ = 0 for held joints; False if it breaks down."""
    n = len(g)
    for a in range(n):  # row a of L, and the inverse of its diagonal on the diagonal
        total = 0.0 if held[a] else g[a]
        for b in range(a):
            part = 0.0 if held[a] or held[b] else h[a, b]
            for k in range(b):
                part -= low[a, k] * low[b, k]
            low[a, b] = part * low[b, b]
            total -= low[a, b] * step[b]
        rest = 1.0 if held[a] else h[a, a] + damping
        for k in range(a):
            rest -= low[a, k] * low[a, k]
        if rest <= 0.0:
            return False
        low[a, a] = 1.0 / np.sqrt(rest)
        step[a] = total * low[a, a]
    for a in range(n - 1, -1, -1):
        total = step[a]
        for k in range(a + 1, n):
            total -= low[k, a] * step[k]
        step[a] = total * low[a, a]
    return True


@njit(cache=True, error_model="numpy")
@no_type_check
def _refine_many(constants, slides, shares, targets, target_of, task, weight, limits, iterations, xs, errors):
    m, n = len(slides), len(limits)
    tool, axes, points = np.empty((3, 4)), np.empty((m, 3)), np.empty((m, 3))
    r, turn, j = np.empty(6), np.empty((3, 3)), np.empty((n, 6))
    own = np.zeros((m, 6))  # entries outside the task stay zero
    h, g, low = np.empty((n, n)), np.empty(n), np.empty((n, n))
    step, new, held = np.empty(n), np.empty(n), np.zeros(n, np.bool_)
    w2 = weight * weight
    for row in range(len(xs)):
        x, target = xs[row], targets[target_of[row]]
        for k in range(n):
            x[k] = min(max(x[k], limits[k, 0]), limits[k, 1])
        forward(constants, slides, shares, x, tool, axes, points)
        distance, angle = _missing(tool, target, task, r, turn)
        cost = distance**2 + w2 * angle**2
        relative, idle, count = 1e-3, 0, 0
        while count < iterations and idle < 4 and (distance > 1e-13 or angle > 1e-13):
            count += 1
            _normal_equations(tool, axes, points, slides, shares, r, task, w2, j, own, h, g)
            size = 0.0
            for k in range(n):
                size += h[k, k] / n
                held[k] = (x[k] <= limits[k, 0] and g[k] < 0.0) or (x[k] >= limits[k, 1] and g[k] > 0.0)
            relative = max(min(relative, cost / size), MIN_DAMPING)
            better = False
            for _ in range(14):
                if not _solve_damped(h, g, relative * size, held, low, step):
                    relative *= 10.0
                    continue
                longest = 0.0
                for k in range(n):
                    longest = max(longest, abs(step[k]))
                scale = min(1.0, 0.7 / max(longest, 1e-300))
                for k in range(n):
                    new[k] = min(max(x[k] + scale * step[k], limits[k, 0]), limits[k, 1])
                forward(constants, slides, shares, new, tool, axes, points)
                distance, angle = _missing(tool, target, task, r, turn)
                trial = distance**2 + w2 * angle**2
                if trial < cost:
                    better = True
                    break
                relative *= 10.0
            if not better:
                forward(constants, slides, shares, x, tool, axes, points)
                distance, angle = _missing(tool, target, task, r, turn)
                break
            idle = idle + 1 if trial > 0.9999 * cost else 0
            cost = trial
            relative *= 0.1
            for k in range(n):
                x[k] = new[k]
        errors[row, 0], errors[row, 1] = distance, angle
