"""Calibration record of an arm: poses used, standard errors of its constants, observability.

Every pose is stored as four bytes, the CRC-32 of its joint positions rounded to `POSE_ROUNDING`: enough to
tell whether a later measurement was among them, and small in the robot's file. The probability that any two
of a thousand poses collide is about 10⁻⁴.

The observability of the tool is used by everything that applies the calibration. One reflector measures a
point, not the tool's orientation: constants that only rotate the tool are then arbitrary. Where a direction
was not measured, or is more uncertain than manufacturing errors, the nominal arm is better (`usable_arm.py`).
"""

import base64
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Float, UInt32

from workbench.base.arguments import Given, Reads
from workbench.base.types import frozen

if TYPE_CHECKING:
    from workbench.arm.robot import Robot

    Geometry = Robot | None
else:
    Geometry = Any  # a robot has the record

MAX_POSITION, MAX_ROTATION = 2e-3, float(np.deg2rad(0.3))
"""Standard errors of the tool above which a nominal arm is as good [m], [rad]."""
MAX_RECORDED_POSES = 120
"""Maximum number of measured joint positions in the record."""


class Expected(NamedTuple):
    """Expected error of a model at some poses.

    Args:
        position: Root mean square position error [m].
        rotation: Root mean square orientation error [rad].
    """

    position: float
    rotation: float


def _expected(value: Any, given: Given) -> Expected:
    if not isinstance(value, list | tuple) or not all(isinstance(v, int | float) for v in value):
        raise ValueError
    return Expected(*map(float, value))


Errors = Annotated[Expected, Reads("two numbers [m, rad]", _expected)]


@dataclass(frozen=True, eq=False, kw_only=True)
class Observed:
    """Observability of the tool in a calibration.

    Args:
        position: Number of observable directions of the tool's position, 0 to 3.
        rotation: Number of those of its orientation.
        tool: Uncertainty of the tool due to the constants.
        flange: Uncertainty of the flange due to the constants.
        q: Some of the measured joint positions, the extremes of every joint among them [rad or m].
    """

    position: int
    rotation: int
    tool: Errors
    flange: Errors
    q: Float[np.ndarray, "poses n"]

    @property
    def sees_position(self) -> bool:
        """Whether positions of the tool are known better than by the nominal arm."""
        return self.position == 3 and self.tool.position < MAX_POSITION

    @property
    def sees_rotation(self) -> bool:
        return self.rotation == 3 and self.tool.rotation < MAX_ROTATION

    @property
    def missing(self) -> str:
        """What is not known, and why, as text; empty if nothing is missing."""
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
        """As in the robot's file; joint positions to 1e-4."""
        return {
            "position": self.position,
            "rotation": self.rotation,
            "tool": list(self.tool),
            "flange": list(self.flange),
            "q": [[round(v, 4) for v in row] for row in self.q.tolist()],
        }


def representative_rows(q: Float[np.ndarray, "rows n"]) -> np.ndarray:
    """Representative rows: those with the extremes of each joint, the others evenly spread."""
    ends = np.concatenate([q.argmin(0), q.argmax(0)])
    even = np.linspace(0, len(q) - 1, min(len(q), MAX_RECORDED_POSES)).round().astype(int)
    return np.unique(np.concatenate([ends, even]))


POSE_ROUNDING = 1e-6
"""Joint positions that agree after rounding to this [rad or m] are the same pose."""


def _poses(value: Any, given: Given) -> Any:
    if not isinstance(value, str):
        return value
    return frozen(np.frombuffer(base64.b64decode(value, validate=True), "<u4").astype(np.uint32))


def _covariance(value: Any, given: Given) -> Any:
    if not isinstance(value, str):
        return value
    half = np.frombuffer(base64.b64decode(value, validate=True), "<f4").astype(float)
    size = int(np.sqrt(2 * len(half)))
    table = np.zeros((size, size))
    table[np.tril_indices(size)] = half
    return frozen(table + np.tril(table, -1).T)


Poses = Annotated[UInt32[np.ndarray, " rows"], Reads("keys of poses as a calibration writes them", _poses)]
Covariance = Annotated[
    Float[np.ndarray, "k k"], Reads("half a covariance as a calibration writes it", _covariance)
]


@dataclass(frozen=True, eq=False, kw_only=True)
class Calibration:
    """Origin of an arm's values.

    Args:
        source: Name of the file of measurements.
        poses: Keys of all fitted rows, from `pose_keys`.
        std: Standard errors of the identified constants by name, in SI; without unobservable ones.
        nominal: Nominal values of the identified constants of arm and frames, SI.
        covariance: Of the arm's constants among them, SI, in that order, for base and tool as found: of many
            only sums are known.
        observed: Observability of the tool.
        error: Mean error on held-out rows, or fitted ones if none were held out [m], [rad]; None if unknown.
        reading: What its rows were taken to mean where that isn't what they say; its joints count so.
        refused: Why not to use the arm, by the file that holds it (TOML, URDF); under "" any, left unwritten.
        geometry: The best arm without its effects, masses and gravity as given: those of the arm itself were
            fitted for its effects of load, and are known through these only. None if it has no effects.
        geometry_error: Its mean error on the rows of `error`, at the loads that were measured.
    """

    source: str = ""
    poses: Poses
    std: Mapping[str, float] = field(default_factory=dict)
    nominal: Mapping[str, float] = field(default_factory=dict)
    covariance: Covariance = field(default_factory=lambda: np.zeros((0, 0)))
    observed: Observed
    error: Errors | None = None
    reading: str = ""
    refused: Mapping[str, str] = field(default_factory=dict)
    geometry: Geometry = None
    geometry_error: Errors | None = None

    def used(self, q: Float[np.ndarray, "rows n"]) -> Bool[np.ndarray, " rows"]:
        """Which joint positions were among those of the calibration."""
        return np.isin(pose_keys(q), self.poses)

    def table(self) -> dict[str, Any]:
        """The `[calibration]` table of the robot's file."""
        half = self.covariance[np.tril_indices(len(self.covariance))]
        table: dict[str, Any] = {
            "source": self.source,
            "poses": base64.b64encode(self.poses.astype("<u4").tobytes()).decode(),
            "std": dict(self.std),
            "nominal": dict(self.nominal),
            "covariance": base64.b64encode(half.astype("<f4").tobytes()).decode(),
        }
        pairs = {"error": self.error, "geometry_error": self.geometry_error}
        table |= {name: list(error) for name, error in pairs.items() if error is not None}
        if self.reading:
            table["reading"] = self.reading
        if refused := {name: why for name, why in self.refused.items() if name}:
            table["refused"] = refused
        return table | {"observed": self.observed.table()}


def pose_keys(q: Float[np.ndarray, "rows n"]) -> UInt32[np.ndarray, " rows"]:
    """A key for each row of joint positions; equal rows have equal keys."""
    rounded = np.ascontiguousarray(np.round(q / POSE_ROUNDING).astype("<i8"))
    return frozen(np.array([zlib.crc32(row.tobytes()) for row in rounded], np.uint32))
