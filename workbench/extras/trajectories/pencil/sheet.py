"""A circle drawn by an arm with a pencil on a printed one (Katana §5.5.2): sheet, drawing, scan.

The sheet lies in the plane of the path. It carries the circle in red, with a mark at every quarter and a
long one where the path begins. The pencil slides in the tool against a spring: it touches the paper at
p + s z, p the tool's tip, z its axis, and a potentiometer reads how far s it stands out. Red ink is as bright
as paper in a scan's red channel, so that pencil and print can be distinguished where they cross.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, UInt8

from workbench.base.errors import DataError
from workbench.base.types import Poses, Vector3, frozen

INCH = 0.0254
PRINT = 0.3e-3
"""Width of the printed line [m]."""
STROKE = 0.5e-3
"""Width of the pencil's line [m]."""
BORDER = 0.2
"""Paper around the circle, as a share of its radius."""
MARK = (0.02, 0.07)
"""Where a quarter's mark begins and ends outside the circle, as shares of the radius."""
LONG = 0.14
"""Where the mark of the beginning ends, likewise."""
RED = np.array([0.90, 0.22, 0.20])
"""The printed ink's reflectance."""
GRAPHITE = 0.35
"""The pencil's reflectance."""
PAPER = 0.96
"""The paper's reflectance."""
GRAIN = 0.25
"""Relative roughness of the pencil's stroke."""
GLOW = 0.012
"""Standard deviation of the scanner's noise, as a share of white."""

Image = UInt8[np.ndarray, "height width 3"]


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
    if (np.abs(slant) < 0.1).any():
        raise DataError(
            f"the pencil lies flat on the paper in row {int(np.argmin(np.abs(slant)))}",
            row=int(np.argmin(np.abs(slant))),
        )
    away = poses[:, :3, 3] - centre
    extension = -(away @ normal) / slant
    touch = away + extension[:, None] * poses[:, :3, 2]
    return Drawn(points=frozen(touch @ np.stack([along, across], 1)), extension=frozen(extension))


def sheet(radius: float, *, dpi: float = 300.0) -> Image:
    """The sheet to print: circle and marks, the beginning on the right [radius in m]."""
    x, y = _places(radius, dpi, (0.0, 0.0), 0.0)
    return _shown(_print(x, y, radius, dpi))


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
    x, y = _places(radius, dpi, shifted, turned)
    paper = _print(x, y, radius, dpi)
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
    stroke = _edge(0.5 * STROKE - np.abs(reach[near] - line), dpi) * (here <= angle.max())
    grain = 1.0 + GRAIN * rng.standard_normal(x.shape)[near]
    dark = stroke * (1.0 - GRAPHITE) * np.clip(grain, 0.0, 1.3)
    paper[near] *= (1.0 - np.clip(dark, 0.0, 0.95))[:, None]
    noise = rng.standard_normal(paper.shape)
    noise *= GLOW
    noise += paper
    return _shown(noise)


def _places(
    radius: float, dpi: float, shifted: tuple[float, float], turned: float
) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates of every dot on the paper, x towards the beginning, y a quarter counter-clockwise [m]."""
    dots = int(np.ceil(2.0 * radius * (1.0 + BORDER) / INCH * dpi))
    along = (np.arange(dots) - 0.5 * (dots - 1)) * INCH / dpi
    across, down = np.meshgrid(along - shifted[0], along + shifted[1])
    c, s = np.cos(turned), np.sin(turned)
    return c * across - s * down, -s * across - c * down


def _print(x: np.ndarray, y: np.ndarray, radius: float, dpi: float) -> np.ndarray:
    ink = np.zeros(x.shape)
    ring = np.abs(np.hypot(x, y) - radius)
    near = ring < 0.5 * PRINT + INCH / dpi
    ink[near] = _edge(0.5 * PRINT - ring[near], dpi)
    for along, beside, end in ((x, y, LONG), (y, x, MARK[1]), (-x, y, MARK[1]), (-y, x, MARK[1])):
        near = (np.abs(beside) < 0.5 * PRINT + INCH / dpi) & (along > 0.5 * radius)
        along, beside = along[near], beside[near]
        inside = np.minimum(along - radius * (1.0 + MARK[0]), radius * (1.0 + end) - along)
        ink[near] = np.maximum(ink[near], _edge(np.minimum(0.5 * PRINT - np.abs(beside), inside), dpi))
    paper = np.full((*x.shape, 3), PAPER)
    inked = ink > 0.0
    paper[inked] = PAPER * (1.0 - ink[inked][:, None] * (1.0 - RED))
    return paper


def _edge(inside: np.ndarray, dpi: float) -> np.ndarray:
    """Share of a dot that ink covers, by how far its middle is inside [m]."""
    return np.clip(0.5 + inside * dpi / INCH, 0.0, 1.0)


def _shown(reflectance: np.ndarray) -> Image:
    """A picture of these reflectances, which are used up."""
    reflectance *= 255.0
    reflectance += 0.5
    return np.clip(reflectance, 0, 255, out=reflectance).astype(np.uint8)
