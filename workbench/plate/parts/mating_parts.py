"""The parts beside plate and blocks: the probe that the arm carries, and what ties the plate to the robot.

The probe is a cylinder on the arm's flange (ISO 9409-1-50-4-M6) with two dowel pins in its face: one at the
centre for the seat and one on the tool's x axis for the index hole (ARIA Fig. 6). Its z axis is the tool's.
The bottom plate lies in the plane of the robot's foot, z = 0 of its base, and carries plate and robot: holes
for the foot's screws about the base's z axis, and four for the stand-offs under the plate's mounting holes.
"""

import numpy as np

from workbench.base import se3
from workbench.base.types import Matrix4, Vector3
from workbench.plate.parts.parts import Bore, Purpose, Slab, Turned
from workbench.plate.parts.stock import DOWN, UP, Stock

DEPTHS = (0.012, 0.010)
"""How deep the probe's pins are pressed in, seat and index [m]."""
FLANGE = 0.008
"""Thickness of the probe's flange [m]."""
LEVEL = 1e-6
"""A plate leans if its normal is off the vertical by more [rad]."""
SHORTEST = 0.025
"""Least length of a stand-off: two threads and a wall [m]."""
RIM = 0.03
"""Material of the bottom plate around its holes [m]."""


def _bore(
    label: str, purpose: Purpose, mouth, direction: Vector3, sizes: tuple[float, float], through=False
) -> Bore:
    diameter, depth = sizes
    place = np.asarray(mouth, float)
    return Bore(
        label=label,
        purpose=purpose,
        mouth=place,
        direction=direction,
        diameter=diameter,
        depth=depth,
        through=through,
    )


def _circle(diameter: float) -> np.ndarray:
    """Four points at 45°, 135° … on a circle."""
    angles = np.deg2rad([45.0, 135.0, 225.0, 315.0])
    return 0.5 * diameter * np.column_stack([np.cos(angles), np.sin(angles), np.zeros(4)])


def probe_of(stock: Stock) -> Turned:
    """The probe; its face, at z = its length, rests on the block's."""
    face = np.array([0.0, 0.0, stock.probe])
    index = np.array([stock.index_offset, 0.0, stock.probe])
    return _probe(
        stock,
        stock.neck,
        _bore("P1", Purpose.PIN, face, DOWN, (stock.seat, DEPTHS[0])),
        _bore("P2", Purpose.PIN, index, DOWN, (stock.index, DEPTHS[1])),
    )


def ball_probe_of(stock: Stock) -> Turned:
    """The probe with a cone for a ball, whose centre, the tool's origin, lies ¼ diameter over its face."""
    face = np.array([0.0, 0.0, stock.probe])
    cone = [_bore("P1", Purpose.SOCKET, face, DOWN, stock.cone)]
    if stock.magnet is not None:
        cone.append(_bore("P2", Purpose.MAGNET, face, DOWN, stock.magnet))
    return _probe(stock, 1.5 * stock.ball, *cone)


def _probe(stock: Stock, neck: float, *tip: Bore) -> Turned:
    """A neck on the arm's flange, with what its face needs."""
    flange, circle, hole = stock.flange
    screws = [
        _bore(f"F{i}", Purpose.FLANGE, place, UP, (hole, FLANGE), through=True)
        for i, place in enumerate(_circle(circle), start=1)
    ]
    steps = ((flange, FLANGE), (neck, stock.probe - FLANGE))
    return Turned(name="probe", steps=steps, bores=(*tip, *screws))


def base_parts(pose: Matrix4, slab: Slab, stock: Stock) -> tuple[Slab | None, Turned | None, tuple[str, ...]]:
    """Bottom plate and stand-off, or why there are none.

    Args:
        pose: Of the plate's top centre in the robot's base.
        slab: The plate with its mounting holes.
    """
    lean = float(np.arccos(np.clip(pose[2, 2], -1.0, 1.0)))
    height = float(pose[2, 3] - slab.size[2])
    mounts = [bore for bore in slab.bores if bore.purpose is Purpose.MOUNTING]
    if lean > LEVEL or height < SHORTEST or len(mounts) < 3:
        why = (
            f"the plate leans by {np.rad2deg(lean):.2f}°"
            if lean > LEVEL
            else f"the plate's underside is {1e3 * height:.0f} mm above the robot's foot, a stand-off needs "
            f"{1e3 * SHORTEST:.0f} mm"
            if height < SHORTEST
            else f"the plate has {len(mounts)} mounting holes"
        )
        return None, None, (f"{why}: no bottom plate and stand-offs are drawn to tie it to the robot",)
    places = np.array([se3.apply(pose, bore.mouth) for bore in mounts]) * [1.0, 1.0, 0.0]
    foot = _circle(stock.foot[0])
    reach = np.concatenate([places, foot])[:, :2]
    low, high = reach.min(axis=0) - RIM, reach.max(axis=0) + RIM
    low, high = np.floor(200.0 * low) / 200.0, np.ceil(200.0 * high) / 200.0
    middle = np.array([*(0.5 * (low + high)), 0.0])
    size = np.array([*(high - low), stock.bottom])
    bores = [
        _bore(f"S{i}", Purpose.STANDOFF, place - middle, DOWN, (stock.mounting, stock.bottom), through=True)
        for i, place in enumerate(places, start=1)
    ]
    bores += [
        _bore(f"R{i}", Purpose.ROBOT, place - middle, DOWN, (stock.foot[1], stock.bottom), through=True)
        for i, place in enumerate(foot, start=1)
    ]
    diameter, core, depth = stock.post
    depth = min(depth, 0.5 * height - 0.002)
    threads = (
        _bore("T1", Purpose.THREAD, [0.0, 0.0, 0.0], UP, (core, depth)),
        _bore("T2", Purpose.THREAD, [0.0, 0.0, height], DOWN, (core, depth)),
    )
    post = Turned(name="stand-off", steps=((diameter, height),), bores=threads, quantity=len(mounts))
    note = (
        f"the bottom plate's holes R1–R4 are for a robot's foot with screws on a circle of "
        f"{1e3 * stock.foot[0]:.0f} mm; check them against the arm"
    )
    nearest = float(np.hypot(*places[:, :2].T).min())
    close = (
        f"; a stand-off's axis is {1e3 * nearest:.0f} mm from the arm's" if nearest < stock.foot[0] else ""
    )
    return Slab(size=size, bores=tuple(bores), name="bottom"), post, (note + close,)
