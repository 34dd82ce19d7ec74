"""Coefficients of effects in units that people read."""

from dataclasses import dataclass

import numpy as np

from workbench.arm.chain import Chain
from workbench.arm.effects import AbstractEffect
from workbench.report.numbers import readable_unit

LISTED = 6
"""Most coefficients of one effect that are listed one by one."""


@dataclass(frozen=True)
class Size:
    """One coefficient.

    Args:
        name: Such as `joint3.compliance`.
        value: In the unit.
        std: Standard error, likewise.
        unit: For people.
    """

    name: str
    value: float
    std: float
    unit: str

    @property
    def words(self) -> str:
        """Such as `0.0412 ± 0.0003 mrad/(N·m)`: two digits of the standard error."""
        if not np.isfinite(self.std) or self.std <= 0.0:
            return f"{self.value:.3g} {self.unit}".replace("-", "−")
        digits = int(np.clip(1 - np.floor(np.log10(self.std)), 0, 9))
        return f"{self.value:.{digits}f} ± {self.std:.{digits}f} {self.unit}".replace("-", "−")


def sizes(effect: AbstractEffect, std: tuple[float, ...], chain: Chain) -> tuple[Size, ...]:
    """Every coefficient of an effect with its standard error, in readable units."""
    units = [readable_unit(unit) for unit in effect.units(chain)]
    return tuple(
        Size(name, value * factor, error * factor, unit)
        for name, value, error, (factor, unit) in zip(
            effect.names, effect.coefficients, std, units, strict=True
        )
    )


def lines(effect: AbstractEffect, std: tuple[float, ...], chain: Chain) -> tuple[tuple[str, str], ...]:
    """Names and values for a table; of many coefficients only the one that is surely largest."""
    found = sizes(effect, std, chain)
    if len(found) <= LISTED:
        return tuple((size.name, size.words) for size in found)
    largest = max(found, key=lambda size: abs(size.value) - size.std)
    return ((f"{len(found)} coefficients, largest {largest.name}", largest.words),)
