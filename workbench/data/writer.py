"""Measurements to CSV in the form that the readers (and others) read: SI, to full precision."""

import csv
import io
from collections.abc import Callable, Collection, Iterator
from enum import StrEnum
from pathlib import Path

import numpy as np

from workbench.base import se3
from workbench.base.errors import FileError
from workbench.base.files import write_text
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
_LABELS = ("session", "group", "point", "anchor", "contact")

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


def _columns(dataset: Dataset, form: RotationForm, prismatic: Collection[int]) -> Iterator[Column]:
    """Heading and values of each column, in the order of formats.md."""
    for j in range(dataset.joints):
        yield f"q{j + 1}[{'m' if j in prismatic else 'rad'}]", dataset.q[:, j]
    yield from _stack(("x[m]", "y[m]", "z[m]"), dataset.position)
    if dataset.rotation is not None:
        yield from _rotation_columns(dataset.rotation, form)
    yield from _single("time[s]", dataset.time)
    yield from _single("temperature[degC]", dataset.temperature)
    yield from _single("payload[kg]", dataset.payload)
    yield from _stack([f"torque{j + 1}[N*m]" for j in range(dataset.joints)], dataset.torque)
    yield from _stack([f"direction{j + 1}" for j in range(dataset.joints)], dataset.direction)
    yield from _stack(_SIGMA, dataset.sigma)
    if dataset.markers is not None:
        for m in range(dataset.markers.shape[1]):
            yield from _stack([f"m{m + 1}{axis}[m]" for axis in "xyz"], dataset.markers[:, m])
    yield from _single("distance[m]", dataset.distance)
    for link, values in (dataset.tilt or {}).items():
        yield from _stack((f"tilt_x{link}[rad]", f"tilt_y{link}[rad]"), values)
    yield from _stack(_WRENCH, dataset.wrench)
    for name in _LABELS:
        yield from _single(name, getattr(dataset, name))
    yield from _single("exclude", dataset.exclude)
    yield from _single("reason", dataset.reason)


def _stack(names, values: np.ndarray | None) -> Iterator[Column]:
    """One column for each name."""
    if values is not None:
        yield from zip(names, values.T, strict=True)


def _single(name: str, values: np.ndarray | None) -> Iterator[Column]:
    if values is not None:
        yield name, values


def _rotation_columns(rotation: np.ndarray, form: RotationForm) -> Iterator[Column]:
    """Orientations in a form, NaN where a row has none."""
    names, convert = _FORMS[form]
    whole = ~np.isnan(rotation).any((1, 2))
    result = np.full((len(rotation), len(names)), np.nan)
    if whole.any():
        result[whole] = convert(rotation[whole])
    return _stack(names, result)


def _cells(values: np.ndarray) -> list[str]:
    """Numbers as short as they give themselves back exactly, blanks for NaN, true and false in words."""
    if values.dtype.kind == "f":
        return ["" if value != value else repr(value) for value in values.tolist()]
    if values.dtype.kind == "b":
        return ["true" if value else "false" for value in values.tolist()]
    return [str(value) for value in values.tolist()]
