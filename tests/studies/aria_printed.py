"""What the ARIA paper prints: its four tables and its limits, number by number.

Columns of Tables 1, 3 and 4 are θ [rad], d [m], a [m], α [rad], β [rad]; the printed ∗, and a column that a
table does not have, is empty or NaN. Tables 3 and 4 keep their digits, which say how they are rounded.
Source: ARIA Tables 1–4, eq. (2).
"""

import numpy as np

from workbench.base.types import frozen

NAN = np.nan
COLUMNS = ("theta", "d", "a", "alpha", "beta")

TABLE_1 = frozen(
    np.array(
        [
            [0.0, 0.205, 0.0, np.pi / 2, NAN],
            [0.0, 0.0, 0.41, 0.0, NAN],
            [np.pi / 2, -0.0048, 0.03, np.pi / 2, NAN],
            [0.0, 0.336, 0.0, -np.pi / 2, NAN],
            [0.0, -0.049, 0.0, np.pi / 2, NAN],
            [0.0, 0.202, 0.0, 0.0, NAN],
        ]
    )
)
"""Nominal Denavit–Hartenberg parameters."""

TABLE_2 = frozen(
    np.array(
        [
            [0.566, 0.354, 0.235, -150, 0, 0],
            [0.518, 0.501, 0.235, -160, 0, 0],
            [0.393, 0.592, 0.235, -150, 0, 0],
            [0.238, 0.592, 0.235, -160, 0, 0],
            [0.113, 0.501, 0.235, -150, 0, 0],
            [0.066, 0.354, 0.235, -160, 0, 0],
            [0.113, 0.207, 0.235, -150, 0, 0],
            [0.238, 0.116, 0.235, -160, 0, 0],
            [0.393, 0.116, 0.235, -150, 0, 0],
            [0.518, 0.207, 0.235, -160, 0, 0],
        ]
    )
)
"""Calibration tool: X, Y, Z [m], roll, pitch, yaw [deg]."""

TABLE_3 = (
    ("1.67e-7", "0.205", "1.28e-6", "1.57", ""),
    ("1.17e-6", "", "0.41", "0.1", "-1.41e-7"),
    ("1.57", "-0.0048", "0.03", "1.57", ""),
    ("-0.8", "0.34", "-3.25e-7", "-1.57", ""),
    ("3.16e-7", "-0.049", "-2.00e-8", "1.57", ""),
    ("-3.97e-7", "0.205", "-7.38e-8", "5.39e-8", ""),
)
"""Identified from a virtual arm (OLS), digit by digit."""

TABLE_3_HIDDEN = {"joint2.alpha": 0.1, "joint4.theta": -0.8, "joint6.d": 0.205}
"""Constants of Table 3 that are plainly not nominal: what was hidden in the paper's virtual arm."""

TABLE_4 = (
    ("0.0068", "0.21", "-0.0016", "1.58", ""),
    ("-0.0024", "", "0.41", "-0.011", "0.0063"),
    ("1.54", "-0.0066", "0.036", "1.59", ""),
    ("-0.015", "0.34", "-0.00081", "-1.59", ""),
    ("0.026", "-0.049", "0.0018", "1.56", ""),
    ("0.0093", "0.216", "-0.0011", "-0.0087", ""),
)
"""Identified from the real arm (OLS), digit by digit."""

LIMITS = (
    ("−2π", "2π"),
    ("−0.97", "3.615"),
    ("2π", "1.69"),
    ("−2π", "2π"),
    ("−π", "π"),
    ("−2π", "2π"),
)
"""Joint limits of eq. (2), as printed."""

RADIUS = 0.25
"""Radius of the circle of targets, §4.3 [m]."""
REQUIRED_ANGLE = 0.66
"""Greatest orientation error, §2.4 [deg]."""
REQUIRED_POSITION = 1e-3
"""Greatest position error of an axis, §2.4 [m]."""
MADE_LENGTH, MADE_ANGLE = 5e-3, 5.0
"""Greatest manufacturing errors, §2.4 [m], [deg]."""
MEASURED_POSITION, MEASURED_ANGLE = 0.5, 0.43
"""Errors of the real arm after calibration, §5.3 [mm], [deg]."""
REDUCTION = 5.0
"""How much smaller they had become, §5.3."""


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
