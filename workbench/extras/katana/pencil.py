"""A path checked with pencil and paper: a circle drawn by an arm on a printed one (Katana §5.5.2).

The sheet lies in the plane of the path. It carries the circle in red, with a mark at every quarter and a
long one where the path begins. The pencil slides in the tool against a spring: it touches the paper at
p + s z, p the tool's tip, z its axis, and a potentiometer reads how far s it stands out.

In a scan, relative to red, green shows the print alone, and red shows the pencil alone, so that they can be
distinguished where they cross. Around the print's middle both are sampled along rays; on each, the centroid
of the ink is where its line crosses. The printed line is fitted by

    r(ψ) = r_0 + r_1 cos ψ + r_2 sin ψ + r_3 cos 2ψ + r_4 sin 2ψ

(its middle off by r_1, r_2, its axes unequal by r_3, r_4), r_0 being the known radius: this is the scale. A
drawn line says how far the path was outside or inside, not when it was where. With ρ the ray and n the
normal about which the path turns, the tip was

    outside = drawn − s (z·ρ),      above = −s (z·n).
"""

import numpy as np
from jaxtyping import Float, UInt8
from scipy.ndimage import map_coordinates

from workbench.base.errors import DataError
from workbench.base.types import Positions, Vector3, frozen

INCH = 0.0254
PRINT = 0.3e-3
"""Width of the printed line [m]."""
BORDER, MARK, LONG = 0.2, (0.02, 0.07), 0.14
"""Of the circle's radius: paper around it, a quarter's mark outside it, the end of the beginning's mark."""
RED, PAPER = np.array([0.90, 0.22, 0.20]), 0.96
"""Reflectances of the printed ink and of the paper."""
ANGLES = np.linspace(0.0, 2.0 * np.pi, 1440, endpoint=False)
"""Of the rays, counter-clockwise [rad]."""
INKED, DARK = 0.25, 0.15
"""Minimum shares of green light that the print absorbs, relative to red, and of red that the pencil does."""
MIN_DOTS, MIN_RAYS = 500, 0.8
"""Red dots below which there is no print; share of the rays that must show the printed line."""
WIDE, LINE_HALF_WIDTH, ROUGH, MARKED = 0.06, 0.012, 0.04, (0.085, 0.125)
"""Of the circle's radius: half the ring that is searched, half of what belongs to a line about its darkest
place, maximum distance of the print's dots from a circle, and where the long mark alone is, outside it."""
OVAL = 0.02
"""Maximum share by which a scan may be oval."""
OUTLIER_ROUNDS = 4
"""Rounds of every fit that leaves outliers out."""
HARMONICS = np.stack(
    [f(k * ANGLES) for k, f in ((0, np.cos), (1, np.cos), (1, np.sin), (2, np.cos), (2, np.sin))], 1
)
"""What the coefficients r_0 … r_4 of the printed line multiply."""

Image = UInt8[np.ndarray, "height width 3"]
"""A picture in red, green and blue."""


def sheet(radius: float, *, dpi: float = 300.0) -> Image:
    """The sheet to print: circle and marks, the beginning on the right [radius in m]."""
    return shown(printed(*places(radius, dpi), radius, dpi))


def places(
    radius: float, dpi: float, shifted: tuple[float, float] = (0.0, 0.0), turned: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates of every dot on the paper, x towards the beginning, y a quarter counter-clockwise [m]."""
    dots = int(np.ceil(2.0 * radius * (1.0 + BORDER) / INCH * dpi))
    along = (np.arange(dots) - 0.5 * (dots - 1)) * INCH / dpi
    across, down = np.meshgrid(along - shifted[0], along + shifted[1])
    c, s = np.cos(turned), np.sin(turned)
    return c * across - s * down, -s * across - c * down


def printed(x: np.ndarray, y: np.ndarray, radius: float, dpi: float) -> np.ndarray:
    """Reflectance of every dot of the sheet."""
    ink = np.zeros(x.shape)
    ring = np.abs(np.hypot(x, y) - radius)
    near = ring < 0.5 * PRINT + INCH / dpi
    ink[near] = edge(0.5 * PRINT - ring[near], dpi)
    for along, beside, end in ((x, y, LONG), (y, x, MARK[1]), (-x, y, MARK[1]), (-y, x, MARK[1])):
        near = (np.abs(beside) < 0.5 * PRINT + INCH / dpi) & (along > 0.5 * radius)
        along, beside = along[near], beside[near]
        inside = np.minimum(along - radius * (1.0 + MARK[0]), radius * (1.0 + end) - along)
        ink[near] = np.maximum(ink[near], edge(np.minimum(0.5 * PRINT - np.abs(beside), inside), dpi))
    paper = np.full((*x.shape, 3), PAPER)
    inked = ink > 0.0
    paper[inked] = PAPER * (1.0 - ink[inked][:, None] * (1.0 - RED))
    return paper


def edge(inside: np.ndarray, dpi: float) -> np.ndarray:
    """Share of a dot that ink covers, by how far its middle is inside [m]."""
    return np.clip(0.5 + inside * dpi / INCH, 0.0, 1.0)


def shown(reflectance: np.ndarray) -> Image:
    return np.clip(255.0 * reflectance + 0.5, 0, 255).astype(np.uint8)


def plotted_profile(scan: Image, radius: float, *, source: str = "the scan") -> Float[np.ndarray, " rays"]:
    """How far outside the printed circle the pencil was [m]; NaN where it drew nothing.

    The rays are at `ANGLES` from the beginning, counter-clockwise for who looks at the paper.

    Args:
        scan: The sheet with the drawing, flat and whole.
        radius: Of the printed circle [m].
        source: Where it came from, for messages.
    """
    red, green = (scan[:, :, i].astype(np.float32) for i in (0, 1))
    inked = np.clip(1.0 - green / np.maximum(red, 1.0), 0.0, 1.0)
    dark = np.clip(1.0 - red / np.percentile(red, 90.0), 0.0, 1.0)
    middle, size = _rough(inked, source)
    middle, line = _refined(inked, middle, size, source)
    ring = HARMONICS @ line
    if (oval := float(np.hypot(line[3], line[4]) / line[0])) > OVAL:
        raise DataError(
            f"{source}: the printed circle is oval by {100 * oval:.1f} %, as in a picture taken from "
            "the side; scan the sheet flat",
            found=oval,
        )
    crossed = _crossings(dark, middle, ring, DARK)
    if (share := float(np.isfinite(crossed).mean())) < 0.5:
        raise DataError(
            f"{source}: a pencil's line is seen along {100 * share:.0f} % of the printed circle "
            "only; draw darker, or check the radius",
            found=share,
        )
    begin = _beginning(inked, middle, line[0], source)
    out = radius * (crossed / ring - 1.0)
    return frozen(np.interp(ANGLES, (ANGLES - begin) % (2.0 * np.pi), out, period=2.0 * np.pi))


def plotted_errors(
    profile: Float[np.ndarray, " rays"],
    points: Positions,
    axes: Float[np.ndarray, "rows 3"],
    extension: Float[np.ndarray, " rows"],
    *,
    centre: Vector3,
    along: Vector3,
    across: Vector3,
) -> Positions:
    """Errors of the tool's tip along a path, robot's base [m], from drawing and potentiometer.

    They are NaN where nothing was drawn.

    Args:
        profile: Of the drawing.
        points: Commanded points of the path, in order [m].
        axes: Direction of the tool's z axis at each, robot's base; it points into the paper.
        extension: How far the pencil stood out beyond its length at rest at each [m].
        centre: Middle of the commanded circle [m].
        along: Unit vector from there to its beginning.
        across: Unit vector from there to a quarter further.
    """
    away = points - centre
    angle = np.arctan2(away @ across, away @ along)
    normal = np.cross(along, across)
    clockwise = float(np.median(axes @ normal)) > 0.0
    ray = np.cos(angle)[:, None] * along + np.sin(angle)[:, None] * across
    drawn = np.interp(-angle if clockwise else angle, ANGLES, profile, period=2.0 * np.pi)
    out = drawn - extension * np.sum(axes * ray, axis=1)
    above = -extension * (axes @ normal)
    return frozen(out[:, None] * ray + above[:, None] * normal)


def _rough(inked: np.ndarray, source: str) -> tuple[np.ndarray, float]:
    """Middle (row, column) and radius of the print, in dots, from the red dots alone."""
    dots = np.argwhere(inked > INKED).astype(float)
    if len(dots) < MIN_DOTS:
        raise DataError(
            f"{source} shows no recognisable circle: there is no red print in it; print the sheet in colour "
            "and scan it in colour"
        )
    dots = dots[:: max(1, len(dots) // 20_000)]
    for _ in range(OUTLIER_ROUNDS):
        design = np.insert(2.0 * dots, 2, 1.0, axis=1)  # Kåsa, IEEE Trans. Instrum. Meas. 25 (1976)
        *middle, power = np.linalg.lstsq(design, (dots**2).sum(1), rcond=None)[0]
        size = float(np.sqrt(max(power + np.dot(middle, middle), 0.0)))
        away = np.abs(np.linalg.norm(dots - middle, axis=1) - size)
        dots = dots[away <= max(3.0 * float(np.median(away)), 2.0)]
    if np.median(away) > ROUGH * size or len(dots) < MIN_DOTS // 5:
        raise DataError(
            f"{source} shows no recognisable circle: its red print is not round; scan the whole sheet and "
            "nothing else"
        )
    return np.array(middle), size


def _refined(
    inked: np.ndarray, middle: np.ndarray, size: float, source: str
) -> tuple[np.ndarray, np.ndarray]:
    """Middle in dots, and the coefficients of the printed line about it, marks left out."""
    for _ in range(2):
        found = _crossings(inked, middle, np.full(len(ANGLES), size), INKED)
        seen = np.isfinite(found)
        if seen.mean() < MIN_RAYS:
            raise DataError(
                f"{source} shows no recognisable circle: the printed line is seen along "
                f"{100 * seen.mean():.0f} % of it only; scan the whole sheet",
                found=float(seen.mean()),
            )
        for _ in range(OUTLIER_ROUNDS):
            line = np.linalg.lstsq(HARMONICS[seen], found[seen], rcond=None)[0]
            away = np.abs(found - HARMONICS @ line)
            seen &= away <= max(4.0 * float(np.median(away[seen])), 0.05)
        middle, size = middle + np.array([-line[2], line[1]]), float(line[0])
        line[1:3] = 0.0
    return middle, line


def _crossings(ink: np.ndarray, middle: np.ndarray, ring: np.ndarray, minimum: float) -> np.ndarray:
    """Where a line crosses each ray near a ring, in dots from the middle; NaN where none does."""
    size = float(ring.mean())
    offset = np.arange(-WIDE * size, WIDE * size, 0.5)
    seen = _sampled(ink, middle, ring[:, None] + offset)
    peak = seen.argmax(axis=1)
    own = np.abs(offset - offset[peak][:, None]) <= LINE_HALF_WIDTH * size
    weight = np.clip(seen - 0.5 * minimum, 0.0, None) * own
    found = ring + (weight * offset).sum(axis=1) / np.maximum(weight.sum(axis=1), 1e-9)
    return np.where(seen.max(axis=1) >= minimum, found, np.nan)


def _sampled(ink: np.ndarray, middle: np.ndarray, distance: np.ndarray) -> np.ndarray:
    """The picture at some distances along every ray."""
    angle = ANGLES[:, None]
    places = np.stack([middle[0] - distance * np.sin(angle), middle[1] + distance * np.cos(angle)])
    return map_coordinates(ink, places, order=1, mode="constant", cval=0.0)


def _beginning(inked: np.ndarray, middle: np.ndarray, size: float, source: str) -> float:
    """Angle of the long mark, counter-clockwise from the picture's right [rad]."""
    radius = size * (1.0 + np.linspace(*MARKED, 40))
    seen = _sampled(inked, middle, np.broadcast_to(radius, (len(ANGLES), len(radius)))).mean(axis=1)
    strength = np.where(seen > 0.5 * INKED, seen, 0.0)
    mark = np.sum(strength * np.exp(1j * ANGLES))
    if np.abs(mark) < 0.99 * max(strength.sum(), 1e-9):
        raise DataError(
            f"{source}: the long mark where the path begins is not found outside the printed circle; scan "
            "the whole sheet"
        )
    return float(np.angle(mark))
