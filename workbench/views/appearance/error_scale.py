"""The colours of errors: one logarithmic scale for all models, so that before and after can be compared."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, UInt8

from workbench.views.appearance.colours import NO_VALUE, SCALE, css, scale_colours

LOWEST, HIGHEST = 0.05, 0.95
"""Quantiles of the errors of the best and of the worst model that the scale lies between."""
LEAST_SPAN = 5.0
"""Least ratio of its ends."""
SMALLEST = 1e-6
"""Errors below this are one colour [m]."""
ROOM = 0.16
"""Share of the scale that the words at its ends take."""
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
        low = max(float(np.nanquantile(known, LOWEST, axis=0).min()), SMALLEST)
        high = max(float(np.nanquantile(known, HIGHEST, axis=0).max()), LEAST_SPAN * low)
        return cls(_round(low, up=False), _round(high, up=True))

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
        if len(inside) > 7:
            low, *between, high = inside
            room = (high / low) ** ROOM
            decades = [t for t in between if abs(np.log10(t) - round(np.log10(t))) < 1e-6]
            inside = [low, *(t for t in decades if low * room <= t <= high / room), high]
        return tuple(inside)


def gradient() -> str:
    """The scale as a CSS background, from good on the left to bad."""
    stops = ",".join(css((int(r), int(g), int(b))) for r, g, b in SCALE[::-1])
    return f"linear-gradient(90deg,{stops})"


def _round(value: float, *, up: bool) -> float:
    """The nearest of 1, 2, 5, 10 … beyond a value."""
    power = 10.0 ** np.floor(np.log10(value))
    steps = [d * p for p in (0.1 * power, power, 10.0 * power) for d in DIGITS]
    if up:
        return float(min(s for s in steps if s >= value * (1 - 1e-9)))
    return float(max(s for s in steps if s <= value * (1 + 1e-9)))
