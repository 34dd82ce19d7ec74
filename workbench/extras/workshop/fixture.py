"""From a plate's targets to manufacturable parts, or one sentence on why it can't be made.

A seat is a face with a bore for the probe's pin and an index hole on the tool's x axis, so that all six
coordinates are constrained. A socket is a 90° cone in which a ball rests with its centre at the target: the
face lies half a radius below the centre, the cone's apex √2 radii. A pointed probe stands in the apex of a
centre. A block's screw is under its target, so that blocks meant for a grid of holes stand on it.

The probe is a cylinder on the arm's flange (ISO 9409-1-50-4-M6) with two dowel pins in its face: one at the
centre for the seat and one on the tool's x axis for the index hole (ARIA Fig. 6). Its z axis is the tool's.
The bottom plate lies in the plane of the robot's foot, mostly z = 0 of its base, and carries both: holes
for the foot's screws about the base's z axis, and four for the stand-offs under the plate's mounting holes.
"""

from itertools import combinations

import numpy as np

from workbench.arm.kinematics.skeleton import height_above_floor
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.errors import OptionError
from workbench.base.types import Matrix4, Vector3, frozen
from workbench.extras.workshop.parts import Block, Bore, Fixture, Purpose, Slab, Turned
from workbench.plate.optimiser.target_blocks import STEEPEST
from workbench.plate.plate import SQUARE, Kind, Plate, Target
from workbench.plate.stock import DOWN, UP, Stock
from workbench.plate.tolerances import tolerances_of

SLIDE = 0.005
"""Steps in which a mounting hole is moved away from its corner [m]."""
WALL = 0.002
"""Minimum material between bores that face each other, and between a bore and an edge [m]."""


def fixture_of(plate: Plate, *, stock: Stock | None = None, robot: Robot | None = None) -> Fixture:
    """The parts of a plate.

    Args:
        plate: Targets over the plate; the tool's z axis points into each face.
        stock: What the blocks are made with.
        robot: Whose foot it is tied to; one whose base is in its foot if None.
    """
    stock = stock or Stock()
    if not len(plate):
        raise OptionError(f"plate '{plate.name}' has no targets, so there is nothing to make")
    blocks = tuple(_block(plate, i, target, stock) for i, target in enumerate(plate.mounted, start=1))
    for one, two in combinations(blocks, 2):
        if overlap(one.footprint, two.footprint):
            raise OptionError(
                f"the blocks of targets {one.number} and {two.number} overlap "
                f"({1e3 * np.linalg.norm(one.pose[:2, 3] - two.pose[:2, 3]):.0f} mm apart, bar of "
                f"{1e3 * stock.side:.0f} mm); move one of them"
            )
    size, notes = _size(plate, blocks, stock)
    _check_on_plate(blocks, size, plate.name)
    mounting, left_out = _mounting(size, blocks, stock)
    if left_out:
        notes.append(f"{left_out} of 4 mounting holes would lie under a block and are left out")
    bores = tuple(bore for block in blocks for bore in _under(block, size[2], stock)) + mounting
    slab = Slab(size=size, bores=bores)
    foot = 0.0 if robot is None else -height_above_floor(robot)
    bottom, standoff, remarks = base_parts(plate.pose, slab, stock, foot)
    return Fixture(
        name=plate.name,
        pose=plate.pose,
        slab=slab,
        blocks=blocks,
        tolerances=tolerances_of(plate.production, stock.dowel_offset),
        probe=_probe_for(plate, stock),
        bottom=bottom,
        standoff=standoff,
        notes=(*notes, *stock.notes, *remarks),
        stock=stock,
        anchored=plate.anchors is not None,
    )


def _probe_for(plate: Plate, stock: Stock) -> Turned | None:
    """What the arm carries into the targets; a pointed probe is bought."""
    kinds = {target.kind for target in plate.mounted}
    return probe_of(stock) if Kind.SEAT in kinds else ball_probe_of(stock) if Kind.SOCKET in kinds else None


def _block(plate: Plate, number: int, target: Target, stock: Stock) -> Block:
    tool = se3.inverse(plate.pose) @ target.pose
    normal = -tool[:3, 2]
    tilt = float(np.arctan2(np.hypot(*normal[:2]), normal[2]))
    if tilt > STEEPEST:
        raise OptionError(
            f"the face of target {number} stands {np.rad2deg(tilt):.0f}° off the plate, more than the "
            f"{np.rad2deg(STEEPEST):.0f}° that a block can be sawn to; turn the target, or tilt the plate"
        )
    lift = stock.lift(target.kind)
    azimuth = float(np.arctan2(normal[1], normal[0])) if tilt > 1e-6 else 0.0
    pose = se3.pose(se3.rpy_to_matrix(np.array([0.0, 0.0, azimuth])), np.array([*tool[:2, 3], 0.0]))
    local = se3.inverse(pose)
    middle = se3.apply(local, tool[:3, 3] + lift * normal)
    bores = (*_face_bores(number, target.kind, middle, local[:3, :3] @ tool[:3, :3], stock),)
    block = Block(
        number=number,
        kind=target.kind,
        pose=frozen(pose),
        side=stock.side,
        height=float(tool[2, 3] + lift / normal[2]),
        tilt=tilt,
        bores=(*bores, *_foot_bores(number, stock)),
    )
    _check_height(block, stock)
    return block


def _face_bores(number: int, kind: Kind, face: Vector3, tool: np.ndarray, stock: Stock) -> list[Bore]:
    """What locates the tool: bores at the face's centre, along the tool's z axis."""
    label, inwards = f"{number}", tool[:, 2]
    if kind is Kind.SEAT:
        index = face + stock.index_offset * tool[:, 0]
        return [
            Bore(label, Purpose.SEAT, face, inwards, stock.seat, stock.seat_depth),
            Bore(label, Purpose.INDEX, index, inwards, stock.index, stock.index_depth),
        ]
    if kind is Kind.SOCKET:
        cone = Bore(label, Purpose.SOCKET, face, inwards, *stock.cone)
        return (
            [cone]
            if stock.magnet is None
            else [cone, Bore(label, Purpose.MAGNET, face, inwards, *stock.magnet)]
        )
    return [Bore(label, Purpose.TIP, face, inwards, stock.centre, 0.5 * stock.centre)]


def _foot_bores(number: int, stock: Stock) -> list[Bore]:
    """Thread and dowel holes in a block's foot; the dowels lie across the slope."""
    thread = Bore(f"{number}", Purpose.THREAD, np.zeros(3), UP, stock.core, stock.thread)
    across = np.array([0.0, stock.dowel_offset, 0.0])
    return [thread] + [
        Bore(f"{number}", Purpose.DOWEL, sign * across, UP, stock.dowel, stock.dowel_depth)
        for sign in ((1.0, -1.0) if stock.doweled else ())
    ]


def _check_height(block: Block, stock: Stock) -> None:
    """Refuse a block whose bores would meet, or whose lower edge is thinner than the dowels are deep."""
    from_above = min(_lowest(bore) for bore in block.bores if bore.direction[2] < 0.0)
    pins = stock.dowel_depth - block.heights[0] if stock.doweled else -block.heights[0]
    need = max(stock.thread - from_above, pins) + WALL
    if need > 0.0:
        raise OptionError(
            f"the block of target {block.number} is {1e3 * block.height:.1f} mm high at its centre and needs "
            f"{1e3 * (block.height + need):.1f} mm for its bores; raise the target or lower the plate"
        )


def _lowest(bore: Bore) -> float:
    width = 0.0 if bore.conical else 0.5 * bore.diameter * float(np.hypot(*bore.direction[:2]))
    return float(bore.bottom[2]) - width


def overlap(one: np.ndarray, two: np.ndarray) -> bool:
    """Whether two convex polygons meet (separating axes of their edges)."""
    for edges in (one, two):
        along = np.roll(edges, -1, axis=0) - edges
        for normal in np.column_stack([along[:, 1], -along[:, 0]]):
            a, b = one @ normal, two @ normal
            if a.max() <= b.min() or b.max() <= a.min():
                return False
    return True


def _size(plate: Plate, blocks: tuple[Block, ...], stock: Stock) -> tuple[Vector3, list[str]]:
    """The slab's size, and what was decided about it."""
    if plate.size is not None:
        return plate.size, []
    reach = np.abs(np.concatenate([block.footprint for block in blocks])).max(axis=0) + stock.margin
    size = np.array([*(np.ceil(2e3 * reach) / 1e3), stock.thickness])
    text = " × ".join(f"{1e3 * edge:.0f}" for edge in size)
    return frozen(size), [f"the plate's file gives no size; {text} mm holds all blocks"]


def _check_on_plate(blocks: tuple[Block, ...], size: Vector3, name: str) -> None:
    for block in blocks:
        beyond = float((np.abs(block.footprint) - 0.5 * size[:2]).max())
        if beyond > 1e-9:
            raise OptionError(
                f"the block of target {block.number} stands {1e3 * beyond:.1f} mm over the edge of plate "
                f"'{name}'; make the plate larger or move the target"
            )


def _under(block: Block, thickness: float, stock: Stock) -> list[Bore]:
    """The slab's holes for one block, right through: 7 for its screw, 7a and 7b for its dowels."""
    thread, *dowels = (bore for bore in block.bores if bore.direction[2] > 0.0)
    holes = [(thread, thread.label, thread.purpose if stock.tapped else Purpose.SCREW, stock.clearance)]
    holes += [
        (dowel, dowel.label + end, Purpose.DOWEL, stock.dowel)
        for dowel, end in zip(dowels, "ab", strict=False)
    ]
    return [
        Bore(
            label, purpose, se3.apply(block.pose, bore.mouth), DOWN, diameter, float(thickness), through=True
        )
        for bore, label, purpose, diameter in holes
    ]


def _mounting(size: Vector3, blocks: tuple[Block, ...], stock: Stock) -> tuple[tuple[Bore, ...], int]:
    """A mounting hole in every corner, or beside it where a block covers it, and how many are left out."""
    corners = (0.5 * size[:2] - stock.inset) * SQUARE
    found = [_beside(corner, blocks, stock) for corner in corners]
    free = [place for place in found if place is not None]
    bores = tuple(
        Bore(
            f"M{i}",
            Purpose.MOUNTING,
            np.array([*corner, 0.0]),
            DOWN,
            stock.mounting,
            float(size[2]),
            through=True,
        )
        for i, corner in enumerate(free, start=1)
    )
    return bores, 4 - len(free)


def _beside(corner: np.ndarray, blocks: tuple[Block, ...], stock: Stock) -> np.ndarray | None:
    """The place nearest to a corner along both edges, in its quarter, that no block covers."""
    for shift in np.arange(0.0, np.abs(corner).max(), SLIDE):
        for along in np.eye(2)[np.abs(corner) > shift]:
            place = corner - shift * along * np.sign(corner)
            if not any(_covers(block.pose, place, stock) for block in blocks):
                return place
    return None


def _covers(pose: Matrix4, corner: np.ndarray, stock: Stock) -> bool:
    """Whether a hole at the corner would come under a block or closer to it than the wall."""
    local = pose[:2, :2].T @ (corner - pose[:2, 3])
    outside = np.maximum(np.abs(local) - 0.5 * stock.side, 0.0)
    return bool(np.linalg.norm(outside) < 0.5 * stock.mounting + WALL)


DEPTHS = (0.012, 0.010)
"""How deep the probe's pins are pressed in, seat and index [m]."""
FLANGE = 0.008
"""Thickness of the probe's flange [m]."""
MAX_LEAN = 1e-6
"""A plate leans if its normal is off the vertical by more [rad]."""
MIN_STANDOFF = 0.025
"""Minimum length of a stand-off: two threads and a wall [m]."""
RIM = 0.03
"""Material of the bottom plate around its holes [m]."""


def _circle(diameter: float) -> np.ndarray:
    angles = np.deg2rad([45.0, 135.0, 225.0, 315.0])
    return 0.5 * diameter * np.column_stack([np.cos(angles), np.sin(angles), np.zeros(4)])


def probe_of(stock: Stock) -> Turned:
    """The probe; its face, at z = its length, rests on the block's."""
    face = np.array([0.0, 0.0, stock.probe])
    index = np.array([stock.index_offset, 0.0, stock.probe])
    return _probe(
        stock,
        stock.neck,
        Bore("P1", Purpose.PIN, face, DOWN, stock.seat, DEPTHS[0]),
        Bore("P2", Purpose.PIN, index, DOWN, stock.index, DEPTHS[1]),
    )


def ball_probe_of(stock: Stock) -> Turned:
    """The probe with a cone for a ball, whose centre, the tool's origin, lies ¼ diameter over its face."""
    face = np.array([0.0, 0.0, stock.probe])
    cone = [Bore("P1", Purpose.SOCKET, face, DOWN, *stock.cone)]
    if stock.magnet is not None:
        cone.append(Bore("P2", Purpose.MAGNET, face, DOWN, *stock.magnet))
    return _probe(stock, 1.5 * stock.ball, *cone)


def _probe(stock: Stock, neck: float, *tip: Bore) -> Turned:
    """A neck on the arm's flange, with what its face needs."""
    flange, circle, hole = stock.flange
    screws = [
        Bore(f"F{i}", Purpose.FLANGE, place, UP, hole, FLANGE, through=True)
        for i, place in enumerate(_circle(circle), start=1)
    ]
    steps = ((flange, FLANGE), (neck, stock.probe - FLANGE))
    return Turned(name="probe", steps=steps, bores=(*tip, *screws))


def base_parts(
    pose: Matrix4, slab: Slab, stock: Stock, foot: float
) -> tuple[Slab | None, Turned | None, tuple[str, ...]]:
    """Bottom plate and stand-off, or why there are none.

    Args:
        pose: Of the plate's top centre in the robot's base.
        slab: The plate with its mounting holes.
        foot: Height of the robot's foot there [m].
    """
    lean = float(np.arccos(np.clip(pose[2, 2], -1.0, 1.0)))
    height = float(pose[2, 3] - slab.size[2]) - foot
    mounts = [bore for bore in slab.bores if bore.purpose is Purpose.MOUNTING]
    if lean > MAX_LEAN or height < MIN_STANDOFF or len(mounts) < 3:
        why = (
            f"the plate leans by {np.rad2deg(lean):.2f}°"
            if lean > MAX_LEAN
            else f"the plate's underside is {1e3 * height:.0f} mm above the robot's foot, a stand-off needs "
            f"{1e3 * MIN_STANDOFF:.0f} mm"
            if height < MIN_STANDOFF
            else f"the plate has {len(mounts)} mounting holes"
        )
        return None, None, (f"{why}: no bottom plate and stand-offs are drawn to tie it to the robot",)
    places = np.array([se3.apply(pose, bore.mouth) for bore in mounts]) * [1.0, 1.0, 0.0]
    screws = _circle(stock.foot[0])
    reach = np.concatenate([places, screws])[:, :2]
    low, high = reach.min(axis=0) - RIM, reach.max(axis=0) + RIM
    low, high = np.floor(200.0 * low) / 200.0, np.ceil(200.0 * high) / 200.0
    middle = np.array([*(0.5 * (low + high)), 0.0])
    size = np.array([*(high - low), stock.bottom])
    bores = [
        Bore(f"S{i}", Purpose.STANDOFF, place - middle, DOWN, stock.mounting, stock.bottom, through=True)
        for i, place in enumerate(places, start=1)
    ]
    bores += [
        Bore(f"R{i}", Purpose.ROBOT, place - middle, DOWN, stock.foot[1], stock.bottom, through=True)
        for i, place in enumerate(screws, start=1)
    ]
    diameter, core, depth = stock.post
    depth = min(depth, 0.5 * height - 0.002)
    threads = (
        Bore("T1", Purpose.THREAD, np.zeros(3), UP, core, depth),
        Bore("T2", Purpose.THREAD, np.array([0.0, 0.0, height]), DOWN, core, depth),
    )
    post = Turned(name="stand-off", steps=((diameter, height),), bores=threads, quantity=len(mounts))
    note = (
        f"The bottom plate's holes R1–R4 are for a robot's foot with screws on a circle of "
        f"{1e3 * stock.foot[0]:.0f} mm; check them against the arm"
    )
    nearest = float(np.hypot(*places[:, :2].T).min())
    close = f"; a stand-off's axis is {1e3 * nearest:.0f} mm from axis 1" if nearest < stock.foot[0] else ""
    return Slab(size=size, bores=tuple(bores), name="bottom"), post, (note + close,)
