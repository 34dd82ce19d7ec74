"""Preview of how a file would be read, for the user to confirm or correct."""

import re
from dataclasses import dataclass
from pathlib import Path

from workbench.base.errors import WorkbenchError
from workbench.base.types import Matrix4
from workbench.data.dataset import Dataset
from workbench.data.readers.assemble import assemble
from workbench.data.readers.column_meanings import TableColumn, decisions, interpret_columns, problems
from workbench.data.readers.columns_option import Joints, Naming
from workbench.data.readers.fields import convert
from workbench.data.readers.headings import quantities_of
from workbench.data.readers.read import read_by_layout
from workbench.data.readers.table import Table


@dataclass(frozen=True)
class PreviewColumn:
    """One column: the file's heading, what it means (None: left out), its unit, ours, and its first cell."""

    heading: str
    key: str | None = None
    unit: str | None = None
    si: str | None = None
    first: str = ""


@dataclass(frozen=True, kw_only=True)
class Preview:
    """What was understood of a file.

    Args:
        rows: Number of data rows; 0 when it could not be found out.
        joints: Number of joint columns.
        layout: Name of the file's layout, 'plain' for the usual one.
        decisions: What was decided, one sentence each.
        problems: What stands against reading it, one sentence each; empty when it can be read.
        dataset: What it is read as; None where something stands against it.
    """

    path: str
    columns: tuple[PreviewColumn, ...] = ()
    rows: int = 0
    joints: int = 0
    layout: str = "plain"
    decisions: tuple[str, ...] = ()
    problems: tuple[str, ...] = ()
    dataset: Dataset | None = None


def preview(
    path: Path | str,
    *,
    columns: str | Naming | None = None,
    joints: Joints = None,
    layout: str | None = None,
    sheet: str | None = None,
    base: Matrix4 | None = None,
) -> Preview:
    """What `read_measurements` would make of a file; problems are listed, never raised."""
    path = Path(path)
    try:
        fields, name, table = read_by_layout(path, columns=columns, layout=layout, sheet=sheet, joints=joints)
    except WorkbenchError as error:
        return Preview(path=str(path), problems=(str(error),))
    understood = () if table is None else interpret_columns(table)
    shown = () if table is None else tuple(_shown(column, table) for column in understood)
    found, dataset = list[str](), None
    if fields is not None:
        own = {k: next(map(str, quantities_of(k)), None) for k in fields.values}
        si = {k: "rad" if k[:6] == "orient" else quantity for k, quantity in own.items()}
        read = fields.headings
        by_layout = (PreviewColumn(read.get(k, k), k, fields.units.get(k), si.get(k)) for k in {**si, **read})
        shown = (*by_layout, *(c for c in shown if c.key is None and c.heading not in read.values()))
    else:
        found = [str(problem) for problem in problems(understood, units_from_rows=True)]
    try:
        if fields is None and table is not None and not found:
            fields = convert(table, understood)
        dataset = None if fields is None else assemble(fields, joints=joints, base=base)
    except WorkbenchError as error:
        found = [str(error)]
    known = dataset if dataset is not None else fields
    keys = [column.key or "" for column in understood] if fields is None else fields.values
    return Preview(
        path=str(path),
        columns=shown,
        rows=fields.rows if fields is not None else table.rows if table is not None else 0,
        joints=sum(re.fullmatch(r"q\d+", key) is not None for key in keys),
        layout=name or "plain",
        decisions=known.notes if known is not None else table.notes + decisions(understood) if table else (),
        problems=tuple(found),
        dataset=dataset,
    )


def _shown(column: TableColumn, table: Table) -> PreviewColumn:
    unit = column.unit if column.missing_unit is None else None
    si = str(column.conversion.quantity) if column.conversion is not None and unit else None
    return PreviewColumn(column.heading, column.key, unit, si, *table.columns[column.index][:1])
