"""From a plate's targets to manufacturable parts, or one sentence on why it can't be made.

A seat is a face with a bore for the probe's pin and an index hole on the tool's x axis, so that all six
coordinates are constrained. A socket is a 90° cone in which a ball rests with its centre at the target: the
face lies half a radius below the centre, the cone's apex √2 radii. A pointed probe stands in the apex of a
centre. A block's screw is under its target, and two dowels across the slope keep it from turning.
"""

import numpy as np

from workbench.base import se3
from workbench.base.errors import OptionError
from workbench.base.types import Vector3, frozen
from workbench.extras.workshop.parts import Block, Bore, Fixture, Purpose, Slab
from workbench.plate.optimiser.target_blocks import SIDE, STEEPEST, overlapping_blocks
from workbench.plate.plate import SQUARE, Kind, Plate, Target
from workbench.plate.tolerances import INDEX_OFFSET, INDEX_PIN, SEAT_PIN

UP, DOWN = frozen(np.array([0.0, 0.0, 1.0])), frozen(np.array([0.0, 0.0, -1.0]))
SCREW, MOUNTING, INSET = 0.0066, 0.009, 0.020
"""Diameters of the plate's holes for M6 screws and for mounting; distance of these from both edges [m]."""
THREAD, DOWEL = (0.005, 0.012), (0.004, 0.008)
"""Diameter and depth of the foot's tapped hole, before the thread is cut, and of its dowel holes [m]."""
DOWEL_OFFSET = 0.014
"""Distance of each dowel from the screw [m]."""
SEAT, INDEX, TIP = (SEAT_PIN, 0.008), (INDEX_PIN, 0.006), (0.003, 0.0015)
"""Diameter and depth of a seat, of its index hole, and of the centre for a pointed probe [m]."""
BALL = 0.012
"""Diameter of the ball that sits in sockets [m]."""
CONE = ((2.0 * np.sqrt(2.0) - 1.0) * 0.5 * BALL, (np.sqrt(2.0) - 0.5) * 0.5 * BALL)
"""Diameter and depth of its cone [m]."""
LIFT = {Kind.SEAT: 0.0, Kind.SOCKET: -0.25 * BALL, Kind.POINT: TIP[1]}
"""How far a face lies above its target along its normal [m]."""
WALL = 0.002
"""Minimum material between bores that face each other, and between a bore and an edge [m]."""
SLIDE = 0.005
"""Steps in which a mounting hole is moved away from its corner [m]."""


def fixture_of(plate: Plate) -> Fixture:
    """The parts of a plate; the tool's z axis points into each face."""
    size = plate.size
    if not len(plate) or size is None:
        lacking = "targets" if size is not None else "size; give size = [length, width, thickness] in m"
        raise OptionError(f"plate '{plate.name}' can't be made: it has no {lacking}")
    blocks = tuple(_block(plate, i, target) for i, target in enumerate(plate.targets, start=1))
    if met := overlapping_blocks(plate):
        raise OptionError(f"{met}; move one of them")
    for block in blocks:
        beyond = float((np.abs(block.footprint) - 0.5 * size[:2]).max())
        if beyond > 1e-9:
            raise OptionError(
                f"the block of target {block.number} stands {1e3 * beyond:.1f} mm over the edge of plate "
                f"'{plate.name}'; make the plate larger or move the target"
            )
    corners = (0.5 * size[:2] - INSET) * SQUARE
    mounting = [place for corner in corners if (place := _beside(corner, blocks)) is not None]
    left_out = f"{4 - len(mounting)} of 4 mounting holes would lie under a block and are left out"
    holes = [hole for block in blocks for hole in _under(block)]
    holes += [
        (f"M{i}", Purpose.MOUNTING, np.array([*place, 0.0]), MOUNTING) for i, place in enumerate(mounting, 1)
    ]
    bores = (Bore(what, mouth, DOWN, wide, float(size[2]), True, label) for label, what, mouth, wide in holes)
    return Fixture(plate, Slab(size, tuple(bores)), blocks, (left_out,) if len(mounting) < 4 else ())


def _block(plate: Plate, number: int, target: Target) -> Block:
    tool = se3.inverse(plate.pose) @ target.pose
    normal = -tool[:3, 2]
    tilt = float(np.arctan2(np.hypot(*normal[:2]), normal[2]))
    if tilt > STEEPEST:
        raise OptionError(
            f"the face of target {number} stands {np.rad2deg(tilt):.0f}° off the plate, more than the "
            f"{np.rad2deg(STEEPEST):.0f}° that a block can be sawn to; turn the target, or tilt the plate"
        )
    lift = LIFT[target.kind]
    azimuth = float(np.arctan2(normal[1], normal[0])) if tilt > 1e-6 else 0.0
    pose = se3.pose(se3.rpy_to_matrix(np.array([0.0, 0.0, azimuth])), np.array([*tool[:2, 3], 0.0]))
    local = se3.inverse(pose)
    middle = se3.apply(local, tool[:3, 3] + lift * normal)
    across = np.array([0.0, DOWEL_OFFSET, 0.0])
    block = Block(
        number=number,
        kind=target.kind,
        pose=frozen(pose),
        height=float(tool[2, 3] + lift / normal[2]),
        tilt=tilt,
        bores=(
            *_face_bores(target.kind, middle, local[:3, :3] @ tool[:3, :3]),
            Bore(Purpose.THREAD, np.zeros(3), UP, *THREAD),
            *(Bore(Purpose.DOWEL, sign * across, UP, *DOWEL) for sign in (1.0, -1.0)),
        ),
    )
    _check_height(block)
    return block


def _face_bores(kind: Kind, face: Vector3, tool: np.ndarray) -> list[Bore]:
    """What locates the tool: bores at the face's centre, along the tool's z axis."""
    inwards = tool[:, 2]
    if kind is Kind.SEAT:
        index = Bore(Purpose.INDEX, face + INDEX_OFFSET * tool[:, 0], inwards, *INDEX)
        return [Bore(Purpose.SEAT, face, inwards, *SEAT), index]
    cone = (Purpose.SOCKET, CONE) if kind is Kind.SOCKET else (Purpose.TIP, TIP)
    return [Bore(cone[0], face, inwards, *cone[1])]


def _check_height(block: Block) -> None:
    """Refuse a block whose bores would meet, or whose lower edge is thinner than the dowels are deep."""

    def lowest(bore: Bore) -> float:
        width = 0.0 if bore.conical else 0.5 * bore.diameter * float(np.hypot(*bore.direction[:2]))
        return float(bore.bottom[2]) - width

    from_above = min(lowest(bore) for bore in block.bores if bore.direction[2] < 0.0)
    need = max(THREAD[1] - from_above, DOWEL[1] - block.heights[0]) + WALL
    if need > 0.0:
        raise OptionError(
            f"the block of target {block.number} is {1e3 * block.height:.1f} mm high at its centre and needs "
            f"{1e3 * (block.height + need):.1f} mm for its bores; raise the target or lower the plate"
        )


def _under(block: Block) -> list[tuple[str, Purpose, Vector3, float]]:
    """Label, purpose, place and diameter of the slab's holes for a block's screw (7) and dowels (7a, 7b)."""
    thread, *dowels = (se3.apply(block.pose, bore.mouth) for bore in block.bores if bore.direction[2] > 0.0)
    pins = zip("ab", dowels, strict=True)
    return [
        (f"{block.number}", Purpose.SCREW, thread, SCREW),
        *((f"{block.number}{end}", Purpose.DOWEL, mouth, DOWEL[0]) for end, mouth in pins),
    ]


def _beside(corner: np.ndarray, blocks: tuple[Block, ...]) -> np.ndarray | None:
    """The place nearest to a corner along both edges, in its quarter, that no block covers."""
    for shift in np.arange(0.0, np.abs(corner).max(), SLIDE):
        for along in np.eye(2)[np.abs(corner) > shift]:
            place = corner - shift * along * np.sign(corner)
            local = [np.abs(b.pose[:2, :2].T @ (place - b.pose[:2, 3])) - 0.5 * SIDE for b in blocks]
            if np.linalg.norm(np.maximum(local, 0.0), axis=1).min() >= 0.5 * MOUNTING + WALL:
                return place
    return None
