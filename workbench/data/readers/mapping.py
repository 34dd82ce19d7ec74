"""A stored choice of what the columns of a file are, to be used again for every file of that kind.

layout = "plain"              # optional, like sheet
[columns]                     # the file's heading = ours, with the unit; "-" leaves a column out
"Achse 1" = "q1[deg]"
"Messung X" = "x[mm]"
"Halle" = "-"
[joints]                      # the same for the table of joints (--joints)
"A1" = "q1[deg]"
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, final

import tomli_w

from workbench.base.files import write_text
from workbench.base.toml import AbstractTableReader
from workbench.base.units import parse_heading
from workbench.data.readers.columns_option import Item, Naming, Pair
from workbench.data.readers.headings import meaning
from workbench.data.readers.preview import Preview

LEFT_OUT = "-"


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
class _Reader(AbstractTableReader):
    wanted = "a mapping TOML with [columns]"
    otherwise = "a mapping, as 'workbench preview DATA --save-mapping FILE' writes it"

    def naming(self, data: dict[str, Any], key: str) -> Naming | None:
        """Pairs of one of the tables; None where it is missing or empty."""
        pairs = []
        for heading, ours in self.table(data.get(key, {}), f"[{key}]").items():
            if not isinstance(ours, str):
                raise self.fail(f'[{key}] "{heading}" must be a name such as "q1[deg]", not {ours!r}')
            name, unit = parse_heading(ours)
            special = name == LEFT_OUT or heading in ("pose", "joints")
            if not special and meaning(name) is None:
                raise self.fail(
                    f'[{key}] "{heading}" = "{ours}": there is no such column; write e.g. q1[deg]'
                )
            pairs.append(Pair(Item(heading), (Item(name, unit),)))
        return Naming(f"{self.path} [{key}]", (), tuple(pairs)) if pairs else None


def read_mapping(path: Path | str) -> ColumnMapping:
    """A stored mapping.

    Raises:
        FileError: no such file, or one that is no mapping.
    """
    reader = _Reader(path)
    data = reader.load()
    reader.keys(data, {"columns", "joints", "layout", "sheet"}, "the mapping")
    words = {key: data.get(key) for key in ("layout", "sheet")}
    for key, value in words.items():
        if value is not None and not isinstance(value, str):
            raise reader.fail(f"{key} must be a name, not {value!r}")
    return ColumnMapping(
        columns=reader.naming(data, "columns"), joints=reader.naming(data, "joints"), **words
    )


def write_mapping(preview: Preview, path: Path | str) -> Path:
    """Store what a preview understood, to be corrected by hand and used again."""
    columns = {
        column.heading: LEFT_OUT
        if column.key is None
        else column.key + (f"[{column.unit}]" if column.unit is not None else "")
        for column in preview.columns
        if column.heading
    }
    table: dict[str, Any] = {"columns": columns}
    if preview.layout != "plain":
        table = {"layout": preview.layout}
    return write_text(path, tomli_w.dumps(table))
