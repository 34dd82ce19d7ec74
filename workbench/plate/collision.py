"""Collisions of the arm at the targets of a plate: a blocked target is not measurable.

This is the fast check for dragging, without margins: capsules along the arm's links, as in the optimiser for
arms without meshes, against the plate's solid and the drawn blocks. The last link, which carries the probe,
and the visited block are ignored, since the probe may be unknown. Targets that are clear in the optimiser are
clear here too.
"""

from collections.abc import Iterable, Sequence
from functools import lru_cache

import numpy as np
from jaxtyping import Bool, Float

from workbench.arm.inverse.branch import Branch
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.plate.optimiser.capsules import capsule_arm
from workbench.plate.optimiser.shapes import ArmShape, Collider, Placements, block_hulls, plate_hull
from workbench.plate.plate import Plate
from workbench.plate.poses.sampling import in_base

CONTACT = 1e-6
"""Bodies closer than this are in contact [m]."""
shape_of = lru_cache(maxsize=4)(capsule_arm)
"""The arm's capsules."""


def hits(
    robot: Robot, plate: Plate, visited: Sequence[int], q: Float[np.ndarray, "rows n"]
) -> tuple[str, ...]:
    """What the arm would collide with in each posture, and with which link, as text; empty where it is clear.

    Args:
        plate: Its solid and the blocks of its targets; without a solid there are no obstacles.
        visited: Target visited in each posture, counted from 0.
        q: Postures [rad or m].
    """
    if plate.size is None or not len(q):
        return ("",) * len(q)
    shape, found = shape_of(robot), [""] * len(q)
    own, at = "target" if plate.anchors is None else "anchor", shape.placements(q)
    for target in {*visited}:
        others = [i for i in range(len(plate.mounted)) if i != target or plate.anchors is not None]
        bodies, rows = bodies_of(plate, others), np.flatnonzero(np.equal(visited, target))
        for row, met in zip(rows, touches(shape, at[rows], bodies), strict=True):
            if met.any():
                first = int(met.argmax())
                what = f"the block of {own} {others[first - 1] + 1}" if first else "the plate"
                found[row] = f"link {_link(shape, at[[row]], bodies[first])} would run into {what}"
    return tuple(found)


def solid_clear(robot: Robot, plate: Plate, q: Float[np.ndarray, "rows n"]) -> Bool[np.ndarray, " rows"]:
    """Which postures are free of collisions with the plate's solid, whatever blocks it has."""
    if plate.size is None:
        return np.ones(len(q), bool)
    shape, alone = shape_of(robot), bodies_of(plate)[:1]
    return np.asarray(~touches(shape, shape.placements(q), alone)[:, 0])


def unobstructed(robot: Robot, plate: Plate, target: int, branches: Sequence[Branch]) -> tuple[Branch, ...]:
    """Collision-free branches to a target, counted from 0."""
    if not branches:
        return ()
    found = hits(robot, plate, [target] * len(branches), np.stack([branch.q for branch in branches]))
    return tuple(branch for branch, hit in zip(branches, found, strict=True) if not hit)


def allows_target(
    robot: Robot, plate: Plate, postures: Float[np.ndarray, "targets n"], q: Float[np.ndarray, "rows n"]
) -> Bool[np.ndarray, " rows"]:
    """At which postures a further target of the plate could be measured.

    Its block must lie on the plate, the arm must be free of collisions there, and in no other posture touch
    that block. A plate without a solid has no obstacles.

    Args:
        plate: Its solid and the blocks of its targets.
        postures: How the arm stands at those targets [rad or m].
        q: Postures [rad or m].
    """
    if plate.size is None or not len(q):
        return np.ones(len(q), bool)
    poses = in_base(robot, q)
    x, y, height = np.moveaxis((se3.inverse(plate.pose) @ poses)[:, :3, 3], -1, 0)
    fine = (np.abs(x) <= 0.5 * plate.size[0]) & (np.abs(y) <= 0.5 * plate.size[1]) & (height >= 0.0)
    shape = shape_of(robot)
    rows = np.flatnonzero(fine)
    if len(rows):
        fine[rows] = ~touches(shape, shape.placements(q[rows]), bodies_of(plate)).any(1)
    rows = np.flatnonzero(fine)
    if len(rows) and len(postures):
        blocks = block_hulls(plate.pose, poses[rows])
        fine[rows] = ~touches(shape, shape.placements(postures), blocks).any(0)
    return fine


def mutually_blocking(
    robot: Robot, plate: Plate, q: Float[np.ndarray, "rows n"]
) -> Bool[np.ndarray, "rows rows"]:
    """Which postures can't both be targets of the plate, as the arm in one collides with the block of the
    other.

    Args:
        plate: Its solid; its targets are ignored.
        q: Postures [rad or m].
    """
    if plate.size is None or plate.anchors is not None:
        return np.zeros((len(q), len(q)), bool)
    shape, blocks = shape_of(robot), block_hulls(plate.pose, in_base(robot, q))
    met = touches(shape, shape.placements(q), blocks)
    np.fill_diagonal(met, False)
    return np.asarray(met | met.T)


def touches(shape: ArmShape, at: Placements, hulls: Sequence[Collider]) -> Bool[np.ndarray, "rows hulls"]:
    """Which static bodies each posture collides with."""
    rows, count = len(at), len(hulls)
    gaps = shape.hull_distances(
        np.repeat(at, count, axis=0),
        list(hulls) * rows,
        checked=shape.bodies < shape.robot.dof,
        far=CONTACT,
        minimum=CONTACT,
    )
    return (gaps < CONTACT).reshape(rows, count)


def bodies_of(plate: Plate, blocks_of: Iterable[int] | None = None) -> list[Collider]:
    """The plate's solid, then the blocks of all or some of its targets, robot's base."""
    assert plate.size is not None
    place, chosen = plate.pose.tobytes(), range(len(plate.mounted)) if blocks_of is None else blocks_of
    blocks = [_block(place, plate.mounted[i].pose.tobytes()) for i in chosen]
    return [_slab(place, plate.size.tobytes()), *blocks]


@lru_cache(maxsize=16)
def _slab(place: bytes, size: bytes) -> Collider:
    return plate_hull(np.frombuffer(place).reshape(4, 4), np.frombuffer(size))


@lru_cache(maxsize=256)
def _block(place: bytes, pose: bytes) -> Collider:
    """A block, cached: while one target is dragged the others stay."""
    return block_hulls(np.frombuffer(place).reshape(4, 4), np.frombuffer(pose).reshape(1, 4, 4))[0]


def _link(shape: ArmShape, at: Placements, hull: Collider) -> int:
    """The first link that collides with a body: k is the link after joint k, 0 the base."""
    links = range(shape.robot.dof)
    gaps = (shape.hull_distances(at, [hull], checked=shape.bodies == k, far=CONTACT)[0] for k in links)
    return next((k for k, gap in zip(links, gaps, strict=True) if gap < CONTACT), shape.robot.dof - 1)
