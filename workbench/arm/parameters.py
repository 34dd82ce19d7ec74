"""Parameters of an identification: names, meanings and bounds."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

MAX_ANGLE, MAX_LENGTH = 1.0, 0.1
"""Bounds of a geometric constant about its nominal value [rad], [m]: wide enough for a joint mounted
45° off, narrow enough to exclude mirror solutions."""

FRAMES = ("base", "tool", "gravity")
"""Prefixes of the names of frames, and of gravity in the base's."""
OF_FRAMES = tuple(frame + mark for frame in FRAMES for mark in ".[")


@dataclass(frozen=True)
class Parameter:
    """One unknown of an identification.

    Args:
        name: `joint2.alpha`, `base.x`, `base[front].yaw`, `anchor[A].z` …
        unit: `rad` or `m`; `kg` for a mass.
        nominal: Nominal value, where the search starts, in that unit.
        is_coefficient: Whether it is a coefficient of an effect, in its own unit.
        is_inertia: Whether it is a link's mass, a coordinate of its centre, or an angle of gravity, which act
            through loads only.
        is_instrument: Whether it belongs to an observation: the place of an anchor, a contact, a marker …
    """

    name: str
    unit: str
    nominal: float
    is_coefficient: bool = False
    is_inertia: bool = False
    is_instrument: bool = False

    @property
    def bounds(self) -> tuple[float, float]:
        """Minimum and maximum value for bounded algorithms: `MAX_…` about nominal for the arm's constants."""
        width = (MAX_ANGLE if self.unit == "rad" else MAX_LENGTH) if self.is_geometry else np.inf
        return self.nominal - width, self.nominal + width

    @property
    def text(self) -> str:
        """Name for people: frames without the dot."""
        return " ".join(self.name.rsplit(".", 1)) if self.name.startswith(OF_FRAMES) else self.name

    @cached_property
    def is_geometry(self) -> bool:
        """True for a constant of the arm, false for effects, frames and the instrument's unknowns."""
        return self.is_plain and not self.is_instrument and not self.name.startswith(OF_FRAMES)

    @property
    def is_plain(self) -> bool:
        """True for parameters without effects: constants of the arm, of frames and of the instrument."""
        return not (self.is_coefficient or self.is_inertia)
