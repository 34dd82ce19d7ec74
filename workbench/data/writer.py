"""Measurements to CSV in the form that the readers (and others) read: SI, to full precision."""

import csv
import io
from collections.abc import Callable, Collection, Iterator, Sequence
from enum import StrEnum
from pathlib import Path

import numpy as np

from workbench.base import se3
from workbench.base.errors import FileError
from workbench.base.files import write_text
from workbench.base.wording import as_cell
from workbench.data.columns import known_columns
from workbench.data.dataset import Dataset


class RotationForm(StrEnum):
    """How orientations are written."""

    QUATERNION = "quaternion"
    MATRIX = "matrix"
    ROTATION_VECTOR = "rotation vector"
    RPY = "roll, pitch, yaw"
    ZXZ = "ZXZ Euler angles"


ENDINGS = (".csv", ".txt")
"""What a file of measurements may be called: the text is comma-separated."""
_FORMS: dict[RotationForm, tuple[tuple[str, ...], Callable[[np.ndarray], np.ndarray]]] = {
    RotationForm.QUATERNION: (("qw", "qx", "qy", "qz"), se3.matrix_to_quaternion),
    RotationForm.MATRIX: (tuple(f"r{i}{j}" for i in "123" for j in "123"), lambda r: r.reshape(-1, 9)),
    RotationForm.ROTATION_VECTOR: (("rx[rad]", "ry[rad]", "rz[rad]"), se3.matrix_to_rotvec),
    RotationForm.RPY: (("roll[rad]", "pitch[rad]", "yaw[rad]"), se3.matrix_to_rpy),
    RotationForm.ZXZ: (("zxz_phi[rad]", "zxz_theta[rad]", "zxz_psi[rad]"), se3.matrix_to_zxz),
}
"""Columns of each form, and what makes them of matrices."""
_SIGMA = ("sigma_x[m]", "sigma_y[m]", "sigma_z[m]", "sigma_rx[rad]", "sigma_ry[rad]", "sigma_rz[rad]")
_WRENCH = tuple(f"force_{a}[N]" for a in "xyz") + tuple(f"moment_{a}[N*m]" for a in "xyz")

Column = tuple[str, np.ndarray]


def write_measurements(
    dataset: Dataset,
    path: Path | str,
    *,
    rotation: RotationForm = RotationForm.QUATERNION,
    prismatic: Collection[int] = (),
    frame: str | None = None,
) -> Path:
    """Write measurements as CSV.

    Args:
        dataset: What is written: all rows, also those that are kept out.
        path: File to make or to replace; it is whole or untouched at any time.
        rotation: Form of the orientations; the matrix gives them back bit by bit.
        prismatic: Joints, counted from 0, whose positions are lengths [m].
        frame: Frame of the poses, where it is not the measuring one; see `readers.pose_frame`.

    Raises:
        FileError: The file can't be written, or its ending promises another form.
    """
    if Path(path).suffix.lower() not in ENDINGS:
        raise FileError(
            f"measurements are written as {' or '.join(ENDINGS)}; choose this ending", path=str(path)
        )
    return write_text(path, measurements_csv(dataset, rotation=rotation, prismatic=prismatic, frame=frame))


def measurements_csv(
    dataset: Dataset,
    *,
    rotation: RotationForm = RotationForm.QUATERNION,
    prismatic: Collection[int] = (),
    frame: str | None = None,
) -> str:
    """The same text without a file; arguments as in `write_measurements`."""
    columns = list(_columns(dataset, rotation, prismatic))
    if frame is not None:
        columns.append(("pose_frame", np.full(len(dataset.q), frame)))
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow([name for name, _ in columns])
    writer.writerows(zip(*(_cells(values) for _, values in columns), strict=True))
    return buffer.getvalue()


def columns_of(dataset: Dataset, prismatic: Collection[int]) -> dict[str, np.ndarray]:
    """The same columns as a file's, by heading; orientations are quaternions."""
    return dict(_columns(dataset, RotationForm.QUATERNION, prismatic))


def _columns(data: Dataset, form: RotationForm, prismatic: Collection[int]) -> Iterator[Column]:
    """Heading and values of each column, in the order of formats.md."""
    joints = range(1, data.joints + 1)
    found: list[tuple[Sequence[str], np.ndarray | None]] = [
        ([f"q{j}[{'m' if j - 1 in prismatic else 'rad'}]" for j in joints], data.q),
        (("x[m]", "y[m]", "z[m]"), data.position),
    ]
    if data.rotation is not None:
        found.append(_written(data.rotation, form))
    table = [column for column in known_columns().values() if column.kept]
    found += [(c.headings(data.joints), data.column(c.name)) for c in table if c.driver]
    found.append((_SIGMA, data.sigma))
    if (markers := data.markers) is not None:
        names = [f"m{m + 1}{axis}[m]" for m in range(markers.shape[1]) for axis in "xyz"]
        found.append((names, markers.reshape(len(data), len(names))))
    others = (c for c in table if not (c.driver or c.is_label))
    found += [(c.headings(data.joints), data.column(c.name)) for c in others]
    found += [((f"tilt_x{k}[rad]", f"tilt_y{k}[rad]"), values) for k, values in (data.tilt or {}).items()]
    found.append((_WRENCH, data.wrench))
    found += [([c.name], data.column(c.name)) for c in table if c.is_label]
    for headings, values in found:
        if values is not None:
            yield from zip(headings, np.atleast_2d(values.T), strict=True)


def _written(rotation: np.ndarray, form: RotationForm) -> tuple[tuple[str, ...], np.ndarray]:
    """Orientations in a form, NaN where a row has none."""
    names, convert = _FORMS[form]
    whole = ~np.isnan(rotation).any((1, 2))
    result = np.full((len(rotation), len(names)), np.nan)
    if whole.any():
        result[whole] = convert(rotation[whole])
    return names, result


def _cells(values: np.ndarray) -> list[str]:
    """Numbers as short as they give themselves back exactly, blanks for NaN, true and false in words."""
    if values.dtype.kind == "f":
        return ["" if value != value else repr(value) for value in values.tolist()]
    if values.dtype.kind == "b":
        return ["true" if value else "false" for value in values.tolist()]
    return [as_cell(str(value)) for value in values.tolist()]
