"""What the Katana thesis prints: its constants, its joints' parameters, its results, number by number.

Stiffness is printed in kg·m/°, a kilogram's weight on an arm of a metre for each degree; it is turned into
SI here and nowhere else.

Sources: Katana §3.6, Tables 3.2 to 3.4 and 4.3 to 4.6 (4.3 and 4.4 again in 5.2), §5.2.
"""

import numpy as np

from workbench.base.types import frozen

CONSTANTS = (
    *(f"joint{i}.theta" for i in range(1, 6)),
    *(f"joint{i}.alpha" for i in range(1, 6)),
    "fixed1.alpha",
    *("joint3.beta", "joint4.beta", "joint3.a", "joint4.a", "joint5.d", "fixed1.d"),
)
"""ΔE of eq. (3.5) in its order: θ1 … θ5, α0 … α5, β2, β3, a3, a4, d5, d6; our joint i holds α_{i−1}."""
PRINTED_INFLUENCE = {"joint2.theta": 0.34e-3, "joint3.alpha": 0.59 * 0.34e-3}
"""Mean influences read from fig. 3.8 [m]: θ2 in §3.6, α2 from its k8 = 0.59."""

_IDENTIFIED = np.array(
    [
        [0.0, -0.061, -0.061],
        [0.0, 0.0232, 0.0341],
        [0.0, -0.057, 0.066],
        [0.0, 0.0641, 0.0231],
        [0.0, -0.121, -0.01],
        [0.0, 0.0, 0.0],
        [90.0, 89.92, 90.053],
        [0.0, 0.003, -0.016],
        [0.0, 0.007, 0.062],
        [-90.0, -90.01, -89.82],
        [90.0, 90.03, 90.01],
        [0.0, 0.0021, 0.005],
        [0.0, 0.0013, -0.003],
        [190.0, 190.003, 190.0],
        [139.0, 139.01, 139.0],
        [147.3, 147.302, 147.3],
        [200.0, 200.001, 200.0],
    ]
)
_UNITS = np.array([np.deg2rad(1.0)] * 13 + [1e-3] * 4)
TABLE_3_2 = frozen(_UNITS * (_IDENTIFIED[:, 1] - _IDENTIFIED[:, 0]))
"""Errors identified by the standard method, in the order of `CONSTANTS` [rad], [m]."""
TABLE_3_3 = frozen(_UNITS * (_IDENTIFIED[:, 2] - _IDENTIFIED[:, 0]))
"""Those identified with influences."""

COMPONENTS = ("|ΔX| [mm]", "|ΔY| [mm]", "|ΔZ| [mm]", "|ΔP| [mm]", "|ΔΦ| [°]", "|Δθ| [°]", "|ΔΨ| [°]")
"""Rows of Tables 3.4 and 4.5; Φ, θ, Ψ are ZXZ Euler angles."""
TABLE_3_4 = frozen(
    np.array(
        [
            [0.63, 0.28, 0.18],
            [0.44, 0.13, 0.10],
            [0.85, 0.25, 0.16],
            [1.21, 0.38, 0.21],
            [0.27, 0.096, 0.088],
            [0.17, 0.027, 0.022],
            [0.26, 0.084, 0.079],
        ]
    )
)
"""Averages over 118 poses: before, simultaneous, influence based."""
TABLE_4_5 = frozen(
    np.array(
        [
            [
                [0.04, 0.02, 0.01],
                [0.02, 0.01, 0.00],
                [0.08, 0.03, 0.02],
                [0.16, 0.05, 0.03],
                [0.04, 0.02, 0.02],
                [0.05, 0.02, 0.02],
                [0.03, 0.01, 0.01],
            ],
            [
                [1.35, 0.28, 0.14],
                [0.92, 0.41, 0.13],
                [1.82, 0.63, 0.16],
                [2.11, 0.70, 0.24],
                [0.46, 0.125, 0.119],
                [0.26, 0.087, 0.078],
                [0.45, 0.130, 0.09],
            ],
            [
                [0.63, 0.17, 0.08],
                [0.44, 0.09, 0.05],
                [0.85, 0.25, 0.11],
                [1.21, 0.33, 0.12],
                [0.27, 0.096, 0.088],
                [0.17, 0.027, 0.022],
                [0.26, 0.084, 0.079],
            ],
        ]
    )
)
"""Least, greatest and mean over 118 poses: before, conventional, with tilting."""
TABLE_4_6 = frozen(
    np.array(
        [
            [1.16, 0.51, 0.11],
            [0.95, 0.67, 0.12],
            [1.52, 0.75, 0.14],
            [1.31, 0.55, 0.12],
            [0.89, 0.53, 0.11],
            [0.93, 0.47, 0.14],
            [1.17, 0.28, 0.12],
            [1.38, 0.72, 0.16],
            [1.54, 0.41, 0.15],
            [0.76, 0.25, 0.11],
        ]
    )
)
"""|ΔP| at ten uncalibrated points [mm]: before, conventional, with tilting."""
TABLE_4_6_MEANS = (1.16, 0.51, 0.13)
"""Their means [mm], which the columns give; the thesis itself prints none."""

CLEARANCE = frozen(np.deg2rad([0.022, 0.024, 0.017, 0.015, 0.018]))
"""Table 4.3: angle by which each joint tilts in its clearance [rad]."""
BACKLASH = frozen(np.deg2rad([0.063, 0.061, 0.057, 0.046, 0.051]))
"""Table 4.3: backlash of each joint [rad]."""
KILOGRAM_METRE_PER_DEGREE = 9.80665 / float(np.deg2rad(1.0))
"""One kg·m/° [N m/rad]."""
STIFFNESS = frozen(KILOGRAM_METRE_PER_DEGREE * np.array([122.0, 90.0, 75.0, 78.0, 80.0]))
"""Table 4.4: stiffness of each joint about its axis [N m/rad]."""
PENCIL_HOLDER = 0.130
"""What the pencil holder adds to the 200 mm link of chapter 5, Table 5.1 [m]."""
