"""The circle nearest to points in space: plane by principal components, circle by linear least squares.

Source: Kåsa, IEEE Trans. Instrum. Meas. 25 (1976).
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from workbench.base.types import Matrix3, Vector3, frozen


@dataclass(frozen=True, eq=False, kw_only=True)
class FittedCircle:
    """A circle and how far the points are from it.

    Args:
        centre: Of the circle [m].
        axes: Two orthogonal unit vectors in the plane and its normal, one a row; the sense is arbitrary.
        radius: Of the circle [m].
        out: How far each point is outside the circle, in the plane [m].
    """

    centre: Vector3
    axes: Matrix3
    radius: float
    out: Float[np.ndarray, " points"]


def fit_circle(points: Float[np.ndarray, "points 3"]) -> FittedCircle:
    """The circle of least squares through three points or more; points in a line have one of any radius."""
    middle = points.mean(axis=0)
    axes = np.linalg.svd(points - middle, full_matrices=False)[2]
    flat = (points - middle) @ axes[:2].T
    design = np.column_stack([2.0 * flat, np.ones(len(flat))])
    a, b, c = np.linalg.lstsq(design, (flat**2).sum(axis=1), rcond=None)[0]
    radius = float(np.sqrt(max(c + a**2 + b**2, 0.0)))
    return FittedCircle(
        centre=frozen(middle + a * axes[0] + b * axes[1]),
        axes=frozen(axes),
        radius=radius,
        out=frozen(np.linalg.norm(flat - [a, b], axis=1) - radius),
    )
