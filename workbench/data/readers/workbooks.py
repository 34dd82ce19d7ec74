"""Excel files and data frames as cells of text."""

from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Any

from workbench.base.errors import DataError, FileError, OptionError
from workbench.base.wording import listed
from workbench.data.binary_tables import read_workbook, text_of
from workbench.data.readers.file_kind import ONE_TABLE, FileKind, kind_of, read_bytes
from workbench.data.readers.headings import is_commanded, is_of_measurement
from workbench.data.readers.table import Grid, grid_of, named_keys, with_points


def read_excel(data: bytes, path: Path, *, sheet: str | None) -> Grid:
    """Cells of the named sheet, or of the only one whose headings are measurements."""
    grids = _grids(data, path)
    filled = [name for name, grid in grids.items() if grid.rows]
    known = [name for name in filled if len(named_keys(grids[name])) > 1]  # a lone name is chance
    found = (known or filled[:1]) if sheet is None else [name for name in filled if name == sheet]
    if len(found) != 1:
        wanted = "" if sheet is None else f"no filled sheet '{sheet}': "
        names = known or list(grids) or ["Sheet1"]
        text = f"choose one of the sheets {listed(known or list(grids))}, such as sheet='{names[0]}'"
        raise FileError(f"{wanted}{text}, or {ONE_TABLE}", path=str(path))
    others = f"; {len(grids) - 1} other not read" * (sheet is None and len(grids) > 1)
    note = f"read from sheet '{found[0]}'{others}"
    return with_points(replace(grids[found[0]], notes=(note,)))


def sheets_apart(source: Any) -> tuple[str, str] | None:
    """The sheets with measurements and with their joints, of a workbook that has them in two."""
    path = Path(source) if isinstance(source, str | PathLike) else Path()
    if path.suffix.lower() != ".xlsx" or kind_of(data := read_bytes(path), path) is not FileKind.EXCEL:
        return None
    keys = {name: named_keys(grid) for name, grid in _grids(data, path).items()}
    joints = [name for name, own in keys.items() if "q1" in own]
    places = [name for name, own in keys.items() if own & {"x", "m1x", "distance"} and not is_commanded(name)]
    measured = [n for n in places if n not in joints and (is_of_measurement(n) or not {*joints} & {*places})]
    return (measured[0], joints[0]) if len(joints) == len(measured) == 1 else None


def _grids(data: bytes, path: Path) -> dict[str, Grid]:
    sheets = read_workbook(data, path).items()
    return {name: Grid(source=str(path), rows=rows, lines=lines) for name, (rows, lines) in sheets}


def read_frame(frame: Any) -> Grid:
    """Columns of a pandas or polars frame, known by what they can do; neither library is needed."""
    names = list(getattr(frame, "columns", ()))
    if twice := next((name for name in names if names.count(name) > 1), None):
        raise DataError(f"the data frame has column '{twice}' twice; rename one of them", column=str(twice))
    try:
        columns = [[text_of(value) for value in frame[name].to_list()] for name in names]
    except (AttributeError, KeyError, TypeError):
        columns = []
    if not columns:
        text = f"a table comes from a file or a pandas or polars frame, not from {type(frame).__name__}"
        raise OptionError(text, option="source", found=frame)
    return grid_of([str(name) for name in names], columns, source="frame")
