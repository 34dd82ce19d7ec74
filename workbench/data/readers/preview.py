"""Preview of how a file would be read, for the user to confirm or correct."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from workbench.base.errors import WorkbenchError
from workbench.base.types import Matrix4
from workbench.data.dataset import Dataset
from workbench.data.readers.assemble import assemble
from workbench.data.readers.column_meanings import TableColumn, decisions, interpret_columns, problems
from workbench.data.readers.columns_option import Joints, Naming
from workbench.data.readers.fields import Fields, convert
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
        path: The file.
        columns: Each column.
        rows: Number of data rows; 0 when it could not be found out.
        joints: Number of joint columns.
        excluded: Rows that are kept out.
        sessions: Names of the sessions, in order.
        groups: Number of groups.
        layout: Name of the file's layout, 'plain' for the usual one.
        decisions: What was decided, one sentence each.
        problems: What stands against reading it, one sentence each; empty when it can be read.
        dataset: What it is read as; None where something stands against it.
    """

    path: str
    columns: tuple[PreviewColumn, ...] = ()
    rows: int = 0
    joints: int = 0
    excluded: int = 0
    sessions: tuple[str, ...] = ()
    groups: int = 0
    layout: str = "plain"
    decisions: tuple[str, ...] = ()
    problems: tuple[str, ...] = ()
    dataset: Dataset | None = None

    @property
    def ok(self) -> bool:
        """Whether the file can be read."""
        return not self.problems


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
    if fields is None:
        assert table is not None, "what has no layout of its own is a table"
        return _of_table(path, table, joints, base)
    return _of_fields(path, fields, () if table is None else _left_out(table), joints, base, name)


def _of_table(path: Path, table: Table, joints: Joints, base: Matrix4 | None) -> Preview:
    """Preview of a plain table: as much as can be said even if it can't be read."""
    understood = interpret_columns(table)
    shown = tuple(_shown(column, table) for column in understood)
    found = [str(problem) for problem in problems(understood, rows_tell=True)]
    if not found:
        try:
            return _of_fields(path, convert(table, understood), shown, joints, base, "plain")
        except WorkbenchError as error:
            found = [str(error)]
    labels = {column.key: table.columns[column.index] for column in understood}
    keys = [column.key for column in understood if column.key is not None]
    return Preview(
        path=str(path),
        columns=shown,
        rows=table.rows,
        joints=_joints(keys),
        sessions=tuple(dict.fromkeys(labels.get("session", ()))),
        groups=len(set(labels.get("group", ()))),
        decisions=table.notes + decisions(understood),
        problems=tuple(found),
    )


def _of_fields(
    path: Path,
    fields: Fields,
    shown: tuple[PreviewColumn, ...],
    joints: Joints,
    base: Matrix4 | None,
    layout: str,
) -> Preview:
    """Preview of columns in SI, with what is found when they are put together."""
    if layout != "plain":
        shown = _by_layout(fields) + tuple(c for c in shown if c.heading not in fields.headings.values())
    found: tuple[str, ...] = ()
    dataset, notes, excluded = None, fields.notes, 0
    try:
        dataset = assemble(fields, joints=joints, base=base)
        notes, excluded = dataset.notes, int(np.sum(~dataset.included))
    except WorkbenchError as error:
        found = (str(error),)
    return Preview(
        path=str(path),
        columns=shown,
        rows=fields.rows,
        joints=_joints(list(fields.values)),
        excluded=excluded,
        sessions=tuple(dict.fromkeys(map(str, fields.values.get("session", ())))),
        groups=len(set(map(str, fields.values.get("group", ())))),
        layout=layout,
        decisions=notes,
        problems=found,
        dataset=dataset,
    )


def _shown(column: TableColumn, table: Table) -> PreviewColumn:
    si = str(column.conversion.quantity) if column.conversion is not None and column.unit else None
    cells = table.columns[column.index]
    heading = table.own[column.index] if table.own else column.heading
    return PreviewColumn(heading, column.key, column.unit, si, str(cells[0]) if len(cells) else "")


def _by_layout(fields: Fields) -> tuple[PreviewColumn, ...]:
    keys = dict.fromkeys([*fields.values, *fields.headings])
    return tuple(
        PreviewColumn(fields.headings.get(key, key), key, fields.units.get(key), _si(key)) for key in keys
    )


def _si(key: str) -> str | None:
    """Our unit of a column; None for labels."""
    return next((str(q) for q in quantities_of(key)), None) if key[:6] != "orient" else "rad"


def _left_out(table: Table) -> tuple[PreviewColumn, ...]:
    """Goal columns and the like, which a layout does not hand on."""
    return tuple(PreviewColumn(c.heading) for c in interpret_columns(table) if c.key is None)


def _joints(keys: list[str]) -> int:
    return sum(key[0] == "q" and key[1:].isdigit() for key in keys)
