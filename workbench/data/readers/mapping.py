"""Stored column mappings, reusable for every file of the same kind.

layout = "plain"              # optional, like sheet
[columns]                     # the file's heading = ours, with the unit; "-" leaves a column out
"Achse 1" = "q1[deg]"
"Messung X" = "x[mm]"
"Halle" = "-"
[joints]                      # the same for the table of joints (--joints)
"A1" = "q1[deg]"
"""

import tomllib
from pathlib import Path
from typing import Any, NamedTuple, final

import tomli_w

from workbench.base.files import write_text
from workbench.base.toml import AbstractTableReader
from workbench.base.units import EXAMPLES, Quantity, parse_heading
from workbench.data.observation import known_columns
from workbench.data.readers.column_meanings import TableColumn
from workbench.data.readers.columns_option import GROUPS, IGNORED, NamedUnit, Naming, Pair
from workbench.data.readers.headings import meaning, quantities_of
from workbench.data.readers.read import Preview


class ColumnMapping(NamedTuple):
    """What the columns are.

    Args:
        columns: Of the measurements; None: as their headings say.
        joints: Of the table of joints.
        layout: Layout of the file; None: recognised.
        sheet: Sheet of a workbook.
    """

    columns: Naming | None = None
    joints: Naming | None = None
    layout: str | None = None
    sheet: str | None = None


@final
class _MappingReader(AbstractTableReader):
    wanted = "a mapping TOML with [columns]"
    otherwise = "a mapping, as 'workbench preview DATA --save-mapping FILE' writes it"

    def naming(self, data: dict[str, Any], key: str) -> Naming | None:
        """What one of the tables says; None where it is missing or empty."""
        pairs = []
        for heading, ours in self.table(data.get(key, {}), f"[{key}]").items():
            name, unit = parse_heading(ours) if isinstance(ours, str) else ("", None)
            if not (name == IGNORED or heading in ("pose", "joints") or meaning(name)):
                wrong = 'there is no such column; write for example "q1[deg]"'
                raise self.fail(f'[{key}] "{heading}" = {ours!r}: {wrong}')
            pairs.append(Pair(NamedUnit(heading), (NamedUnit(name, unit),)))
        return Naming(f"{self.path} [{key}]", (), tuple(pairs), is_mapping=True) if pairs else None

    def name(self, data: dict[str, Any], key: str) -> str | None:
        if not isinstance(value := data.get(key), str | None):
            raise self.fail(f"{key} must be a name, not {value!r}")
        return value


def read_mapping(path: Path | str) -> ColumnMapping:
    reader = _MappingReader(path)
    data = reader.load()
    reader.keys(data, {"columns", "joints", "layout", "sheet"}, "the mapping")
    return ColumnMapping(
        columns=reader.naming(data, "columns"),
        joints=reader.naming(data, "joints"),
        layout=reader.name(data, "layout"),
        sheet=reader.name(data, "sheet"),
    )


def write_mapping(preview: Preview, path: Path | str) -> Path:
    """Store what a preview understood, to be corrected by hand and used again."""
    return write_text(path, mapping_text(preview))


def mapping_text(preview: Preview) -> str:
    if preview.layout != "plain":
        return tomli_w.dumps({"layout": preview.layout})
    return tomli_w.dumps({"columns": {c.heading: ours(c) for c in preview.columns if c.heading}})


def ours(column: TableColumn) -> str:
    return IGNORED if column.key is None else NamedUnit(column.key, column.unit).heading()


def lacks_unit(column: TableColumn) -> bool:
    """Whether a column is a quantity whose unit nobody said."""
    quantities = () if column.key is None else quantities_of(column.key)
    return column.unit is None and any(q is not Quantity.NUMBER for q in quantities)


def with_column(mapping: str, heading: str, is_now: str) -> str:
    """The text of a mapping in which one column is something else.

    What had been that is left out, and columns of its kind that lack a unit have the same one.

    Args:
        mapping: The text; empty: everything is as the headings say.
        heading: The file's.
        is_now: Ours with its unit, or "-".
    """
    table = tomllib.loads(mapping)
    columns = table.setdefault("columns", {})
    name, unit = parse_heading(is_now)
    for other, was in columns.items() if name != IGNORED else ():
        key, known = parse_heading(was)
        if key == name:
            columns[other] = IGNORED
        elif unit and known is None and key != IGNORED and quantities_of(key) == quantities_of(name):
            columns[other] = f"{key}[{unit}]"
    columns[heading] = is_now
    return tomli_w.dumps(table)


def meanings(joints: int) -> tuple[str, ...]:
    """What a column may be, with every usual unit, as a mapping says it: "-" first, which leaves it out."""
    keys = [f"q{k + 1}" for k in range(joints)]
    keys += [key for group in ("xyz", "rpy", "rotvec", "quat", "matrix") for key in GROUPS[group]]
    keys += [name for c in known_columns().values() if c.kept for name in c.names(joints)]
    keys += ["sigma_x", "sigma_y", "sigma_z", *(f"distance{k}" for k in range(1, 7))]
    found = [IGNORED]
    for key in keys:
        known = [q for q in quantities_of(key) if q is not Quantity.NUMBER]
        found += [f"{key}[{unit}]" for q in known for unit in EXAMPLES[q].split(" or ")] or [key]
    return tuple(found)
