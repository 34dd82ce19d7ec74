"""Arrays of a MATLAB file, read in a child process with limits of time and memory."""

import io
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from workbench.base.bounded_process import ChildError
from workbench.data.binary_tables import read_bounded, refusal
from workbench.extras.logs.matlab_elements import check_matlab


def read_arrays(data: bytes, path: Path) -> dict[str, np.ndarray]:
    """Arrays of a MATLAB file by name, fields of structs as 'struct.field'."""
    what, instead = "this MATLAB file", "save it with -v7, or as CSV"
    if len(data) < 136 or 0 in data[:4] or data[124:128] not in (b"\0\1IM", b"\1\0MI"):
        raise refusal(what, "it has no header of version 5 to 7", instead, path)
    return read_bounded(matlab_arrays, "scipy.io", data, path, what=what, instead=instead)


def matlab_arrays(data: bytes) -> dict[str, np.ndarray]:
    """What `read_arrays` gives, in this process."""
    from scipy.io import loadmat

    check_matlab(data)
    result: dict[str, np.ndarray] = {}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            variables = loadmat(io.BytesIO(data))
        except (
            TypeError,
            ValueError,
            ArithmeticError,
            LookupError,
        ):  # text or indices that contradict each other
            raise ChildError("a variable is damaged") from None
    for name, value in variables.items():
        if not name.startswith("__"):
            _collect(name, value, result)
    return result


def _collect(name: str, value: Any, result: dict[str, np.ndarray]) -> None:
    if isinstance(value, np.ndarray) and value.dtype.names and value.size == 1:
        for field in value.dtype.names:
            _collect(f"{name}.{field}", value.flat[0][field], result)
    elif type(value) is np.ndarray:
        result[name] = value
