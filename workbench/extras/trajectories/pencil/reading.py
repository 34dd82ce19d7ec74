"""A path that an arm drew on a printed circle, read from a scan: profile out, Cartesian errors with it.

The print is red and the pencil grey: relative to red, green shows the print alone, and red shows the pencil
alone. Around the print's middle both are sampled along rays; on each, the centroid of the ink is where its
line crosses. The printed line is fitted by

    r(ψ) = r_0 + r_1 cos ψ + r_2 sin ψ + r_3 cos 2ψ + r_4 sin 2ψ

(its middle off by r_1, r_2, its axes unequal by r_3, r_4), r_0 being the known radius: this is the scale. The
long mark shows where the path begins. A drawn line says how far the path was outside or inside, not when it
was where: errors along the path itself remain unseen.

With the potentiometer's reading s and the tool's axis z the tip was at the drawn point minus s z, so that

    outside = drawn − s (z·ρ),      above = −s (z·n),

ρ the ray, n the normal about which the path turns (Katana §5.5.2).
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, UInt8
from PIL import Image as Pictures
from PIL import UnidentifiedImageError
from scipy.ndimage import map_coordinates

from workbench.base.circles import fit_circle
from workbench.base.errors import DataError, FileError
from workbench.base.types import Positions, Vector3, frozen

RAYS = 1440
"""Rays about the middle."""
INKED = 0.25
"""Minimum share of green light that the print absorbs, relative to red."""
DARK = 0.15
"""Minimum share of red light that the pencil absorbs."""
MIN_DOTS = 500
"""Red dots below which there is no print."""
MIN_RAYS = 0.8
"""Share of the rays that must show the printed line."""
WIDE = 0.06
"""Half the width of the ring that is searched, as a share of the radius."""
LINE_HALF_WIDTH = 0.012
"""Half the width about the darkest place that belongs to a line, as a share of the radius."""
OVAL = 0.02
"""Maximum share by which a scan may be oval."""
ROUGH = 0.04
"""Maximum distance of the print's dots from a circle, as a share of the radius."""
MARKED = (0.085, 0.125)
"""Where the long mark alone is, outside the circle, as shares of the radius."""
OUTLIER_ROUNDS = 4
"""Rounds of every fit that leaves outliers out."""


@dataclass(frozen=True, eq=False, kw_only=True)
class PlottedProfile:
    """A drawn line beside the printed circle.

    Args:
        angle: Of every ray from the beginning, counter-clockwise for who looks at the paper [rad].
        out: How far outside the printed circle the pencil was [m]; NaN where it drew nothing.
        scale: Size of a dot [m].
        oval: By how much the scan's axes differ, as a share.
    """

    angle: Float[np.ndarray, " rays"]
    out: Float[np.ndarray, " rays"]
    scale: float
    oval: float

    @property
    def drawn(self) -> Bool[np.ndarray, " rays"]:
        return np.isfinite(self.out)

    def at(self, angle: Float[np.ndarray, " rows"]) -> Float[np.ndarray, " rows"]:
        """How far outside at other angles [m]; NaN where one of the two rays beside has nothing."""
        place = (angle % (2.0 * np.pi)) / (2.0 * np.pi) * len(self.out)
        low = np.floor(place).astype(int)
        share = place - low
        beside = self.out[low % len(self.out)], self.out[(low + 1) % len(self.out)]
        return (1.0 - share) * beside[0] + share * beside[1]


@dataclass(frozen=True, eq=False, kw_only=True)
class PlottedErrors:
    """Errors of the tool's tip along a circle, as far as a drawing and a potentiometer show them.

    Args:
        out: Outside the circle, in its plane [m]; NaN where nothing was drawn.
        above: Along the normal about which the path turns [m].
        vector: Both together in the robot's base [m].
    """

    out: Float[np.ndarray, " rows"]
    above: Float[np.ndarray, " rows"]
    vector: Positions

    @property
    def distance(self) -> Float[np.ndarray, " rows"]:
        return np.linalg.norm(self.vector, axis=1)


def read_scan(path: Path | str) -> UInt8[np.ndarray, "height width 3"]:
    """A scan as red, green and blue."""
    try:
        with Pictures.open(path) as picture:
            return np.asarray(picture.convert("RGB"))
    except (UnidentifiedImageError, OSError, Pictures.DecompressionBombError) as error:
        raise FileError(
            f"can't be read as a picture ({error}); give a scan as .png", path=str(path)
        ) from None


def plotted_profile(
    scan: UInt8[np.ndarray, "height width 3"], radius: float, *, source: str = "the scan"
) -> PlottedProfile:
    """The pencil's line beside the printed circle.

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
    shape = _harmonics(_rays())
    ring = shape @ line
    oval = float(np.hypot(line[3], line[4]) / line[0])
    if oval > OVAL:
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
    angle = (_rays() - begin) % (2.0 * np.pi)
    order = np.argsort(angle)
    out = radius * (crossed / ring - 1.0)
    even = np.linspace(0.0, 2.0 * np.pi, RAYS, endpoint=False)
    return PlottedProfile(
        angle=frozen(even),
        out=frozen(np.interp(even, angle[order], out[order], period=2.0 * np.pi)),
        scale=radius / float(line[0]),
        oval=oval,
    )


def plotted_errors(
    profile: PlottedProfile,
    points: Positions,
    axes: Float[np.ndarray, "rows 3"],
    extension: Float[np.ndarray, " rows"],
    *,
    centre: Vector3,
    along: Vector3,
    across: Vector3,
) -> PlottedErrors:
    """Cartesian errors along a path, from what it drew and what the potentiometer read.

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
    drawn = profile.at(-angle if clockwise else angle)
    out = drawn - extension * np.sum(axes * ray, axis=1)
    above = -extension * (axes @ normal)
    return PlottedErrors(
        out=frozen(out), above=frozen(above), vector=frozen(out[:, None] * ray + above[:, None] * normal)
    )


def _rays() -> Float[np.ndarray, " rays"]:
    """Angles of the rays, counter-clockwise from the picture's right [rad]."""
    return np.linspace(0.0, 2.0 * np.pi, RAYS, endpoint=False)


def _harmonics(angle: np.ndarray) -> Float[np.ndarray, "rays 5"]:
    parts = [np.ones(len(angle)), np.cos(angle), np.sin(angle), np.cos(2 * angle), np.sin(2 * angle)]
    return np.stack(parts, 1)


def _rough(inked: np.ndarray, source: str) -> tuple[np.ndarray, float]:
    """Middle (row, column) and radius of the print, in dots, from the red dots alone."""
    row, column = np.nonzero(inked > INKED)
    if len(row) < MIN_DOTS:
        raise DataError(
            f"{source} shows no recognisable circle: there is no red print in it; print the sheet in colour "
            "and scan it in colour"
        )
    dots = np.stack([row, column, np.zeros(len(row))], 1).astype(float)[:: max(1, len(row) // 20_000)]
    for _ in range(OUTLIER_ROUNDS):
        circle = fit_circle(dots)
        away = np.abs(circle.out)
        dots = dots[away <= max(3.0 * float(np.median(away)), 2.0)]
    if np.median(away) > ROUGH * circle.radius or len(dots) < MIN_DOTS // 5:
        raise DataError(
            f"{source} shows no recognisable circle: its red print is not round; scan the whole sheet and "
            "nothing else"
        )
    return circle.centre[:2], circle.radius


def _refined(
    inked: np.ndarray, middle: np.ndarray, size: float, source: str
) -> tuple[np.ndarray, np.ndarray]:
    """Middle in dots, and the coefficients of the printed line about it, marks left out."""
    shape = _harmonics(_rays())
    for _ in range(2):
        found = _crossings(inked, middle, np.full(RAYS, size), INKED)
        seen = np.isfinite(found)
        if seen.mean() < MIN_RAYS:
            raise DataError(
                f"{source} shows no recognisable circle: the printed line is seen along "
                f"{100 * seen.mean():.0f} % of it only; scan the whole sheet",
                found=float(seen.mean()),
            )
        for _ in range(OUTLIER_ROUNDS):
            line = np.linalg.lstsq(shape[seen], found[seen], rcond=None)[0]
            away = np.abs(found - shape @ line)
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
    angle = _rays()[:, None]
    places = np.stack([middle[0] - distance * np.sin(angle), middle[1] + distance * np.cos(angle)])
    return map_coordinates(ink, places, order=1, mode="constant", cval=0.0)


def _beginning(inked: np.ndarray, middle: np.ndarray, size: float, source: str) -> float:
    """Angle of the long mark, counter-clockwise from the picture's right [rad]."""
    radius = size * (1.0 + np.linspace(*MARKED, 40))
    seen = _sampled(inked, middle, np.broadcast_to(radius, (RAYS, len(radius)))).mean(axis=1)
    strength = np.where(seen > 0.5 * INKED, seen, 0.0)
    together = np.abs(np.sum(strength * np.exp(1j * _rays()))) / max(strength.sum(), 1e-9)
    if together < 0.99:
        raise DataError(
            f"{source}: the long mark where the path begins is not found outside the printed circle; print "
            "the sheet with `workbench pencil sheet` and scan all of it"
        )
    return float(np.angle(np.sum(strength * np.exp(1j * _rays()))))
