"""The palette, with one colour per meaning, and a logarithmic colour scale for the errors of all models."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, UInt8

from workbench.report import colours as models
from workbench.session.comparison import ModelStage


def _rgb(code: str) -> tuple[int, int, int]:
    red, green, blue = bytes.fromhex(code[1:])
    return red, green, blue


LINK = (233, 237, 242)
JOINT = (92, 112, 146)
PROBE = (120, 130, 146)
PLATE = (203, 210, 220)

REACHED = (202, 168, 120)
SELECTED = (37, 99, 235)
BLOCKED = (133, 77, 14)
OUT_OF_REACH = (220, 68, 55)

REGION = BRANCH = (100, 116, 139)
GHOST = (148, 156, 168)
GRID = (115, 122, 134)
"""Lines that are seen through: they suit light and dark pages."""

SKY = (246, 248, 251)
SKY_DARK = (24, 27, 33)

NOMINAL, GEOMETRY, CALIBRATED = map(_rgb, (models.NOMINAL, models.GEOMETRY, models.CALIBRATED))
MARK = (250, 204, 21)


STAGE_COLOURS = dict(zip(ModelStage, (NOMINAL, GEOMETRY, CALIBRATED), strict=True))

BLAMED = (225, 29, 72)
EVENT = _rgb(models.EVENT)
FITTED = (13, 148, 136)
EXCLUDED = (148, 163, 184)
SET_APART = (220, 20, 60)
NO_VALUE = (176, 184, 196)
UNBOUNDED = (110, 20, 40)
SCALE = np.array(
    [
        (235, 87, 40),
        (228, 78, 82),
        (208, 72, 124),
        (180, 72, 162),
        (152, 88, 200),
        (120, 104, 220),
        (88, 122, 236),
    ],
    float,
)
"""From bad to good: all stand out on light and on dark pages, the worst most, also to the colour-blind."""
GAMMA = 2.2


def scale_colours(shares: Float[np.ndarray, " n"]) -> UInt8[np.ndarray, "n 3"]:
    """Colours of places on the scale, 0 bad to 1 good."""
    stops = np.linspace(0.0, 1.0, len(SCALE))
    return np.stack([np.interp(shares, stops, SCALE[:, i]) for i in range(3)], -1).astype(np.uint8)


def css(colour: tuple[int, int, int]) -> str:
    return "#{:02x}{:02x}{:02x}".format(*colour)


def linear(colours: UInt8[np.ndarray, "n 3"]) -> UInt8[np.ndarray, "n 3"]:
    """Colours of points and faces for viser, whose pages take them for linear ones."""
    return np.round(255.0 * (colours / 255.0) ** GAMMA).astype(np.uint8)


LOWEST, HIGHEST = 0.05, 0.95
"""Quantiles of the errors of the best and of the worst model that the scale lies between."""
MIN_SPAN = 5.0
"""Minimum ratio of its ends."""
MIN_ERROR = 1e-6
"""Errors below this are one colour [m]."""
DIGITS = (1.0, 2.0, 5.0)


@dataclass(frozen=True)
class ErrorScale:
    """From good to bad.

    Args:
        low: Error that is good [m]; smaller ones have the same colour.
        high: Error that is bad [m]; greater ones have the same colour.
    """

    low: float
    high: float

    @classmethod
    def of(cls, errors: Float[np.ndarray, "rows models"]) -> "ErrorScale":
        """A scale with round ends that tells apart the errors [m] of every model; NaN where unknown."""
        known = errors[:, np.isfinite(errors).any(0)]
        if not known.size:
            return cls(1e-4, 1e-3)
        low = max(float(np.nanquantile(known, LOWEST, axis=0).min()), MIN_ERROR)
        high = max(float(np.nanquantile(known, HIGHEST, axis=0).max()), MIN_SPAN * low)
        return cls(rounded(low, up=False), rounded(high, up=True))

    def shares(self, errors: Float[np.ndarray, "*n"]) -> Float[np.ndarray, "*n"]:
        """Place of errors [m] on the scale, 0 good to 1 bad; NaN where unknown."""
        span = np.log(self.high / self.low)
        return np.clip(np.log(np.maximum(errors, self.low) / self.low) / span, 0.0, 1.0)

    def colours(self, errors: Float[np.ndarray, " n"]) -> UInt8[np.ndarray, "n 3"]:
        """Colours of errors [m]; grey where unknown."""
        shares = self.shares(errors)
        colours = scale_colours(1.0 - np.nan_to_num(shares))
        colours[np.isnan(shares)] = NO_VALUE
        return colours

    @property
    def ticks(self) -> tuple[float, ...]:
        """Round numbers from end to end [m], at most seven."""
        first, last = (int(np.floor(np.log10(end) + 1e-9)) for end in (self.low, self.high))
        every = [d * 10.0**k for k in range(first, last + 1) for d in DIGITS]
        inside = [t for t in every if self.low * (1 - 1e-6) <= t <= self.high * (1 + 1e-6)]
        decades = [t for t in inside[1:-1] if abs(np.log10(t) - round(np.log10(t))) < 1e-6]
        return tuple(inside if len(inside) <= 7 else (inside[0], *decades, inside[-1]))


def gradient(*, larger_is_better: bool = False) -> str:
    """The scale as a CSS background, small numbers on the left."""
    stops = ",".join(css((int(r), int(g), int(b))) for r, g, b in SCALE[:: 1 if larger_is_better else -1])
    return f"linear-gradient(90deg,{stops})"


def rounded(value: float, *, up: bool) -> float:
    """The nearest of 1, 2, 5, 10 … beyond a value."""
    power = 10.0 ** np.floor(np.log10(value))
    steps = [d * p for p in (0.1 * power, power, 10.0 * power) for d in DIGITS]
    if up:
        return float(min(s for s in steps if s >= value * (1 - 1e-9)))
    return float(max(s for s in steps if s <= value * (1 + 1e-9)))
