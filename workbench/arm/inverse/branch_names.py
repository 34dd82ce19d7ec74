"""Names of the solutions of the inverse kinematics.

A branch is named after the signs of three geometric quantities (Lee and Ziegler, IEEE Trans. Aerospace and
Electronic Systems 20(6), 1984), with z_i the direction of joint axis i and o_1 the point of axis 1 that is
nearest to axis 2 (the shoulder):

    shoulder  right if (z_1 × z_2)·(h − o_1) ≥ 0, else left: on which side of axis 1 the hand lies, seen
              from the upper arm; h is the point of axis 5 nearest to axis 6
    elbow     up if the elbow (axis 3) lies above the line from shoulder to wrist for a right shoulder,
              below it for a left one, where above is the side of positive z_1, and the wrist is the point
              of axis 5 nearest to axis 4
    wrist     no flip if z_5·(z_4 × z_6) ≥ 0, else flip, as far as wrist and arm are decoupled. In general
              the sign is that of det J times the other two, times a constant of the arm that makes the
              two definitions agree in most configurations: det J changes its sign only at singularities,
              so that names part branches better (ARIA's wrist is offset by 49 mm).

They are taken from the actual axes, so a calibrated arm and its nominal one give the same names, and so do
neighbouring poses as long as no sign changes, which is at a singularity for the usual arms. They need axes 2
and 3 nearly parallel and axes 1 and 2, 4 and 5, 5 and 6 nearly perpendicular (an arm of five joints takes
its tool's z axis for the sixth). Other arms are named after the signs of their angles, as `+-++-+`.
Solutions of one target that share a name are numbered by increasing angle of joint 1, then 2 ….
"""

from collections import Counter
from functools import lru_cache

import numpy as np
from jaxtyping import Float

from workbench.arm.inverse.reduced_arm import ReducedArm
from workbench.base import se3

AXIS_TOLERANCE = 0.35
"""Sine or cosine up to which two axes count as nearly parallel or perpendicular (20°)."""


def branch_names(arm: ReducedArm, x: Float[np.ndarray, "rows n"]) -> list[str]:
    """A name for every solution of one target, unique among them."""
    if len(x) == 0:
        return []
    plain = plain_names(arm, x)
    count: Counter[str] = Counter()
    names = list(plain)
    for i in np.lexsort(np.angle(np.exp(1j * x)).round(6).T[::-1]):
        count[plain[i]] += 1
        if count[plain[i]] > 1:
            names[i] = f"{plain[i]} ({count[plain[i]]})"
    return names


def plain_names(arm: ReducedArm, x: Float[np.ndarray, "rows n"]) -> list[str]:
    """A name for every configuration by its signs alone, without numbering."""
    constant = _agreement(arm)
    if constant == 0.0:
        wrapped = np.where(arm.sliding, x, np.angle(np.exp(1j * x)))
        return ["".join("+" if v >= 0 else "-" for v in row) for row in wrapped]
    side, bend, _, determinant = _quantities(arm, x)
    wrist = constant * determinant * np.where(bend >= 0, 1.0, -1.0)
    return [
        f"shoulder {'right' if s >= 0 else 'left'}, elbow {'up' if e >= 0 else 'down'}, "
        f"wrist {'no flip' if f >= 0 else 'flip'}"
        for s, e, f in zip(side, bend, wrist, strict=True)
    ]


@lru_cache(maxsize=256)
def _agreement(arm: ReducedArm) -> float:
    """The sign that makes both definitions of the wrist agree in most configurations; 0 without structure."""
    if arm.dof not in (5, 6) or arm.slides.any() or len(arm.slides) > arm.dof:
        return 0.0
    x = np.random.default_rng(0).uniform(-np.pi, np.pi, (512, arm.dof))
    tool, axes, _ = arm.geometry(x[:1])
    z = [*axes[0], *([tool[0, :, 2]] if arm.dof == 5 else [])]
    if max(abs(z[i] @ z[i + 1]) for i in (0, 3, 4)) > AXIS_TOLERANCE:
        return 0.0
    if np.linalg.norm(np.cross(z[1], z[2])) > AXIS_TOLERANCE:
        return 0.0
    _, bend, flip, determinant = _quantities(arm, x)
    return 1.0 if np.sign(bend * flip * determinant).sum() >= 0 else -1.0


def _quantities(arm: ReducedArm, x: Float[np.ndarray, "rows n"]) -> tuple[Float[np.ndarray, " rows"], ...]:
    """Shoulder, elbow, simple wrist quantity and det J of every configuration."""
    tool, axes, points = arm.geometry(x)
    jacobian = arm.jacobian(x)
    if arm.dof == 5:  # the free turn about the tool's z axis is the sixth joint
        axes = np.concatenate([axes, tool[:, None, :, 2]], 1)
        points = np.concatenate([points, tool[:, None, :, 3]], 1)
        spin = np.concatenate([np.zeros((len(x), 3)), tool[:, :, 2]], 1)
        jacobian = np.concatenate([jacobian, spin[:, :, None]], 2)
    z1, z2, _, z4, z5, z6 = axes.transpose(1, 0, 2)
    shoulder = foot(points[:, 0], z1, points[:, 1], z2)
    wrist = foot(points[:, 4], z5, points[:, 3], z4)
    hand = foot(points[:, 4], z5, points[:, 5], z6)
    side = np.einsum("ri,ri->r", se3.cross(z1, z2), hand - shoulder)
    bend = np.einsum("ri,ri->r", z2, se3.cross(points[:, 2] - points[:, 1], wrist - points[:, 2]))
    flip = np.einsum("ri,ri->r", z5, se3.cross(z4, z6))
    return side, bend * np.where(side >= 0, -1.0, 1.0), flip, np.linalg.det(jacobian)


def foot(
    p: Float[np.ndarray, "rows 3"],
    u: Float[np.ndarray, "rows 3"],
    r: Float[np.ndarray, "rows 3"],
    v: Float[np.ndarray, "rows 3"],
) -> Float[np.ndarray, "rows 3"]:
    """The point of the line p + s u nearest to the line r + t v (not parallel)."""
    cosine = np.einsum("ri,ri->r", u, v)
    between = r - p
    s = np.einsum("ri,ri->r", between, u - cosine[:, None] * v) / np.maximum(1.0 - cosine**2, 1e-12)
    return p + s[:, None] * u
