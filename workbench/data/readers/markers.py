"""Where markers sit: on the tool by design, and on the base by design and as motion capture sees them.

The same columns as in measurements, `m1x[mm] m1y[mm] m1z[mm] …`: one row for the tool; two rows for the
base, first as designed in the robot's base frame, then as seen.
"""

from pathlib import Path

import numpy as np
from jaxtyping import Float

from workbench.base.errors import FileError
from workbench.data.readers.read import read_fields


def read_marker_rows(path: Path | str, rows: int) -> Float[np.ndarray, "rows markers 3"]:
    """Marker places [m] of a file with so many rows.

    Raises:
        FileError: another number of rows, fewer than three markers, or a gap.
        WorkbenchError: as for measurements.
    """
    fields = read_fields(path, layout="plain")
    if fields.rows != rows:
        what = "one row, the markers on the tool" if rows == 1 else "two rows, as designed and as seen"
        raise FileError(f"has {fields.rows} rows; give {what}", path=str(path))
    count = sum(f"m{k + 1}x" in fields.values for k in range(len(fields.values)))
    if count < 3:
        raise FileError(f"names {count} markers (m1x[mm] …); a frame needs three", path=str(path))
    try:
        places = [[fields.values[f"m{k + 1}{axis}"] for axis in "xyz"] for k in range(count)]
    except KeyError as missing:
        raise FileError(f"has no column {missing}; markers are counted m1, m2, …", path=str(path)) from None
    found = np.moveaxis(np.array(places, float), 2, 0)
    if not np.isfinite(found).all():
        raise FileError("has a blank cell; every marker's place is needed", path=str(path))
    return found
