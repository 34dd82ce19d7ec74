"""Plates as TOML files: the tables of `formats.md`, with one clear sentence for each error."""

from dataclasses import fields
from enum import StrEnum
from functools import cache
from pathlib import Path
from typing import Any, final

import numpy as np
import tomli_w

from workbench.arm.plausible_units import rpy_of
from workbench.base.assets import assets
from workbench.base.files import check_ending, write_text
from workbench.base.toml import AbstractTableReader
from workbench.plate.plate import Plate, Target
from workbench.plate.region import Region
from workbench.plate.tolerances import EXACT, Production

PLATE_KEYS = {"name", "size", "xyz", "rpy", "region", "making", "target"}


@final
class _PlateReader(AbstractTableReader):
    """A plate's file being read: the keys of a table are the fields of its record."""

    wanted = "a plate TOML"
    otherwise = "a plate TOML or a built-in name"

    def values(self, table: dict[str, Any], what: str) -> dict[str, Any]:
        return {key: self.value(key, value, what) for key, value in self.table(table, what).items()}

    def value(self, key: str, value: Any, what: str) -> Any:
        """Lists as arrays of finite numbers, a standard deviation as a pair of them."""
        if key == "rpy":
            return rpy_of(self, value, f"{what} rpy")
        if not isinstance(value, list):
            return value if isinstance(value, str | bool) else self.number(value, f"{what} {key}")
        numbers = self.numbers(value, None, f"{what} {key}")
        return tuple(numbers.tolist()) if key == "sigma" else numbers


def read_plate(path: Path | str) -> Plate:
    """Read a plate."""
    reader = _PlateReader(path)
    data = {"name": Path(reader.path).stem, **reader.load()}
    reader.keys(data, PLATE_KEYS, "the plate")
    if "region" not in data:
        raise reader.fail("it has no region; give region = { min = […], max = […], cube = 0.05 } in m")
    own = {key: data[key] for key in data if key not in ("region", "making", "target")}
    parts = {
        "region": reader.record(Region, reader.values(data["region"], "region"), "region"),
        "production": reader.record(Production, data.get("making", {}), "making"),
        "targets": tuple(
            reader.record(Target, reader.values(table, f"[[target]] {i}"), f"[[target]] {i}")
            for i, table in enumerate(reader.tables(data, "target"), start=1)
        ),
    }
    return reader.record(Plate, reader.values(own, "the plate's") | parts, "the plate")


def plate_to_table(plate: Plate) -> dict[str, Any]:
    """The tables of a plate's file."""
    table = _table(plate, "name", "xyz", "rpy", "size")
    if plate.production != EXACT:
        table["making"] = _table(plate.production)
    table["region"] = _table(plate.region)
    table["target"] = [_table(target) for target in plate.targets]
    return table


def _table(record: Any, *names: str) -> dict[str, Any]:
    """Fields of a record, all of them if none is named; without those that say nothing."""
    table: dict[str, Any] = {}
    for name in names or [each.name for each in fields(record)]:
        match getattr(record, name):
            case None | False:
                pass
            case np.ndarray() as array:
                table[name] = array.tolist()
            case tuple() as several:
                table[name] = list(several)
            case value:
                table[name] = str(value) if isinstance(value, StrEnum) else value
    return table


def plate_text(plate: Plate) -> str:
    """A plate's file as text."""
    return tomli_w.dumps(plate_to_table(plate))


def write_plate(plate: Plate, path: Path | str) -> Path:
    """Write a plate's file, whole or not at all."""
    return write_text(plate_path(path), plate_text(plate))


def plate_path(path: Path | str) -> Path:
    """Where a plate is written, with the ending that says so."""
    return check_ending(path, "a plate is", ".toml")


def built_in_plates() -> dict[str, Path]:
    """Name and file of every built-in plate."""
    return {path.stem: path for path in sorted((assets() / "plates").glob("*.toml"))}


@cache
def built_in_plate(path: Path) -> Plate:
    """The single object of a built-in plate, so that caches by plate are shared."""
    return read_plate(path)
