"""Fields of a result: name, unit and meaning stated once; JSON and tables follow.

What an axis is in files and tables:

    AXIS = ResultFields(
        ResultField("joint", of=lambda axis: axis.joint + 1, title="joint"),
        ResultField("direction"),
        ResultField("radius", MM, title="radius"),
    )
    AXIS.json(axis)             {"joint": 2, "direction": [0.0, 0.0, 1.0], "radius_mm": 412.06}
    AXIS.table("Axes", axes)    columns "joint" and "radius [mm]"
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, is_dataclass
from operator import attrgetter
from typing import Any, NamedTuple, final

import numpy as np

from workbench.report.blocks import ResultTable
from workbench.report.json import Json
from workbench.report.numbers import short


class Unit(NamedTuple):
    """A unit in which people and files have a quantity.

    Args:
        factor: From SI to this unit.
        suffix: Of JSON keys.
        symbol: In headings; empty for numbers without unit.
    """

    factor: float
    suffix: str
    symbol: str

    def of(self, size: Any) -> Any:
        """A size [SI], an array or several by name, in this unit."""
        if isinstance(size, dict):
            return {name: self.of(part) for name, part in size.items()}
        return None if size is None else np.multiply(self.factor, size)


SI = Unit(1.0, "", "")
MM = Unit(1e3, "_mm", "mm")
DEG = Unit(float(np.rad2deg(1.0)), "_deg", "°")


def as_cell(value: Any) -> str:
    """A number with three decimals, anything else as it is."""
    return short(float(value)) if isinstance(value, float | np.floating) else str(value)


@final
@dataclass(frozen=True)
class ResultField:
    """One number, text or list of a record.

    Args:
        name: JSON key without its unit; fields without one stand in tables alone.
        unit: Unit in files and tables; the record has SI.
        of: Attribute, such as `robot.name`, or a function of the record; the attribute `name` if empty.
        title: Column heading without its unit; fields without one stand in no table.
        text: How tables have the value.
        each: Fields of the value, or of each of its entries, if it is a record or a sequence of records.
    """

    name: str
    unit: Unit = SI
    of: str | Callable[[Any], Any] = ""
    title: str = ""
    text: Callable[[Any], str] = as_cell
    each: "ResultFields | None" = None

    @property
    def key(self) -> str:
        return self.name + self.unit.suffix

    @property
    def heading(self) -> str:
        return f"{self.title} [{self.unit.symbol}]" if self.unit.symbol else self.title

    def value(self, record: Any) -> Any:
        """The value in its unit; records within it as plain data; None where it is None."""
        found = self.of(record) if callable(self.of) else attrgetter(self.of or self.name)(record)
        if found is None:
            return None
        if self.each is not None:
            found = self.each.json(found) if is_dataclass(found) else self.each.each(found)
        return found if self.unit is SI else self.unit.of(found)

    def cell(self, record: Any) -> str:
        """The value in a table; – where it is unknown."""
        value = self.value(record)
        return "–" if value is None else self.text(value)


@final
class ResultFields:
    """The fields of one kind of record, in their order; a name alone stands for `ResultField(name)`."""

    def __init__(self, *fields: ResultField | str):
        self.fields = tuple(ResultField(field) if isinstance(field, str) else field for field in fields)
        self.columns = tuple(field for field in self.fields if field.title)

    def json(self, record: Any) -> Json:
        """The record as JSON has it."""
        return {field.key: field.value(record) for field in self.fields if field.name}

    def each(self, records: Iterable[Any]) -> list[Json]:
        return [self.json(record) for record in records]

    @property
    def headings(self) -> list[str]:
        return [field.heading for field in self.columns]

    def cells(self, record: Any) -> list[str]:
        """The record's row of a table."""
        return [field.cell(record) for field in self.columns]

    def table(self, title: str, records: Iterable[Any]) -> ResultTable:
        """A table with a row for each record."""
        return ResultTable(title, self.headings, [self.cells(record) for record in records])


JOINT = ResultField("joint", of=lambda record: record.joint + 1, title="joint")
"""Of records that count joints from 0."""
POSE = ResultFields(ResultField("position", MM), ResultField("orientation", DEG, of="rotation"))
"""Of errors, limits or deviations `position` [m] and `rotation` [rad]."""
