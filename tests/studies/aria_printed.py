"""What the ARIA paper prints, from `aria_printed.toml`; in SI units unless a name says otherwise."""

import tomllib
from pathlib import Path

import numpy as np

from workbench.base.types import frozen

_PRINTED = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
_SIZES = _PRINTED["sizes"]

COLUMNS = tuple(_PRINTED["columns"])
TABLE_1 = frozen(np.array(_PRINTED["table_1"]) * [np.pi, 1.0, 1.0, np.pi])
"""Nominal θ [rad], d [m], a [m], α [rad]."""
TABLE_2 = frozen(np.array(_PRINTED["table_2"]))
"""Calibration tool: X, Y, Z [m], roll, pitch, yaw [deg]."""
TABLE_3, TABLE_4 = (tuple(map(tuple, _PRINTED[name])) for name in ("table_3", "table_4"))
"""Identified from a virtual arm and from the real one (OLS), digit by digit."""
TABLE_3_HIDDEN: dict[str, float] = _PRINTED["table_3_hidden"]
"""What was hidden in the paper's virtual arm."""
LIMITS_3 = _PRINTED["limits_3"]
"""Limits of joint 3 in eq. (2) [rad], and how they are printed."""
RADIUS = _SIZES["radius"]
"""Radius of the circle of targets [m]."""
REQUIRED_ANGLE, REQUIRED_POSITION = _SIZES["required_angle"], _SIZES["required_position"]
"""Greatest orientation error [deg] and position error of an axis [m], §2.4."""
MEASURED_POSITION, MEASURED_ANGLE = _SIZES["measured_position"], _SIZES["measured_angle"]
"""Errors of the real arm after calibration, §5.3 [mm], [deg]."""


def named(table: tuple[tuple[str, ...], ...]) -> dict[str, str]:
    """The printed numbers of Table 3 or 4 by our names of the constants, as they stand there."""
    return {
        f"joint{i + 1}.{column}": text
        for i, row in enumerate(table)
        for column, text in zip(COLUMNS, row, strict=True)
        if text
    }


def half_unit(text: str) -> float:
    """Half a unit of the last printed digit: by so much rounding may have moved the number."""
    mantissa, _, power = text.partition("e")
    digits = len(mantissa.partition(".")[2])
    return 0.5 * 10.0 ** (int(power or 0) - digits)
