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
from dataclasses import dataclass
from pathlib import Path
from typing import Any, final

import tomli_w

from workbench.base.files import write_text
from workbench.base.toml import AbstractTableReader
from workbench.base.units import EXAMPLES, Quantity, parse_heading
from workbench.data.known_columns import known_columns
from workbench.data.readers.columns_option import IGNORED, NamedUnit, Naming, Pair
from workbench.data.readers.headings import meaning, quantities_of
from workbench.data.readers.preview import Preview, PreviewColumn


@dataclass(frozen=True, kw_only=True)
class ColumnMapping:
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
        """Pairs of one of the tables; None where it is missing or empty."""
        pairs = []
        for heading, ours in self.table(data.get(key, {}), f"[{key}]").items():
            if not isinstance(ours, str):
                raise self.fail(f'[{key}] "{heading}" must be a name such as "q1[deg]", not {ours!r}')
            name, unit = parse_heading(ours)
            special = name == IGNORED or heading in ("pose", "joints")
            if not special and meaning(name) is None:
                raise self.fail(
                    f'[{key}] "{heading}" = "{ours}": there is no such column; write for example q1[deg]'
                )
            pairs.append(Pair(NamedUnit(heading), (NamedUnit(name, unit),)))
        return Naming(f"{self.path} [{key}]", (), tuple(pairs), is_mapping=True) if pairs else None


def read_mapping(path: Path | str) -> ColumnMapping:
    reader = _MappingReader(path)
    data = reader.load()
    reader.keys(data, {"columns", "joints", "layout", "sheet"}, "the mapping")
    chosen = {key: data.get(key) for key in ("layout", "sheet")}
    for key, value in chosen.items():
        if value is not None and not isinstance(value, str):
            raise reader.fail(f"{key} must be a name, not {value!r}")
    return ColumnMapping(
        columns=reader.naming(data, "columns"), joints=reader.naming(data, "joints"), **chosen
    )


def write_mapping(preview: Preview, path: Path | str) -> Path:
    """Store what a preview understood, to be corrected by hand and used again."""
    return write_text(path, mapping_text(preview))


def mapping_text(preview: Preview) -> str:
    columns = {column.heading: ours(column) for column in preview.columns if column.heading}
    table: dict[str, Any] = {"columns": columns}
    if preview.layout != "plain":
        table = {"layout": preview.layout}
    return tomli_w.dumps(table)


def ours(column: PreviewColumn) -> str:
    if column.key is None:
        return IGNORED
    return column.key + (f"[{column.unit}]" if column.unit is not None else "")


def lacks_unit(column: PreviewColumn) -> bool:
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
    keys += ["x", "y", "z", "roll", "pitch", "yaw", "rx", "ry", "rz", "qw", "qx", "qy", "qz"]
    keys += [f"r{i}{j}" for i in "123" for j in "123"]
    for column in known_columns().values():
        if column.kept:
            keys += column.names(joints)
    keys += ["sigma_x", "sigma_y", "sigma_z"]
    usual = {q: text.split(" or ") for q, text in EXAMPLES.items() if text != EXAMPLES[Quantity.NUMBER]}
    found = [IGNORED]
    for key in keys:
        units = [unit for quantity in quantities_of(key) for unit in usual.get(quantity, ())]
        found += [f"{key}[{unit}]" for unit in units] or [key]
    return tuple(found)
