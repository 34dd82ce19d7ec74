"""Number formatting for people: enough digits to compare, no meaningless ones."""

import numpy as np


def short(value: float, digits: int = 3) -> str:
    """A number with fixed decimals, or in powers of ten where those would hide it; – if not finite."""
    if not np.isfinite(value):
        return "–"
    if value != 0.0 and abs(value) < 0.5 * 10.0**-digits:
        return f"{value:.0e}".replace("-", "−", 1) if value < 0 else f"{value:.0e}"
    return signed(value, digits) if value < 0 else f"{value:.{digits}f}"


def significant(value: float) -> str:
    """A number with three significant digits, as short as can be; – where nothing was measured."""
    return "–" if np.isnan(value) else f"{value:.3g}".replace("e+0", "e").replace("e-0", "e−")


def compared(value: float, digits: int = 3) -> str:
    """The same with its zeros, as beside others, and large ones without powers of ten: 0.430, 22 400."""
    if not np.isfinite(value):
        return "–" if np.isnan(value) else "∞"
    is_large = abs(value) >= 10.0**digits
    return f"{value:,.0f}".replace(",", " ") if is_large else f"{value:#.{digits}g}".rstrip(".")


def signed(value: float, digits: int) -> str:
    """Fixed decimals with a true minus sign, and no minus before zero."""
    text = f"{value:.{digits}f}"
    if float(text) == 0.0:
        text = text.lstrip("-")
    return text.replace("-", "−")


def standard_error(std: float, digits: int = 6) -> str:
    """±std with the decimals of its value, or in powers of ten where those would hide it."""
    return f"±{std:.{digits}f}" if std >= 0.95 * 10.0**-digits else f"±{std:.0e}"


def decimals_of(std: float, *, maximum: int = 6) -> int:
    """Decimals of a value with this standard error: as many as show two digits of the error."""
    if not np.isfinite(std) or std <= 0.0:
        return maximum
    return int(np.clip(1 - np.floor(np.log10(std)), 0, maximum))


MAX_DIGITS = 5
"""Digits of a value that people are shown at most, however small its standard error."""


def with_error(value: float, std: float) -> str:
    """`0.0412 ± 0.0003`: a value with the decimals of its standard error, of which two digits are shown.

    Without a standard error the value has three digits.
    """
    if not np.isfinite(std) or std <= 0.0:
        return f"{value:.3g}".replace("-", "−")
    decimals = decimals_of(std, maximum=12)
    finest = int(MAX_DIGITS - 1 - np.floor(np.log10(abs(value)))) if value else decimals
    if decimals > finest + 1:
        finest = max(finest, 0)
        return f"{signed(value, finest)} ± < {10.0**-finest:.{finest}f}"
    return f"{signed(value, decimals)} ± {std:.{decimals}f}"


READABLE = {
    "rad": (1e3, "mrad"),
    "m": (1e3, "mm"),
    "1": (1e2, "%"),
    "rad/(N*m)": (1e3, "mrad/(N·m)"),
    "m/N": (1e6, "µm/N"),
    "1/K": (1e6, "µm/(m·K)"),
    "m/s": (3.6e6, "mm/h"),
    "rad/(N*m*m)": (1e3, "mrad/(N·m) per m"),
    "rad/s": (3.6e6, "mrad/h"),
    "rad/m": (1.0, "mrad/mm"),
    "m/rad": (1.0, "mm/mrad"),
}
"""Factor and name of the unit in which people read an effect's coefficient, by its SI unit."""


def readable_unit(unit: str) -> tuple[float, str]:
    """Factor and name of the unit in which people read a coefficient; an unknown SI unit stays as it is."""
    return READABLE.get(unit, (1.0, unit))


def readable(value: float, unit: str) -> str:
    """A coefficient [SI] with three digits in the unit that people read."""
    factor, name = readable_unit(unit)
    return f"{factor * value:.3g} {name}"
