"""The parts that a fixture is made of: a slab with holes, and on it one block for each target.

A block is a truncated square prism (ARIA Fig. 6b): square bar, sawn off in the plane of the target's face.
Its frame stands at the centre of its foot, z along the plate's normal, x down the slope of the face:

    face: z = height − x tan(tilt),      volume = side² · height − bores

so that one mitre angle is all the saw has to know; where the slope points is the block's turn on the plate,
and two dowels keep it there. Lengths are metres here and millimetres in every file that leaves.
"""

from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property

import numpy as np
from jaxtyping import Float

from workbench.base.types import Matrix4, Vector3
from workbench.plate.optimiser.target_blocks import SIDE
from workbench.plate.plate import SQUARE, Kind, Plate


class Purpose(StrEnum):
    """What a bore is for; the value stands in the table of holes."""

    SCREW = "screw M6"
    THREAD = "thread M6"
    DOWEL = "dowel"
    MOUNTING = "mounting"
    SEAT = "seat"
    INDEX = "index pin"
    SOCKET = "ball"
    TIP = "pointed probe"


@dataclass(frozen=True, eq=False)
class Bore:
    """A round hole, or a 90° cone, in the frame of its part.

    Args:
        purpose: What it is for; sockets and centres are cones.
        mouth: Centre of its mouth [m].
        direction: Unit vector into the material.
        diameter: At the mouth [m].
        depth: Along its axis [m].
        through: Whether it comes out on the other side.
        label: Of the plate's holes: 7 and 7a, 7b for the screw and the dowels of target 7; M1 … for mounting.
    """

    purpose: Purpose
    mouth: Vector3
    direction: Vector3
    diameter: float
    depth: float
    through: bool = False
    label: str = ""

    @property
    def conical(self) -> bool:
        """Whether it is a cone with its apex at the bottom."""
        return self.purpose in (Purpose.SOCKET, Purpose.TIP)

    @property
    def bottom(self) -> Vector3:
        """Centre of its bottom, or its apex [m]."""
        return self.mouth + self.depth * self.direction


@dataclass(frozen=True, eq=False)
class Slab:
    """The plate itself: z = 0 is its top, its centre the origin; its size [m] and its holes."""

    size: Vector3
    bores: tuple[Bore, ...]


@dataclass(frozen=True, eq=False, kw_only=True)
class Block:
    """A truncated square prism.

    Args:
        number: Its target, counted from 1.
        kind: What the target constrains.
        pose: Frame of its foot in the plate's frame: T_plate_block.
        height: Height of the face over the foot's centre [m].
        tilt: Angle between the face and the plate [rad].
        bores: Its holes, in its own frame.
    """

    number: int
    kind: Kind
    pose: Matrix4
    height: float
    tilt: float
    bores: tuple[Bore, ...]

    @property
    def azimuth(self) -> float:
        """Direction in which the face slopes down, about the plate's normal from its x axis [rad]."""
        return float(np.arctan2(self.pose[1, 0], self.pose[0, 0]))

    @property
    def heights(self) -> tuple[float, float]:
        """Of the lowest and the highest edge of the face [m]."""
        fall = 0.5 * SIDE * float(np.tan(self.tilt))
        return self.height - fall, self.height + fall

    @property
    def footprint(self) -> Float[np.ndarray, "4 2"]:
        """Corners of the foot on the plate [m], anticlockwise."""
        return (0.5 * SIDE * SQUARE) @ self.pose[:2, :2].T + self.pose[:2, 3]

    def same_shape(self, other: "Block") -> bool:
        """Whether one file makes both, to a micrometre and an arc second."""
        return (
            self.kind is other.kind
            and abs(self.height - other.height) < 1e-6
            and abs(self.tilt - other.tilt) < 5e-6
            and all(
                np.abs(a.mouth - b.mouth).max() < 1e-6 for a, b in zip(self.bores, other.bores, strict=True)
            )
        )


@dataclass(frozen=True, eq=False)
class Fixture:
    """All parts of a plate.

    Args:
        blocks: One for each target.
        notes: What was decided, one sentence each.
    """

    plate: Plate
    slab: Slab
    blocks: tuple[Block, ...]
    notes: tuple[str, ...]

    @cached_property
    def shapes(self) -> dict[str, tuple[Block, ...]]:
        """Blocks that are made alike, by letter in the order in which they first come."""
        groups: list[list[Block]] = []
        for block in self.blocks:
            alike = next((group for group in groups if group[0].same_shape(block)), None)
            if alike is None:
                groups.append(alike := [])
            alike.append(block)
        return {_letter(i): tuple(group) for i, group in enumerate(groups)}

    def from_corner(self, places: Float[np.ndarray, "*places axes"]) -> Float[np.ndarray, "*places 2"]:
        """Positions on the slab's top, from its lower left corner [mm]."""
        return 1e3 * (np.asarray(places)[..., :2] + 0.5 * self.slab.size[:2])

    @property
    def made(self) -> dict[str, Slab | Block]:
        """Every part that is made, one of each, by the name of its files; the plate first."""
        return {"plate": self.slab, **{f"block-{letter}": alike[0] for letter, alike in self.shapes.items()}}


def _letter(index: int) -> str:
    """A … Z, AA, AB …"""
    text = chr(ord("A") + index % 26)
    return text if index < 26 else _letter(index // 26 - 1) + text
