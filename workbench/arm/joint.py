"""A joint of an arm and the link after it: their data apart from the geometry."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Annotated, Any

import numpy as np

from workbench.base.arguments import Reads, not_below
from workbench.base.types import Vector3, frozen

MASS_TOLERANCE, COM_TOLERANCE = 0.1, 0.015
"""Default standard deviations of a file's masses (relative) and centres of mass [m]."""

INERTIA = ("mass", "com_x", "com_y", "com_z")
"""Fields about the weight of a link."""
MIN_DEVIATION = 1e-6
"""Minimum standard deviation of a mass [kg] or centre [m]."""


def _ordered(value: Any, given: Any) -> Any:
    low, high = value
    if low >= high:
        raise ValueError
    return value


NotNegative = Annotated[float, Reads("a finite number of at least 0", not_below(0.0))]
Limits = Annotated[tuple[float, float], Reads("two finite numbers, the smaller one first", _ordered)]


class JointKind(StrEnum):
    """What a joint does."""

    REVOLUTE = "revolute"
    PRISMATIC = "prismatic"
    FIXED = "fixed"


@dataclass(frozen=True, eq=False, kw_only=True)
class Joint:
    """Data of one joint and the link after it, apart from the geometry.

    Args:
        name: `joint1` … for moving joints, `fixed1` … for the others.
        kind: Revolute, prismatic or fixed.
        limits: Minimum and maximum coordinate [rad or m]; infinite where there is none.
        mass: Mass of the link [kg]; None if unknown.
        com: Its centre of mass in the link frame [m].
        mass_tolerance: Relative standard deviation of the mass.
        com_tolerance: Standard deviation of the centre of mass, each axis [m].
        max_moment: Maximum moment about the axis [N m].
        label: Its name in the robot's own file, such as `shoulder_pan_joint`; empty if none.
        link: Name of the link after it there.
    """

    name: str
    kind: JointKind = JointKind.REVOLUTE
    limits: Limits = (-np.inf, np.inf)
    mass: NotNegative | None = None
    com: Vector3 = field(default_factory=lambda: np.zeros(3))
    mass_tolerance: NotNegative = MASS_TOLERANCE
    com_tolerance: NotNegative = COM_TOLERANCE
    max_moment: NotNegative | None = None
    label: str = ""
    link: str = ""

    @property
    def inertia(self) -> dict[str, float]:
        """Mass [kg] and centre of mass [m] of its link by name: `joint3.mass`, `joint3.com_x` …"""
        return self._by_name(self.mass, *self.com) if self.mass else {}

    @property
    def inertia_tolerance(self) -> dict[str, float]:
        """Their standard deviations, by the same names."""
        if not self.mass:
            return {}
        sizes = (self.mass_tolerance * self.mass, *[self.com_tolerance] * 3)
        return self._by_name(*(max(float(size), MIN_DEVIATION) for size in sizes))

    def reweighed(self, values: Mapping[str, float]) -> "Joint":
        """With other mass and centre if `values` contains them; else unchanged."""
        known = self.inertia
        if known.keys().isdisjoint(values):
            return self
        mass, *com = (values.get(name, size) for name, size in known.items())
        return replace(self, mass=mass, com=frozen(np.array(com, float)))

    def _by_name(self, *values: float) -> dict[str, float]:
        return {f"{self.name}.{part}": float(v) for part, v in zip(INERTIA, values, strict=True)}
