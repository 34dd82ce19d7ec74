"""Source of a robot within a URDF."""

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class UrdfSource:
    """The file that a robot came from: for its meshes, and for writing a calibrated copy.

    Args:
        path: The URDF.
        joints: Names in the file of the robot's joint entries, in order.
        root: First link of the chain.
        tip: Last link of the chain.
    """

    path: Path
    joints: tuple[str, ...]
    root: str
    tip: str
