"""Preview of how a file would be read, for the user to confirm or correct."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from workbench.base.errors import WorkbenchError
from workbench.base.types import Matrix4
from workbench.data.dataset import Dataset
from workbench.data.readers.assemble import assemble
from workbench.data.readers.column_meanings import TableColumn, decisions, interpret_columns, problems
from workbench.data.readers.columns_option import Joints, Naming
from workbench.data.readers.fields import Fields, convert
from workbench.data.readers.headings import quantities_of
from workbench.data.readers.read import read_by_layout


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
    columns: tuple[TableColumn, ...] = ()
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
    fields, name, table = None, "", None
    understood, found, dataset = tuple[TableColumn, ...](), list[WorkbenchError](), None
    try:
        fields, name, table = read_by_layout(path, columns=columns, layout=layout, sheet=sheet, joints=joints)
        understood = () if table is None else interpret_columns(table)
        if fields is not None:
            understood = tuple(_by_layout(fields, understood))
        elif table is not None and not (found := problems(understood, units_from_rows=True)):
            fields = convert(table, understood)
        dataset = None if fields is None else assemble(fields, joints=joints, base=base)
    except WorkbenchError as error:
        found = [error]
    known = dataset if dataset is not None else fields
    held = fields if fields is not None else table
    return Preview(
        path=str(path),
        columns=understood,
        rows=0 if held is None else held.rows,
        joints=sum(re.fullmatch(r"q\d+", column.key or "") is not None for column in understood),
        layout=name or "plain",
        decisions=known.notes if known is not None else table.notes + decisions(understood) if table else (),
        problems=tuple(map(str, found)),
        dataset=dataset,
    )


def _by_layout(fields: Fields, columns: Sequence[TableColumn]) -> Iterator[TableColumn]:
    """The columns that a layout has read, and those of its table that it left out."""
    read = fields.headings
    for key in {**fields.values, **read}:
        si = "rad" if key.startswith("orient") else next(map(str, quantities_of(key)), None)
        yield TableColumn(index=-1, heading=read.get(key, key), key=key, unit=fields.units.get(key), si=si)
    yield from (c for c in columns if c.key is None and c.heading not in read.values())
