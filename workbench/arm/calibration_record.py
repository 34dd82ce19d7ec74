"""Calibration record of a calibrated arm: the poses used, and the standard errors of its constants.

Every pose is kept as four bytes, the CRC-32 of its joint positions rounded to `ROUNDING`: enough to tell
whether a later measurement was among them, and no burden in the robot's file. Two poses of a thousand are
taken for each other with a probability of about 10⁻⁴.
"""

import base64
import binascii
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, UInt32

from workbench.base.types import frozen

ROUNDING = 1e-6
"""Joint positions that agree after rounding to this are one pose [rad or m]."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Calibration:
    """Origin of an arm's values.

    Args:
        source: Name of the file of measurements.
        poses: Of every row that was fitted, as `pose_keys` has them.
        std: Standard errors of the identified constants by name, in SI; without those that no row shows.
    """

    source: str
    poses: UInt32[np.ndarray, " rows"]
    std: Mapping[str, float] = field(default_factory=dict)

    def used(self, q: Float[np.ndarray, "rows n"]) -> Bool[np.ndarray, " rows"]:
        """Which joint positions were among those of the calibration."""
        return np.isin(pose_keys(q), self.poses)

    def table(self) -> dict[str, Any]:
        """The `[calibration]` table of the robot's file."""
        poses = base64.b64encode(self.poses.astype("<u4").tobytes()).decode()
        return {"source": self.source, "poses": poses, "std": dict(self.std)}


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
