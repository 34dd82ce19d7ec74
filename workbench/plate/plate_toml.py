"""Plates as TOML files: the tables of `formats.md`, with one clear sentence for each error."""

from functools import cache
from pathlib import Path
from typing import Any, final

import numpy as np
import tomli_w

from workbench.base.assets import assets
from workbench.base.errors import FileError, OptionError
from workbench.base.files import check_ending, write_text
from workbench.base.toml import AbstractTableReader
from workbench.plate.plate import AUTO, Kind, Plate, Target
from workbench.plate.region import Region
from workbench.plate.tolerances import EXACT, Production

PLATE_KEYS = {"name", "size", "xyz", "rpy", "region", "making", "anchors", "target"}
PRODUCTION_KEYS = {"tolerance", "play"}
REGION_KEYS = {"min", "max", "cube"}
TARGET_KEYS = {"xyz", "rpy", "branch", "q", "kind", "sigma", "locked"}


@final
class _PlateReader(AbstractTableReader):
    """A plate's file being read."""

    wanted = "a plate TOML"
    otherwise = "a plate TOML or a built-in name"

    def region(self, table: Any) -> Region:
        self.keys(table, REGION_KEYS, "region")
        if missing := sorted({"min", "max"} - set(table)):
            raise self.fail(f"region has no {missing[0]}; give both corners, min and max, in m")
        try:
            return Region(
                min=self.numbers(table["min"], 3, "region min"),
                max=self.numbers(table["max"], 3, "region max"),
                cube=self.number(table.get("cube", 0.05), "region cube"),
            )
        except OptionError as error:
            raise self.fail(str(error)) from None

    def target(self, table: Any, what: str) -> Target:
        self.keys(table, TARGET_KEYS, what)
        if "xyz" not in table:
            raise self.fail(f"{what} has no xyz; give the tool's position in m")
        branch = table.get("branch", AUTO)
        if not isinstance(branch, str) or not branch:
            raise self.fail(f'{what} branch must be "auto" or the name of a solution, not {branch!r}')
        try:
            kind = Kind(table.get("kind", Kind.SEAT))
        except ValueError:
            raise self.fail(f"{what} kind is {table['kind']!r}; known are seat, socket and point") from None
        return Target(
            xyz=self.numbers(table["xyz"], 3, f"{what} xyz"),
            rpy=self.numbers(table.get("rpy", [0, 0, 0]), 3, f"{what} rpy"),
            branch=branch,
            q=self.numbers(table["q"], None, f"{what} q") if "q" in table else None,
            kind=kind,
            sigma=self.sigma(table["sigma"], what) if "sigma" in table else None,
            locked=self.flag(table.get("locked", False), f"{what} locked"),
        )

    def sigma(self, value: Any, what: str) -> tuple[float, float]:
        position, rotation = self.numbers(value, 2, f"{what} sigma")
        if position < 0 or rotation < 0:
            raise self.fail(f"{what} sigma is {value!r}; a standard deviation can't be negative")
        return float(position), float(rotation)

    def production(self, table: Any) -> Production:
        self.keys(table, PRODUCTION_KEYS, "making")
        (position, angle), play = (
            self.numbers(table.get(key, [0, 0]), 2, f"making {key}").tolist() for key in ("tolerance", "play")
        )
        try:
            return Production(position=position, angle=angle, play=(play[0], play[1]))
        except OptionError as error:
            raise self.fail(str(error)) from None

    def anchors(self, value: Any) -> np.ndarray:
        if not isinstance(value, list) or len(value) < 3:
            raise self.fail("anchors must be three or more places [x, y, z] in m, in the plate's frame")
        return np.stack([self.numbers(one, 3, f"anchor {i}") for i, one in enumerate(value, start=1)])

    def size(self, value: Any) -> np.ndarray:
        size = self.numbers(value, 3, "size")
        if not (size > 0).all():
            raise self.fail(f"size is {value!r}; length, width and thickness must be positive")
        return size


def read_plate(path: Path | str) -> Plate:
    """Read a plate."""
    reader = _PlateReader(path)
    data = reader.load()
    reader.keys(data, PLATE_KEYS, "the plate")
    if "region" not in data:
        raise reader.fail("it has no region; give region = { min = […], max = […], cube = 0.05 } in m")
    tables = reader.tables(data, "target")
    return Plate(
        name=str(data.get("name", Path(reader.path).stem)),
        targets=tuple(reader.target(t, f"[[target]] {i}") for i, t in enumerate(tables, start=1)),
        region=reader.region(data["region"]),
        xyz=reader.numbers(data.get("xyz", [0, 0, 0]), 3, "xyz"),
        rpy=reader.numbers(data.get("rpy", [0, 0, 0]), 3, "rpy"),
        size=reader.size(data["size"]) if "size" in data else None,
        production=reader.production(data["making"]) if "making" in data else EXACT,
        anchors=reader.anchors(data["anchors"]) if "anchors" in data else None,
    )


def plate_to_table(plate: Plate) -> dict[str, Any]:
    """The tables of a plate's file."""
    table: dict[str, Any] = {"name": plate.name, "xyz": plate.xyz.tolist(), "rpy": plate.rpy.tolist()}
    if plate.size is not None:
        table["size"] = plate.size.tolist()
    if plate.production != EXACT:
        production = plate.production
        table["making"] = {
            "tolerance": [production.position, production.angle],
            "play": list(production.play),
        }
    if plate.anchors is not None:
        table["anchors"] = plate.anchors.tolist()
    region = plate.region
    table["region"] = {"min": region.min.tolist(), "max": region.max.tolist(), "cube": region.cube}
    table["target"] = [_target_table(target) for target in plate.targets]
    return table


def _target_table(target: Target) -> dict[str, Any]:
    table: dict[str, Any] = {"xyz": target.xyz.tolist(), "rpy": target.rpy.tolist(), "branch": target.branch}
    if target.q is not None:
        table["q"] = target.q.tolist()
    table["kind"] = str(target.kind)
    if target.sigma is not None:
        table["sigma"] = list(target.sigma)
    if target.locked:
        table["locked"] = True
    return table


def plate_text(plate: Plate) -> str:
    """A plate's file as text."""
    return tomli_w.dumps(plate_to_table(plate))


def write_plate(plate: Plate, path: Path | str) -> Path:
    """Write a plate's file, whole or not at all."""
    return write_text(check_ending(path, "a plate is", ".toml"), plate_text(plate))


def built_in_plates() -> dict[str, Path]:
    """Name and file of every built-in plate."""
    return {path.stem: path for path in sorted((assets() / "plates").glob("*.toml"))}


def load_plate(source: Path | str) -> Plate:
    """A plate from a TOML file, or a built-in one by name (`table2`).

    Raises:
        FileError: neither a file nor a built-in name, or a file that is no plate.
    """
    built_in = built_in_plates()
    if str(source).lower() in built_in:
        return _built_in(built_in[str(source).lower()])
    path = Path(source)
    if path.suffix.lower() != ".toml":
        raise FileError(
            f"is neither a .toml file nor a built-in plate; built-in: {', '.join(built_in)}", path=str(source)
        )
    return read_plate(path)


@cache
def _built_in(path: Path) -> Plate:
    """The single object of a built-in plate, so that caches by plate are shared."""
    return read_plate(path)
