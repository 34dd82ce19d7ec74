"""Unit conversion on input: from column headings and settings to SI.

Inside the package every number is SI (temperatures in degC). A unit is looked up once, as
SI = scale · value + offset, in a registry that is built when the first uncommon unit is asked for.
"""

import re
from dataclasses import dataclass
from enum import StrEnum
from functools import cache, lru_cache
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from workbench.base.errors import UnitError


class Quantity(StrEnum):
    """What a number measures; the value is the unit that it has inside the package."""

    ANGLE = "rad"
    LENGTH = "m"
    TIME = "s"
    TEMPERATURE = "degC"
    MASS = "kg"
    TORQUE = "N*m"
    FORCE = "N"
    PIXEL = "px"
    NUMBER = "1"


EXAMPLES = {q: str(q) for q in Quantity} | {Quantity.ANGLE: "rad or deg", Quantity.LENGTH: "m or mm"}
EXAMPLES |= {Quantity.NUMBER: "nothing"}

# Spellings that the registry does not know, or knows as something else ('Nm' as number-metre, 'Grad' as
# gigaradian, 'px' as 1/96 inch). 'Grad' is German for degree; 'grad' is the gon.
ALIASES = {
    **dict.fromkeys(("Grad", "Deg", "DEG", "grados", "Grados", "gradi", "degrés", "degré", "度"), "degree"),
    **dict.fromkeys(("derece", "graus", "град", "도"), "degree"),
    **dict.fromkeys(("Rad", "RAD", "radianes", "radianti", "弧度"), "radian"),
    "rev": "turn",
    **dict(zip(("MM", "мм", "см", "м"), ("mm", "mm", "cm", "m"), strict=True)),
    "px": "pixel",
    "gon": "grade",
    "sec": "second",
    **dict(zip(("Zoll", "毫米", "厘米", "米", "英寸"), ("inch", "mm", "cm", "m", "inch"), strict=True)),
    **dict.fromkeys(("℃", "C", "Celsius"), "degC"),
    "F": "degF",
    **dict.fromkeys(("-", "–", "1"), ""),
}
REMARKS = {
    "Grad": "'Grad' is read as the degree (360 to a turn)",
    "grad": "'grad' is read as the gon (400 to a turn)",
}

_TORQUE = re.compile(r"([mkµμu]?)N[ ·.*⋅-]?([mc]?m)")
_UNIT_TEXT = re.compile(r"[A-Za-zµμ°Ωπ℃%·⋅*/^ .()_-]{0,24}(?:[\^*]-?\d)?[A-Za-zµμ·⋅*/ ]{0,12}")
_BRACKETED = re.compile(r"(?P<name>.*?)\s*\[(?P<unit>[^\[\]]*)\]\s*")
_UNIT_IN_TEXT = re.compile(r"(?P<name>.+?)\s*(?:\((?P<a>[^()]+)\)|(?:\s/\s*|(?:\s+in|,)\s+)(?P<b>\S+))\s*")


class Heading(NamedTuple):
    """A column heading: its name, and the unit that stands with it (None: none)."""

    name: str
    unit: str | None


@dataclass(frozen=True)
class Conversion:
    """SI = scale · value + offset, for one unit of one quantity."""

    quantity: Quantity
    scale: float
    offset: float

    def to_si(self, values: Float[np.ndarray, "..."]) -> Float[np.ndarray, "..."]:
        whole = round(1.0 / self.scale)
        if self.offset == 0.0 and whole > 1 and abs(whole * self.scale - 1.0) < 1e-14:
            return values / whole  # exact powers of ten: 0.001 is no binary number, 1000 is
        return values if (self.scale, self.offset) == (1.0, 0.0) else values * self.scale + self.offset


COMMON = {
    **{str(q): Conversion(q, 1.0, 0.0) for q in Quantity if q is not Quantity.PIXEL},
    "": Conversion(Quantity.NUMBER, 1.0, 0.0),
    "deg": Conversion(Quantity.ANGLE, np.pi / 180, 0.0),
    "mm": Conversion(Quantity.LENGTH, 1e-3, 0.0),
}
"""Units of nearly every file, known without the registry: to build it takes half a second."""


def parse_heading(text: str) -> Heading:
    """Split a column heading into name and unit.

    'q1[deg]' and 'q1 [deg]' always; 'q1 (deg)', 'x / mm', 'x, mm', 'x in mm' where what stands there is one.
    """
    text = text.strip().replace("\uff08", "(").replace("\uff09", ")")  # of Chinese
    if match := _BRACKETED.fullmatch(text):
        return Heading(match["name"].strip(), match["unit"].strip())
    if match := _UNIT_IN_TEXT.fullmatch(text):
        unit = (match["a"] or match["b"]).strip()
        if is_unit(unit):
            return Heading(match["name"].strip(), unit)
    return Heading(text, None)


@lru_cache
def is_unit(text: str) -> bool:
    """Whether the text is a unit of one of our quantities (a number without unit is not)."""
    try:
        conversion(text, *(quantity for quantity in Quantity if quantity is not Quantity.NUMBER))
    except UnitError:
        return False
    return True


@cache
def conversion(unit: str, *quantities: Quantity) -> Conversion:
    """How a unit turns into SI.

    Args:
        unit: As people write it: 'deg', '°', 'mm', 'µm', 'N*m', 'Nm', 'degC', 'arcmin', …
        *quantities: What the column may measure, in order of preference.
    """
    if (common := COMMON.get(unit)) is not None and common.quantity in quantities:
        return common
    parsed, registry = _parsed(unit), _registry()
    if Quantity.MASS in quantities and parsed.is_compatible_with("N"):  # a load by its weight
        parsed /= registry.parse_units("standard_gravity")
    for quantity in quantities:
        other = _parsed(str(quantity))
        if parsed.dimensionality != other.dimensionality:
            continue
        if parsed.dimensionless and registry.get_root_units(parsed)[1] != registry.get_root_units(other)[1]:
            continue  # angles and plain numbers are both dimensionless, and must not be mixed up
        zero, one = (float(registry.Quantity(v, parsed).to(other).magnitude) for v in (0.0, 1.0))
        return Conversion(quantity, one - zero if zero else one, zero)
    wanted = " or ".join(EXAMPLES[quantity] for quantity in quantities)
    raise UnitError(f"the unit '{unit}' does not fit here: convert to {wanted}", unit=unit)


def to_si(values: Float[np.ndarray, "..."], unit: str, *quantities: Quantity) -> Float[np.ndarray, "..."]:
    """Values in a unit, in SI (temperatures in degC)."""
    return conversion(unit, *quantities).to_si(values)


def parse_quantity(text: str, quantity: Quantity) -> float:
    """A setting such as '0.05 mm', in SI."""
    match = re.fullmatch(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*", text)
    if match is None or (not match[2] and quantity is not Quantity.NUMBER):
        number, why = ("0.1", "is not a number with a unit") if match is None else (match[1], "has no unit")
        units = EXAMPLES[quantity].split(" or ")
        how = " or ".join(f"{number} {unit}" for unit in units)
        raise UnitError(f"'{text}' {why}: write {how}", unit=text)
    return float(to_si(np.array([float(match[1])]), match[2], quantity)[0])


@cache
def _registry():
    """The unit registry; built on first use, as that takes half a second."""
    import pint

    return pint.UnitRegistry(autoconvert_offset_to_baseunit=True)


def _parsed(unit: str):
    """The registry's unit for a text."""
    text = ALIASES.get(unit.strip(), unit.strip())
    if match := _TORQUE.fullmatch(text):
        text = f"{match[1]}N*{match[2]}"
    if _UNIT_TEXT.fullmatch(text):
        try:
            return _registry().parse_units(text.replace("⋅", "*"))
        except Exception:  # the registry's parser answers odd text with nearly any exception
            pass
    known = "rad, deg, m, mm, s, degC, kg or N*m"
    raise UnitError(f"the unit '{unit}' is unknown: write e.g. {known}", unit=unit)
