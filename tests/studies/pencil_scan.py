"""A pencil's stroke on the printed sheet, and its scan, of a virtual arm (Katana §5.5.2)."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from workbench.base.errors import DataError
from workbench.base.types import Poses, Vector3, frozen
from workbench.extras.katana.pencil import INCH, Image, edge, places, printed, shown

STROKE, GRAPHITE, GRAIN = 0.5e-3, 0.35, 0.25
"""Width of the pencil's line [m], its reflectance, its relative roughness."""
GLOW = 0.012
"""Standard deviation of the scanner's noise, as a share of white."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Drawn:
    """What a pencil drew.

    Args:
        points: Where it touched the paper: towards the beginning of the circle, and a quarter further [m].
        extension: How far it stood out beyond its length at rest [m].
    """

    points: Float[np.ndarray, "rows 2"]
    extension: Float[np.ndarray, " rows"]


def draw(poses: Poses, centre: Vector3, along: Vector3, across: Vector3) -> Drawn:
    """What tools at these poses draw on the plane of a circle.

    Args:
        poses: Of the tip of the pencil at rest, the tool's z axis along it [m].
        centre: Middle of the printed circle, in the same frame [m].
        along: Unit vector from there to where the path begins.
        across: Unit vector from there to where it is after a quarter.
    """
    normal = np.cross(along, across)
    slant = poses[:, :3, 2] @ normal
    flattest = int(np.argmin(np.abs(slant)))
    if abs(slant[flattest]) < 0.1:
        raise DataError(f"the pencil lies flat on the paper in row {flattest}", row=flattest)
    away = poses[:, :3, 3] - centre
    extension = -(away @ normal) / slant
    touch = away + extension[:, None] * poses[:, :3, 2]
    return Drawn(points=frozen(touch @ np.stack([along, across], 1)), extension=frozen(extension))


def scan(
    drawn: Drawn,
    radius: float,
    *,
    clockwise: bool,
    rng: np.random.Generator,
    dpi: float = 300.0,
    turned: float = 0.0,
    shifted: tuple[float, float] = (0.0, 0.0),
) -> Image:
    """A scan of the sheet with the pencil's stroke on it.

    Args:
        drawn: The stroke, once around.
        radius: Of the printed circle [m].
        clockwise: Whether the path runs clockwise for who looks at the paper.
        dpi: Dots per inch.
        turned: How the sheet lies on the scanner, counter-clockwise [rad].
        shifted: And where [m]; the third number does not count.
    """
    x, y = places(radius, dpi, shifted, turned)
    paper = printed(x, y, radius, dpi)
    sense = -1.0 if clockwise else 1.0
    angle = np.unwrap(np.arctan2(drawn.points[:, 1], drawn.points[:, 0]))
    distance = np.linalg.norm(drawn.points, axis=1)
    order = np.argsort(angle)
    reach = np.hypot(x, y)
    near = (reach > distance.min() - STROKE - INCH / dpi) & (reach < distance.max() + STROKE + INCH / dpi)
    here = sense * np.arctan2(y[near], x[near])
    turn = 2.0 * np.pi
    here = here + turn * np.ceil((angle.min() - here) / turn)
    line = np.interp(here, angle[order], distance[order])
    stroke = edge(0.5 * STROKE - np.abs(reach[near] - line), dpi) * (here <= angle.max())
    grain = 1.0 + GRAIN * rng.standard_normal(x.shape)[near]
    dark = stroke * (1.0 - GRAPHITE) * np.clip(grain, 0.0, 1.3)
    paper[near] *= (1.0 - np.clip(dark, 0.0, 0.95))[:, None]
    return shown(paper + GLOW * rng.standard_normal(paper.shape))
