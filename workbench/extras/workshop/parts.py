"""The parts that a fixture is made of: a slab with holes, and on it one block for each target.

A block is a truncated square prism (ARIA Fig. 6b): square bar, sawn off in the plane of the target's face.
Its frame stands at the centre of its foot, z along the plate's normal, x down the slope of the face:

    face: z = height − x tan(tilt),      volume = side² · height − bores

so that one mitre angle is all the saw has to know; where the slope points is the block's turn on the plate,
and two dowels keep it there. Lengths are metres here and millimetres in every file that leaves.
"""

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
from jaxtyping import Float

from workbench.base.types import Matrix4, Vector3
from workbench.plate.plate import SQUARE, Kind
from workbench.plate.stock import Stock
from workbench.plate.tolerances import Tolerances


class Purpose(StrEnum):
    """What a bore is for; the value stands in lists and drawings."""

    SCREW = "clearance hole for the block's screw"
    THREAD = "tapped hole for the screw"
    DOWEL = "dowel hole, H7"
    MOUNTING = "mounting hole"
    SEAT = "seat of the probe, H7"
    INDEX = "index pin along the tool's x axis, H7"
    SOCKET = "90° cone for the ball"
    TIP = "90° centre for the pointed probe"
    MAGNET = "pocket for the magnet under the ball"
    PIN = "press fit for a g6 pin, S7"
    FLANGE = "screw hole of the flange, ISO 9409-1"
    STANDOFF = "screw hole for a stand-off"
    ROBOT = "screw hole for the robot's foot"


FITS = {Purpose.DOWEL: "H7", Purpose.SEAT: "H7", Purpose.INDEX: "H7", Purpose.PIN: "S7"}
"""Fits of bores; the others are as drilled."""
THREADS = {0.0042: "M5", 0.005: "M6", 0.0068: "M8"}
"""Threads by the diameter of their core holes [m]."""


@dataclass(frozen=True, eq=False)
class Bore:
    """A round hole, or a 90° cone, in the frame of its part.

    Args:
        label: Number of the block, with a letter for the plate's dowel holes, or M1 … for mounting holes.
        purpose: What it is for; sockets and centres are cones.
        mouth: Centre of its mouth [m].
        direction: Unit vector into the material.
        diameter: At the mouth [m].
        depth: Along its axis [m].
        through: Whether it comes out on the other side.
    """

    label: str
    purpose: Purpose
    mouth: Vector3
    direction: Vector3
    diameter: float
    depth: float
    through: bool = False

    @property
    def conical(self) -> bool:
        """Whether it is a cone with its apex at the bottom."""
        return self.purpose in (Purpose.SOCKET, Purpose.TIP)

    @property
    def size(self) -> str:
        """Its diameter with fit or thread, as on a drawing."""
        if self.purpose is Purpose.THREAD and round(self.diameter, 6) in THREADS:
            return f"{THREADS[round(self.diameter, 6)]} (core Ø{1e3 * self.diameter:.3g})"
        cone = "90° cone " if self.conical else ""
        return f"{cone}Ø{1e3 * self.diameter:.4g} {FITS.get(self.purpose, '')}".strip()

    @property
    def bottom(self) -> Vector3:
        """Centre of its bottom, or its apex [m]."""
        return self.mouth + self.depth * self.direction

    @property
    def outline(self) -> Float[np.ndarray, "corners 2"]:
        """Corners seen along y, in x and z of its part [m]."""
        across = 0.5 * self.diameter * np.array([self.direction[2], 0.0, -self.direction[0]])
        ends = [self.bottom] if self.conical else [self.bottom - across, self.bottom + across]
        return np.array([self.mouth + across, self.mouth - across, *ends])[:, [0, 2]]


@dataclass(frozen=True, eq=False, kw_only=True)
class Slab:
    """The plate itself, or the one under it: z = 0 is its top, its centre the origin.

    Args:
        size: Length, width and thickness [m].
        bores: Its holes.
        name: `plate` or `bottom`.
        quantity: How many are made.
    """

    size: Vector3
    bores: tuple[Bore, ...]
    name: str = "plate"
    quantity: int = 1


@dataclass(frozen=True, eq=False, kw_only=True)
class Turned:
    """A turned part: cylinders on one axis, z, with bores along it.

    Args:
        name: `probe`, `stand-off`.
        steps: Diameter and length of each cylinder [m], from z = 0 upwards.
        bores: Its holes.
        quantity: How many are made.
    """

    name: str
    steps: tuple[tuple[float, float], ...]
    bores: tuple[Bore, ...]
    quantity: int = 1

    @property
    def length(self) -> float:
        return sum(length for _, length in self.steps)


@dataclass(frozen=True, eq=False, kw_only=True)
class Block:
    """A truncated square prism.

    Args:
        number: Its target, counted from 1.
        kind: What the target constrains.
        pose: Frame of its foot in the plate's frame: T_plate_block.
        side: Side of the square [m].
        height: Height of the face over the foot's centre [m].
        tilt: Angle between the face and the plate [rad].
        bores: Its holes, in its own frame.
    """

    number: int
    kind: Kind
    pose: Matrix4
    side: float
    height: float
    tilt: float
    bores: tuple[Bore, ...]

    @property
    def azimuth(self) -> float:
        """Direction in which the face slopes down, about the plate's normal from its x axis [rad]."""
        return float(np.arctan2(self.pose[1, 0], self.pose[0, 0]))

    @property
    def heights(self) -> tuple[float, float]:
        fall = 0.5 * self.side * float(np.tan(self.tilt))
        return self.height - fall, self.height + fall

    @property
    def footprint(self) -> np.ndarray:
        """Corners of the foot on the plate [m], anticlockwise."""
        return (0.5 * self.side * SQUARE) @ self.pose[:2, :2].T + self.pose[:2, 3]

    @property
    def face(self) -> Matrix4:
        """Frame of the face in the block's: x downhill, y across, z out of the material."""
        cos, sin = float(np.cos(self.tilt)), float(np.sin(self.tilt))
        frame = np.eye(4)
        frame[:3, :3] = [[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]]
        frame[2, 3] = self.height
        return frame

    def on_face(self, bore: Bore) -> tuple[float, float]:
        """Where a bore's mouth lies on the face, downhill and across from its centre [mm]."""
        u, v, _ = 1e3 * (self.face[:3, :3].T @ (bore.mouth - self.face[:3, 3]))
        return float(u), float(v)

    def same_shape(self, other: "Block") -> bool:
        """Whether one drawing makes both, to a micrometre and an arc second."""
        return (
            self.kind is other.kind
            and abs(self.height - other.height) < 1e-6
            and abs(self.tilt - other.tilt) < 5e-6
            and all(
                np.abs(a.mouth - b.mouth).max() < 1e-6 for a, b in zip(self.bores, other.bores, strict=True)
            )
        )


@dataclass(frozen=True, eq=False, kw_only=True)
class BlockShape:
    """Blocks that are made alike.

    Args:
        letter: A, B, …
        block: One of them.
        numbers: Targets that take one, counted from 1.
    """

    letter: str
    block: Block
    numbers: tuple[int, ...]


@dataclass(frozen=True, eq=False, kw_only=True)
class Fixture:
    """All parts of a plate.

    Args:
        name: The plate's.
        pose: Pose of the slab's top centre in the robot's base.
        slab: The plate itself.
        blocks: One a target, in their order.
        probe: What the arm carries into the seats.
        bottom: The plate under robot and stand-offs; None where the plate leans or lies too low.
        standoff: What carries the plate, four times.
        stock: What the parts are made with.
        anchored: Whether the blocks hold the balls of a ball-bar, and the targets are in the air.
    """

    name: str
    pose: Matrix4
    slab: Slab
    blocks: tuple[Block, ...]
    tolerances: Tolerances
    probe: Turned | None = None
    bottom: Slab | None = None
    standoff: Turned | None = None
    notes: tuple[str, ...] = field(default=())
    stock: Stock = field(default_factory=Stock)
    anchored: bool = False

    @property
    def shapes(self) -> tuple[BlockShape, ...]:
        """Blocks gathered by shape, in the order in which they first come."""
        groups: list[list[Block]] = []
        for block in self.blocks:
            group = next((g for g in groups if g[0].same_shape(block)), None)
            if group is None:
                groups.append([block])
            else:
                group.append(block)
        return tuple(
            BlockShape(letter=_letter(i), block=group[0], numbers=tuple(b.number for b in group))
            for i, group in enumerate(groups)
        )

    def from_corner(self, place: Vector3) -> tuple[float, float]:
        """A position on the slab's top, from its lower left corner [mm]."""
        x, y = 1e3 * (place[:2] + 0.5 * self.slab.size[:2])
        return float(x), float(y)

    @property
    def others(self) -> tuple[Slab | Turned, ...]:
        """The parts beside plate and blocks."""
        return tuple(part for part in (self.probe, self.bottom, self.standoff) if part is not None)

    @property
    def made(self) -> tuple[tuple[str, Slab | Block | Turned], ...]:
        """Every part that is made, one of each, by the name of its files; the plate first."""
        blocks = [(f"block-{shape.letter}", shape.block) for shape in self.shapes]
        return ("plate", self.slab), *blocks, *((part.name, part) for part in self.others)

    def letter(self, number: int) -> str:
        return next(shape.letter for shape in self.shapes if number in shape.numbers)


def _letter(index: int) -> str:
    """A … Z, AA, AB …"""
    text = chr(ord("A") + index % 26)
    return text if index < 26 else _letter(index // 26 - 1) + text
