"""Calibration record of a calibrated arm: poses used, standard errors of its constants, what was observed.

Every pose is kept as four bytes, the CRC-32 of its joint positions rounded to `ROUNDING`: enough to tell
whether a later measurement was among them, and no burden in the robot's file. Two poses of a thousand are
taken for each other with a probability of about 10⁻⁴.

What the rows of a calibration showed of the tool: asked by everything that applies the calibration.

One reflector shows where a point is and nothing of how the tool is turned: constants that only turn the tool
then fit anything. Where a direction was not measured, or the rows leave it more uncertain than arms are made,
the nominal arm knows it better (`usable.py`).
"""

import base64
import binascii
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Float, UInt32

from workbench.base.toml import AbstractTableReader
from workbench.base.types import frozen

MAX_POSITION, MAX_ROTATION = 2e-3, float(np.deg2rad(0.3))
"""Standard errors of the tool from which on a nominal arm is as good [m], [rad]."""
POSES = 120
"""Measured joint positions that a calibration keeps."""


class Expected(NamedTuple):
    """Expected error of a model at some poses.

    Args:
        position: Root mean square of the position's [m].
        rotation: Of the orientation's [rad].
    """

    position: float
    rotation: float


@dataclass(frozen=True, eq=False, kw_only=True)
class Observed:
    """What the rows showed.

    Args:
        position: How many directions of the tool's position they show, 0 to 3.
        rotation: How many of its orientation.
        tool: How uncertain the constants leave the tool.
        flange: How uncertain they leave the flange.
        q: Some of the measured joint positions, the extremes of every joint among them [rad or m].
    """

    position: int
    rotation: int
    tool: Expected
    flange: Expected
    q: Float[np.ndarray, "poses n"]

    @property
    def sees_position(self) -> bool:
        """Whether positions of the tool are better known than the nominal arm has them."""
        return self.position == 3 and self.tool.position < MAX_POSITION

    @property
    def sees_rotation(self) -> bool:
        return self.rotation == 3 and self.tool.rotation < MAX_ROTATION

    @property
    def missing(self) -> str:
        """What is not known, and why, in words; empty if nothing is missing."""
        pairs = (
            ("positions", self.sees_position, self.position, f"{1e3 * self.tool.position:.2g} mm"),
            ("orientations", self.sees_rotation, self.rotation, f"{np.rad2deg(self.tool.rotation):.2g}°"),
        )
        return " and ".join(
            f"{name} were not measured" if seen < 3 else f"{name} are uncertain by {size}"
            for name, known, seen, size in pairs
            if not known
        )

    def table(self) -> dict[str, Any]:
        """As the robot's file has it; joint positions to 1e-4."""
        return {
            "position": self.position,
            "rotation": self.rotation,
            "tool": list(self.tool),
            "flange": list(self.flange),
            "q": [[round(v, 4) for v in row] for row in self.q.tolist()],
        }


def some_of(q: Float[np.ndarray, "rows n"], maximum: int = POSES) -> np.ndarray:
    """Rows that stand for all of them: those with the extremes of each joint, the others evenly spread."""
    ends = np.concatenate([q.argmin(0), q.argmax(0)])
    even = np.linspace(0, len(q) - 1, min(len(q), maximum)).round().astype(int)
    return np.unique(np.concatenate([ends, even]))


ROUNDING = 1e-6
"""Joint positions that agree after rounding to this are one pose [rad or m]."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Calibration:
    """Origin of an arm's values.

    Args:
        source: Name of the file of measurements.
        poses: Of every row that was fitted, as `pose_keys` has them.
        std: Standard errors of the identified constants by name, in SI; without those that no row shows.
        nominal: Nominal values of the identified constants of arm and frames, SI; empty in older files.
        observed: What the rows showed of the tool; None in older files.
        error: Mean error on held-out rows, fitted ones where none were held out [m], [rad]; None if unknown.
    """

    source: str
    poses: UInt32[np.ndarray, " rows"]
    std: Mapping[str, float] = field(default_factory=dict)
    nominal: Mapping[str, float] = field(default_factory=dict)
    observed: Observed | None = None
    error: Expected | None = None

    def used(self, q: Float[np.ndarray, "rows n"]) -> Bool[np.ndarray, " rows"]:
        """Which joint positions were among those of the calibration."""
        return np.isin(pose_keys(q), self.poses)

    def table(self) -> dict[str, Any]:
        """The `[calibration]` table of the robot's file."""
        poses = base64.b64encode(self.poses.astype("<u4").tobytes()).decode()
        table: dict[str, Any] = {"source": self.source, "poses": poses, "std": dict(self.std)}
        if self.nominal:
            table["nominal"] = dict(self.nominal)
        if self.error is not None:
            table["error"] = list(self.error)
        if self.observed is not None:
            table["observed"] = self.observed.table()
        return table


def pose_keys(q: Float[np.ndarray, "rows n"]) -> UInt32[np.ndarray, " rows"]:
    """A number for each row of joint positions; equal rows have equal numbers."""
    rounded = np.ascontiguousarray(np.round(q / ROUNDING).astype("<i8"))
    return frozen(np.array([zlib.crc32(row.tobytes()) for row in rounded], np.uint32))


def poses_of(text: str) -> UInt32[np.ndarray, " rows"] | None:
    """Poses as `Calibration.table` wrote them; None for anything else."""
    try:
        return frozen(np.frombuffer(base64.b64decode(text, validate=True), "<u4").astype(np.uint32))
    except (binascii.Error, ValueError):
        return None


def calibration_of(table: Any, reader: AbstractTableReader) -> Calibration | None:
    """The record in a robot's file; None where it has none."""
    if table is None:
        return None
    what = "[calibration]"
    reader.keys(table, {"source", "poses", "std", "nominal", "error", "observed"}, what)
    poses = poses_of(str(table.get("poses", "")))
    if poses is None:
        raise reader.fail(f"{what} poses are damaged; take the file that the calibration wrote")

    def named(key: str) -> dict[str, float]:
        values = reader.table(table.get(key, {}), f"{what} {key}")
        return {name: reader.number(value, f"{what} {key} of {name}") for name, value in values.items()}

    return Calibration(
        source=str(table.get("source", "")),
        poses=poses,
        std=named("std"),
        nominal=named("nominal"),
        error=_expected(table, "error", what, reader) if "error" in table else None,
        observed=_observed(table["observed"], reader) if "observed" in table else None,
    )


def _observed(table: Any, reader: AbstractTableReader) -> Observed:
    what = "[calibration.observed]"
    reader.keys(table, {"position", "rotation", "tool", "flange", "q"}, what)
    rows = table.get("q")
    if not isinstance(rows, list) or not rows:
        raise reader.fail(f"{what} q must be a list of joint positions, not {rows!r}")
    first = len(rows[0]) if isinstance(rows[0], list) else 0
    return Observed(
        position=int(reader.number(table.get("position"), f"{what} position")),
        rotation=int(reader.number(table.get("rotation"), f"{what} rotation")),
        tool=_expected(table, "tool", what, reader),
        flange=_expected(table, "flange", what, reader),
        q=frozen(np.array([reader.numbers(row, first, f"{what} q") for row in rows])),
    )


def _expected(table: dict, key: str, what: str, reader: AbstractTableReader) -> Expected:
    """A position's and an orientation's error; NaN stands for none."""
    pair = table.get(key)
    if not isinstance(pair, list) or len(pair) != 2 or not all(isinstance(v, int | float) for v in pair):
        raise reader.fail(f"{what} {key} must be two numbers [m, rad], not {pair!r}")
    return Expected(float(pair[0]), float(pair[1]))
