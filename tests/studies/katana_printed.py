"""What the Katana thesis prints, from `katana_printed.toml`: turned into SI here and nowhere else."""

import tomllib
from pathlib import Path

import numpy as np

from workbench.base.types import frozen

_PRINTED = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))

LIMITS = frozen(np.array(_PRINTED["limits"]))
"""Of the five joints [deg]."""
CONSTANTS: tuple[str, ...] = tuple(_PRINTED["constants"])
"""ΔE of eq. (3.5) in its order."""
_IDENTIFIED = np.array(list(_PRINTED["constants"].values()))
_UNITS = np.array([1e-3 if name.endswith((".a", ".d")) else np.deg2rad(1.0) for name in CONSTANTS])
TABLE_3_2 = frozen(_UNITS * (_IDENTIFIED[:, 1] - _IDENTIFIED[:, 0]))
"""Errors identified by the standard method, in the order of `CONSTANTS` [rad], [m]."""
TABLE_3_3 = frozen(_UNITS * (_IDENTIFIED[:, 2] - _IDENTIFIED[:, 0]))
"""Those identified with influences."""
THETA_2, ALPHA_2_SHARE = 1e-3 * _PRINTED["influence"]["theta2"], _PRINTED["influence"]["alpha2_share"]
"""Mean influence of θ2 [m], and the share of it that α2 has, fig. 3.8 and §3.6."""

COMPONENTS = ("|ΔX| [mm]", "|ΔY| [mm]", "|ΔZ| [mm]", "|ΔP| [mm]", "|ΔΦ| [°]", "|Δθ| [°]", "|ΔΨ| [°]")
"""Rows of Tables 3.4 and 4.5; Φ, θ, Ψ are ZXZ Euler angles."""
TABLE_3_4 = frozen(np.array(_PRINTED["table_3_4"]["mean"]))
"""Averages over 118 poses: before, simultaneous, influence based."""
BETTER: float = _PRINTED["table_3_4"]["better"]
"""By how much the influence-based way is said to be better [%]."""
TABLE_4_5 = frozen(np.array([_PRINTED["table_4_5"][name] for name in ("least", "greatest", "mean")]))
"""Least, greatest and mean over 118 poses: before, conventional, with tilting."""
TABLE_4_6_MEANS: tuple[float, ...] = tuple(_PRINTED["table_4_6"]["means"])
"""Mean |ΔP| of ten uncalibrated points [mm]: before, conventional, with tilting."""

CLEARANCE, BACKLASH = (frozen(np.deg2rad(_PRINTED["joints"][name])) for name in ("clearance", "backlash"))
"""Table 4.3: angle by which each joint tilts in its clearance, and its backlash [rad]."""
KILOGRAM_METRE_PER_DEGREE = 9.80665 / float(np.deg2rad(1.0))
"""One kg·m/° [N m/rad]."""
STIFFNESS = frozen(KILOGRAM_METRE_PER_DEGREE * np.array(_PRINTED["joints"]["stiffness"]))
"""Table 4.4: stiffness of each joint about its axis [N m/rad]."""
MASSES: list[float] = _PRINTED["masses"]["links"]
"""Of links 2 to 5 [kg]."""
ATTACHMENT: float = _PRINTED["masses"]["attachment"]
"""Mass of the attachment of the last link, §3.3 [kg]."""
PENCIL_HOLDER = 1e-3 * _PRINTED["tracking"]["pencil_holder"]
"""What the pencil holder adds to the last link in chapter 5 [m]."""
POINTS = frozen(1e-3 * np.array(_PRINTED["tracking"]["points"]))
"""The four points of the circle [m]."""
TRACKED: tuple[float, ...] = tuple(_PRINTED["tracking"]["circle"])
"""Mean errors along the circle by column of `katana_tracking.STEPS` [mm]."""
TRACKED_LINE: float = _PRINTED["tracking"]["line"]
"""Mean error along a line, with tilting [mm]."""
