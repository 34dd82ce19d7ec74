"""The five representations of orientation, each checked and converted into rotation matrices.

Roll, pitch, yaw mean R = Rz(yaw) Ry(pitch) Rx(roll); quaternions are (w, x, y, z); rx, ry, rz is a rotation
vector (axis times angle); zxz_phi, zxz_theta, zxz_psi are the Euler angles of R = Rz(Φ) Rx(θ) Rz(Ψ); r11 …
r33 are the matrix's rows. A file may give several; they must agree.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from workbench.base import se3
from workbench.base.units import Quantity, conversion, parse_heading
from workbench.data.orientations import ORIENTATIONS, WrittenOrientation
from workbench.data.readers.columns_option import GROUPS
from workbench.data.readers.fields import Fields
from workbench.data.readers.headings import numbers_in

MAX_SILENT = 1e-6
"""Deviations above this are mended and said; below, values are taken as they are."""
_ANGLES = (("alpha", "beta", "gamma"), ("o", "a", "t"), ("phi", "theta", "psi"), ("phi", "theta", "chi"))
"""Names of three angles whose order no heading tells."""
AGREEMENT = 1e-4
"""Largest angle [rad] between two forms of the same orientation."""


class Form(NamedTuple):
    """One way to write an orientation: its name for people, that in `data/orientations.py`, its columns."""

    name: str
    convention: str
    keys: tuple[str, ...]


def read_orientation(
    fields: Fields, *, usable: Bool[np.ndarray, " rows"]
) -> tuple[Float[np.ndarray, "rows 3 3"] | None, tuple[str, ...]]:
    """Rotation matrices of all rows, NaN where a row has none, and what was decided.

    Args:
        fields: Columns in SI.
        usable: Rows that the file does not keep out; the others are not checked, and unreadable ones are NaN.
    """
    if fields.rotation is not None or not (forms := _forms(fields)):
        return fields.rotation, ()
    result, notes = _matrices(forms[0], fields, usable)
    notes = (f"orientation from {forms[0].name}", *notes)
    for form in forms[1:]:
        matrices, remarks = _matrices(form, fields, usable)
        between = np.linalg.norm(se3.matrix_to_rotvec(result @ np.swapaxes(matrices, -1, -2)), axis=-1)
        if (apart := usable & (between > AGREEMENT)).any():
            row = int(np.argmax(apart))
            text = f"{forms[0].name} and {form.name} differ by {np.degrees(between[row]):.3g}°"
            how = "give one of them, or correct the order of rotations"
            raise fields.error(f"{text}: {how}", row, form.keys[0])
        notes += (*remarks, f"{form.name} agrees with it")
    return result, notes


def written_orientation(fields: Fields) -> WrittenOrientation | None:
    """The numbers of the first form that a file gives, as they stand there."""
    if fields.rotation is not None or not (forms := _forms(fields)):
        return None
    raw = fields.stacked(forms[0].keys)
    if raw is not None and [k for k in fields.values if k in forms[0].keys] == ["yaw", "pitch", "roll"]:
        return WrittenOrientation("ZYX", raw[:, ::-1])  # such as A, B, C: the same rotation
    return None if raw is None else WrittenOrientation(forms[0].convention, raw)


def unnamed_angles(fields: Fields) -> WrittenOrientation | None:
    """Three columns of angles that are left out, such as O, A, T: rows may tell that they turn the tool.

    Those of no unit, of names that stand for angles, are in degrees if one is beyond a full turn in radians.
    """
    bare = {name: parse_heading(name) for name in fields.unread}
    units = {name: str(own.unit) for name, own in bare.items() if own.unit in ("deg", "°", "rad")}
    if not units:
        found = next((k for k in _ANGLES if {*k} <= {own.name.lower() for own in bare.values()}), ())
        units = dict.fromkeys((name for name, own in bare.items() if own.name.lower() in found), "")
    if fields.rotation is not None or _forms(fields) or len(units) != 3:
        return None
    numbers = [numbers_in(fields.unread[name]) for name in units]
    likely = "deg" if np.nanmax(np.abs(numbers), initial=0.0) > 2.0 * np.pi else "rad"
    sizes = (conversion(unit or likely, Quantity.ANGLE) for unit in units.values())
    return WrittenOrientation("", np.column_stack([s.to_si(n) for s, n in zip(sizes, numbers, strict=True)]))


def _forms(fields: Fields) -> list[Form]:
    return [form for form in FORMS if any(key in fields.values for key in form.keys)]


def _matrices(form: Form, fields: Fields, usable: np.ndarray) -> tuple[np.ndarray, tuple[str, ...]]:
    """Matrices of the rows that have all values and are rotations, and whether they had to be mended."""
    raw = fields.stacked(form.keys)
    assert raw is not None  # the form has a column
    deviations, tolerance, what = _OFF.get(form.convention, (lambda raw: np.zeros(len(raw)), np.inf, ""))
    off = deviations(raw)
    if (wrong := usable & (off > tolerance)).any():
        row = int(np.argmax(wrong))
        text = f"{form.name} is no rotation ({what} by {off[row]:.2g}): correct it, or exclude the row"
        raise fields.error(text, row, form.keys[0])
    rows = ~np.isnan(raw).any(1) & (off <= tolerance)
    matrices, worst = np.full((fields.rows, 3, 3), np.nan), off[rows & usable].max(initial=0.0)
    is_kept = worst <= MAX_SILENT and form.convention == "matrix"  # bit by bit
    matrices[rows] = raw[rows].reshape(-1, 3, 3) if is_kept else _MATRICES[form.convention](raw[rows])
    return matrices, (f"{what} by up to {worst:.1g}; mended",) if worst > MAX_SILENT else ()


def _off_orthonormal(raw: Float[np.ndarray, "rows 9"]) -> Float[np.ndarray, " rows"]:
    """Largest entry of RᵀR − 1; infinite for mirrors."""
    matrices = raw.reshape(-1, 3, 3)
    off = np.abs(np.swapaxes(matrices, -1, -2) @ matrices - np.eye(3)).max((1, 2))
    return np.where(np.linalg.det(matrices) < 0.0, np.inf, off)


_SKEW = "matrices are not orthonormal with a determinant of 1: RᵀR is off"
_LONG = "quaternions are not normalised: their norm is off"
_OFF = {
    "matrix": (_off_orthonormal, 5e-3, _SKEW),
    "wxyz": (lambda raw: np.abs(np.linalg.norm(raw, axis=1) - 1.0), 0.02, _LONG),
}
"""How far numbers are from being a rotation, how far they may be by rounding, and what to say of it."""
FORMS = (
    Form("the matrix r11 … r33", "matrix", GROUPS["matrix"]),
    Form("the quaternion qw, qx, qy, qz", "wxyz", GROUPS["quat"]),
    Form("the rotation vector rx, ry, rz", "rotvec", GROUPS["rotvec"]),
    Form("roll, pitch, yaw (R = Rz(yaw) Ry(pitch) Rx(roll))", "xyz", GROUPS["rpy"]),
    Form("ZXZ Euler angles (R = Rz(Φ) Rx(θ) Rz(Ψ))", "ZXZ", GROUPS["zxz"]),
)
"""The most exact form first: it is the one that counts where a file gives several."""
_MATRICES = {kind.name: kind.matrices for kind in ORIENTATIONS}
