"""The five representations of orientation, each checked and converted into rotation matrices.

Roll, pitch, yaw mean R = Rz(yaw) Ry(pitch) Rx(roll); quaternions are (w, x, y, z); rx, ry, rz is a rotation
vector (axis times angle); zxz_phi, zxz_theta, zxz_psi are the Euler angles of R = Rz(Φ) Rx(θ) Rz(Ψ); r11 …
r33 are the matrix's rows. A file may give several; they must agree.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from workbench.base import se3
from workbench.base.errors import FileError
from workbench.data.orientations import WrittenOrientation
from workbench.data.readers.columns_option import GROUPS
from workbench.data.readers.fields import Fields

NORM_TOLERANCE = 0.02
"""Quaternions whose norm differs from 1 by more than this are refused."""
MATRIX_TOLERANCE = 5e-3
"""Largest entry of RᵀR − 1 that rounding may explain."""
MAX_SILENT = 1e-6
"""Deviations above this are mended and said; below, values are taken as they are."""
AGREEMENT = 1e-4
"""Largest angle [rad] between two forms of the same orientation."""

Rows = Bool[np.ndarray, " rows"]


class Form(NamedTuple):
    """One way to write an orientation."""

    name: str
    convention: str
    keys: tuple[str, ...]
    to_matrices: Callable[[np.ndarray, Fields, np.ndarray], tuple[np.ndarray, tuple[str, ...]]]


def read_orientation(
    fields: Fields, *, usable: Rows
) -> tuple[Float[np.ndarray, "rows 3 3"] | None, tuple[str, ...]]:
    """Rotation matrices of all rows, NaN where a row has none, and what was decided.

    Args:
        fields: Columns in SI.
        usable: Rows that the file does not keep out; the others are not checked, and unreadable ones are NaN.
    """
    if fields.rotation is not None:
        return fields.rotation, ()
    forms = [form for form in FORMS if any(key in fields.values for key in form.keys)]
    result, notes = None, tuple[str, ...]()
    for form in forms:
        matrices, remarks = _matrices(form, fields, usable)
        notes += (f"orientation from {form.name}", *remarks) if result is None else remarks
        if result is None:
            result = matrices
        else:
            _agree(result, matrices, fields, usable, (forms[0], form))
            notes += (f"{form.name} agrees with it",)
            blank = np.isnan(result).any((1, 2))
            result[blank] = matrices[blank]
    return result, notes


def written_orientation(fields: Fields) -> WrittenOrientation | None:
    """The numbers of the first form that a file gives, as they stand there."""
    forms = [form for form in FORMS if any(key in fields.values for key in form.keys)]
    if fields.rotation is not None or not forms:
        return None
    raw = fields.stacked(forms[0].keys)
    return None if raw is None else WrittenOrientation(forms[0].convention, raw)


def _matrices(form: Form, fields: Fields, usable: Rows) -> tuple[np.ndarray, tuple[str, ...]]:
    """Matrices of the rows that have all values; rows that the file keeps out are not checked."""
    raw = fields.stacked(form.keys)
    assert raw is not None  # the form has a column
    full = ~np.isnan(raw).any(1)
    matrices = np.full((fields.rows, 3, 3), np.nan)
    rows = np.flatnonzero(full & usable)
    notes: tuple[str, ...] = ()
    if len(rows):
        matrices[rows], notes = form.to_matrices(raw[rows], fields, rows)
    for row in np.flatnonzero(full & ~usable):
        try:
            matrices[row] = form.to_matrices(raw[[row]], fields, np.array([row]))[0][0]
        except FileError:
            continue
    return matrices, notes


def intrinsic_xyz(angles: Float[np.ndarray, "rows 3"]) -> Float[np.ndarray, "rows 3 3"]:
    """Rx(a) Ry(b) Rz(c) of each row; NaN where an angle is missing."""
    rotation = np.full((len(angles), 3, 3), np.nan)
    whole = ~np.isnan(angles).any(1)
    x, y, z = (se3.rpy_to_matrix(angles[whole] * axis) for axis in np.eye(3))
    rotation[whole] = x @ y @ z
    return rotation


def _agree(
    first: np.ndarray, second: np.ndarray, fields: Fields, usable: Rows, forms: tuple[Form, Form]
) -> None:
    rows = np.flatnonzero(usable & ~np.isnan(first).any((1, 2)) & ~np.isnan(second).any((1, 2)))
    if not len(rows):
        return
    between = np.linalg.norm(se3.matrix_to_rotvec(first[rows] @ np.swapaxes(second[rows], -1, -2)), axis=-1)
    if between.max() > AGREEMENT:
        row = int(rows[np.argmax(between > AGREEMENT)])
        angle = np.degrees(between[np.argmax(between > AGREEMENT)])
        raise fields.error(
            f"{forms[0].name} and {forms[1].name} differ by {angle:.3g}°: give only one of them, "
            "or correct the order of rotations",
            row,
            forms[1].keys[0],
        )


def _simply(convert: Callable[[np.ndarray], np.ndarray]):
    """A conversion of angles or vectors, which are always rotations."""
    return lambda raw, fields, rows: (convert(raw), ())


def _from_quaternion(raw: np.ndarray, fields: Fields, rows: np.ndarray) -> tuple[np.ndarray, tuple[str, ...]]:
    off = np.abs(np.linalg.norm(raw, axis=1) - 1.0)
    if off.max() > NORM_TOLERANCE:
        worst = int(np.argmax(off > NORM_TOLERANCE))
        raise fields.error(
            f"the quaternion's norm is {np.linalg.norm(raw[worst]):.4g}, not 1: "
            "correct it, or exclude the row",
            int(rows[worst]),
            "qw",
        )
    remarks = (f"quaternions were normalised (norms differ from 1 by up to {off.max():.1g})",)
    return se3.quaternion_to_matrix(raw), remarks if off.max() > MAX_SILENT else ()


def _from_matrix(raw: np.ndarray, fields: Fields, rows: np.ndarray) -> tuple[np.ndarray, tuple[str, ...]]:
    matrices = raw.reshape(-1, 3, 3)
    off = np.abs(np.swapaxes(matrices, -1, -2) @ matrices - np.eye(3)).max((1, 2))
    mirrored = np.linalg.det(matrices) < 0.0
    wrong = mirrored | (off > MATRIX_TOLERANCE)
    if wrong.any():
        worst = int(np.argmax(wrong))
        what = (
            "mirrors (its determinant is negative)"
            if mirrored[worst] and off[worst] <= MATRIX_TOLERANCE
            else f"is not orthonormal (RᵀR differs from 1 by {off[worst]:.2g})"
        )
        raise fields.error(
            f"the matrix r11 … r33 {what}, so it is not a rotation: correct it, or exclude the row",
            int(rows[worst]),
            "r11",
        )
    if off.max() <= MAX_SILENT:
        return matrices, ()
    u, _, vt = np.linalg.svd(matrices)
    return u @ vt, (f"matrices were made orthonormal (deviation up to {off.max():.1g})",)


FORMS = (
    Form("the matrix r11 … r33", "matrix", GROUPS["matrix"], _from_matrix),
    Form("the quaternion qw, qx, qy, qz", "wxyz", ("qw", "qx", "qy", "qz"), _from_quaternion),
    Form("the rotation vector rx, ry, rz", "rotvec", ("rx", "ry", "rz"), _simply(se3.rotvec_to_matrix)),
    Form(
        "roll, pitch, yaw (R = Rz(yaw) Ry(pitch) Rx(roll))", "xyz", GROUPS["rpy"], _simply(se3.rpy_to_matrix)
    ),
    Form("ZXZ Euler angles (R = Rz(Φ) Rx(θ) Rz(Ψ))", "ZXZ", GROUPS["zxz"], _simply(se3.zxz_to_matrix)),
)
"""The most exact form first: it is the one that counts where a file gives several."""
