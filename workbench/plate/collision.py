"""Collisions of the arm at the targets of a plate: a blocked target is not measurable.

This is the fast check for dragging, without margins: capsules along the arm's links, as in the optimiser for
arms without meshes, against the table, the plate's solid and the drawn blocks. The last link, which carries
the probe, and the visited block are ignored, since the probe may be unknown. Targets that are clear in the
optimiser are clear here too.
"""

from collections.abc import Iterable, Sequence
from functools import lru_cache

import numpy as np
from jaxtyping import Bool, Float

from workbench.arm.inverse.branch import Branch
from workbench.arm.kinematics.skeleton import height_above_floor
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.plate.optimiser.capsules import capsule_arm
from workbench.plate.optimiser.constraints import Constraints
from workbench.plate.optimiser.shapes import ON_THE_TABLE, ArmShape, Collider, below, block_hulls, plate_hull
from workbench.plate.plate import Plate
from workbench.plate.poses.sampling import in_base

CONTACT = 1e-6
"""Bodies closer than this are in contact [m]."""
shape_of = lru_cache(maxsize=4)(capsule_arm)
"""The arm's capsules."""
POSTURES = 50
"""Of an arm, one of which is clear of its table."""


@lru_cache(maxsize=4)
def table_height(robot: Robot) -> float | None:
    """Height of the table under an arm; None where links are always below it: the base is in the shoulder."""
    table, shape = -height_above_floor(robot), shape_of(robot)
    low, high = np.clip(robot.limits.T, -np.pi, np.pi)
    q = np.random.default_rng(0).uniform(low, high, (POSTURES, robot.dof))
    heights = shape.lowest(shape.placements(q))[:, shape.bodies > ON_THE_TABLE]
    return table if heights.min(1, initial=np.inf).max() - table >= Constraints().clearance else None


def obstacles(robot: Robot, plate: Plate, blocks_of: Iterable[int] | None = None) -> dict[str, Collider]:
    """What an arm can run into, by name: the plate's solid, the blocks of all or some of its targets, the
    table if none of them lies below it; nothing without a solid."""
    if plate.size is None:
        return {}
    place, chosen = plate.pose.tobytes(), range(len(plate)) if blocks_of is None else blocks_of
    blocks = {f"the block of target {i + 1}": _block(place, plate.targets[i].pose.tobytes()) for i in chosen}
    lowest, height = min([plate.xyz[2], *(t.xyz[2] for t in plate.targets)]), table_height(robot)
    table = {} if height is None or lowest < height else {"the table": below(height)}
    return {"the plate": _slab(place, plate.size.tobytes()), **blocks, **table}


def hits(
    robot: Robot, plate: Plate, visited: Sequence[int], q: Float[np.ndarray, "rows n"]
) -> tuple[str, ...]:
    """What the arm would collide with in each posture, and with which link, as text; empty where it is clear.

    Args:
        plate: Its solid and the blocks of its targets.
        visited: Target visited in each posture, counted from 0.
        q: Postures [rad or m].
    """
    found = [""] * len(q)
    for target in {*visited}:
        others = [i for i in range(len(plate)) if i != target]
        bodies, rows = obstacles(robot, plate, others), np.flatnonzero(np.equal(visited, target))
        for row, met in zip(rows, touches(robot, q[rows], [*bodies.values()]), strict=True):
            if met.any():
                what = [*bodies][int(met.argmax())]
                found[row] = f"link {_link(robot, q[[row]], bodies[what])} would run into {what}"
    return tuple(found)


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
    fine[fine] = ~touches(robot, q[fine], [*obstacles(robot, plate).values()]).any(1)
    fine[fine] = ~touches(robot, postures, block_hulls(plate.pose, poses[fine])).any(0)
    return fine


def touches(
    robot: Robot, q: Float[np.ndarray, "rows n"], hulls: Sequence[Collider]
) -> Bool[np.ndarray, "rows hulls"]:
    """Which static bodies the arm collides with in each posture."""
    shape, rows, count = shape_of(robot), len(q), len(hulls)
    if not rows or not count:
        return np.zeros((rows, count), bool)
    placements = np.repeat(shape.placements(q), count, axis=0)
    checked = np.tile([_checked(shape, hull) for hull in hulls], (rows, 1))
    gaps = shape.hull_distances(placements, list(hulls) * rows, checked=checked, minimum=CONTACT)
    return (gaps < CONTACT).reshape(rows, count)


@lru_cache(maxsize=16)
def _slab(place: bytes, size: bytes) -> Collider:
    return plate_hull(np.frombuffer(place).reshape(4, 4), np.frombuffer(size))


@lru_cache(maxsize=256)
def _block(place: bytes, pose: bytes) -> Collider:
    """A block, cached: while one target is dragged the others stay."""
    return block_hulls(np.frombuffer(place).reshape(4, 4), np.frombuffer(pose).reshape(1, 4, 4))[0]


def _checked(shape: ArmShape, hull: Collider) -> Bool[np.ndarray, " pieces"]:
    """The pieces that must not touch a body; the last link's may, with the probe."""
    return shape.kept_from(hull) & (shape.bodies < shape.robot.dof)


def _link(robot: Robot, q: Float[np.ndarray, "1 n"], hull: Collider) -> int:
    """The first link that collides with a body: k is the link after joint k, 0 the base."""
    shape = shape_of(robot)
    links, at = {*shape.bodies[_checked(shape, hull)].tolist()}, shape.placements(q)
    gaps = ((k, shape.hull_distances(at, [hull], checked=shape.bodies == k)[0]) for k in links)
    return next((k for k, gap in gaps if gap < CONTACT), robot.dof - 1)
