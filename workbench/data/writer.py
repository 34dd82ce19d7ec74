"""Measurements to CSV in the form that the readers (and others) read: SI, to full precision."""

import csv
import io
from collections.abc import Collection
from pathlib import Path

import numpy as np

from workbench.base.files import check_ending, write_text
from workbench.base.wording import as_cell
from workbench.data.dataset import Dataset

ENDINGS = (".csv", ".txt")
"""What a file of measurements may be called: the text is comma-separated."""


def write_measurements(dataset: Dataset, path: Path | str, *, prismatic: Collection[int] = ()) -> Path:
    """Write measurements as CSV.

    Args:
        dataset: What is written: all rows, also those that are kept out.
        path: File to make or to replace; it is whole or untouched at any time.
        prismatic: Joints, counted from 0, whose positions are lengths [m].

    Raises:
        FileError: The file can't be written, or its ending promises another form.
    """
    path = check_ending(path, "measurements are", *ENDINGS)
    return write_text(path, measurements_csv(dataset, prismatic=prismatic))


def measurements_csv(dataset: Dataset, *, prismatic: Collection[int] = ()) -> str:
    """The same text without a file; arguments as in `write_measurements`."""
    columns = dataset.columns(prismatic=prismatic)
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*map(_cells, columns.values()), strict=True))
    return buffer.getvalue()


def _cells(values: np.ndarray) -> list[str]:
    """Numbers as short as they give themselves back exactly, blanks for NaN, true and false in words."""
    if values.dtype.kind == "f":
        return ["" if value != value else repr(value) for value in values.tolist()]
    if values.dtype.kind == "b":
        return ["true" if value else "false" for value in values.tolist()]
    return [as_cell(str(value)) for value in values.tolist()]
