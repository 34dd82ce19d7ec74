"""`world/region`: the cuboid that matters, and the field of its cubes as the page shows it."""

import numpy as np
import rerun as rr

from workbench.session import cubes
from workbench.views.appearance.colours import (
    BLOCKED,
    OUT_OF_REACH,
    REACHED,
    REGION,
)
from workbench.views.recording.canvas import Canvas
from workbench.views.recording.entities.entity import AbstractEntity, Moment

SMALL = 0.12
"""Radius of a cube's mark, as a share of its side."""


class RegionOutline(AbstractEntity):
    """`world/region/outline`."""

    def __init__(self) -> None:
        self._drawn: object = None

    def draw(self, canvas: Canvas, moment: Moment) -> None:
        region = moment.session.plate.region
        if region is not self._drawn:
            self._drawn = region
            box = rr.Boxes3D(
                centers=[0.5 * (region.min + region.max)],
                sizes=[region.size],
                colors=REGION,
                fill_mode=rr.components.FillMode.MajorWireframe,
            )
            canvas.log("world/region/outline", box)


class Cubes(AbstractEntity):
    """`world/region/cubes`: a mark in the centre of every cube that is shown, green where it is good."""

    def __init__(self) -> None:
        self._drawn: bytes = b""

    def draw(self, canvas: Canvas, moment: Moment) -> None:
        session = moment.session
        numbers = None if session.drag is not None else cubes.values(session)
        if session.drag is not None:
            return
        if numbers is None:
            if self._drawn:
                canvas.clear("world/region/cubes")
            self._drawn = b""
            return
        keep = cubes.seen(session, session.cube_view, numbers) & ~np.isnan(numbers.shares)
        bad = numbers.shares[keep]
        bad = 1.0 - bad if session.cube_view.field in cubes.LARGER_IS_BETTER else bad
        region = session.plate.region
        colours, places = _colours(bad), region.centres[keep]
        if self._drawn != (key := colours.tobytes() + places.tobytes()):
            self._drawn = key
            canvas.log("world/region/cubes", rr.Points3D(places, colors=colours, radii=SMALL * region.cube))


def _colours(bad: np.ndarray) -> np.ndarray:
    """Green, amber, red for 0, ½, 1."""
    stops = np.array([REACHED, BLOCKED, OUT_OF_REACH], float)
    place = 2.0 * np.clip(bad, 0.0, 1.0)
    return np.stack([np.interp(place, [0.0, 1.0, 2.0], stops[:, k]) for k in range(3)], -1).astype(np.uint8)
