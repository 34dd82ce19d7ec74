"""`world/plate`: its solid, a block and a number for every target, and the way of each dragged target."""

import numpy as np
import rerun as rr

from workbench.plate.plate import Plate
from workbench.session.commands.drag import DropTarget, MoveTarget
from workbench.views.appearance.colours import PLATE, REACHED
from workbench.views.appearance.shapes import SIDE, box, target_block
from workbench.views.drawables.plate import target_colour
from workbench.views.recording.canvas import Canvas
from workbench.views.recording.entities.entity import AbstractEntity, Moment
from workbench.views.recording.shapes import mesh

LABEL = (241, 245, 249)
DRAGS = (MoveTarget, DropTarget)
LONGEST = 64
"""Places that a trail keeps; of more, evenly chosen ones."""


class PlateSolid(AbstractEntity):
    """`world/plate/solid`."""

    def __init__(self) -> None:
        self._drawn: object = ...

    def draw(self, canvas: Canvas, moment: Moment) -> None:
        plate = moment.session.plate
        if self._drawn == (key := (_bytes(plate.size), plate.pose.tobytes())):
            return
        self._drawn = key
        if plate.size is None:
            canvas.clear("world/plate/solid")
        else:
            canvas.log("world/plate/solid", mesh(box(plate.size).moved(plate.pose), PLATE, flat=True))


class Targets(AbstractEntity):
    """`world/plate/targets/N`: blocks, green where reached, blue where selected, red where out of reach."""

    def __init__(self) -> None:
        self._drawn: dict[int, tuple[tuple, tuple]] = {}

    def draw(self, canvas: Canvas, moment: Moment) -> None:
        session = moment.session
        for i, (target, state) in enumerate(zip(session.plate.targets, session.states, strict=True)):
            colour = target_colour(state, selected=i == session.selected)
            place = (target.pose.tobytes(), session.plate.pose.tobytes())
            path, (placed, coloured) = f"world/plate/targets/{i + 1}", self._drawn.get(i, (None, None))
            self._drawn[i] = (place, colour)
            if placed != place:
                canvas.log(path, mesh(target_block(target.pose, session.plate.pose), colour, flat=True))
                self._number(canvas, i, target.xyz, is_new=placed is None)
            elif coloured != colour:
                canvas.log(path, rr.Mesh3D.from_fields(albedo_factor=colour))
        for i in [i for i in self._drawn if i >= len(session.plate)]:
            del self._drawn[i]
            canvas.clear(f"world/plate/targets/{i + 1}")

    def _number(self, canvas: Canvas, i: int, xyz: np.ndarray, *, is_new: bool) -> None:
        """The number above a block; once it is there only its place is drawn."""
        place, path = [xyz + np.array([0.0, 0.0, 0.75 * SIDE])], f"world/plate/targets/{i + 1}/number"
        if is_new:
            canvas.log(path, rr.Points3D(place, radii=1e-4, colors=LABEL, labels=[f"{i + 1}"]))
        else:
            canvas.log(path, rr.Points3D.from_fields(positions=place))


class Trails(AbstractEntity):
    """`world/plate/trails/N`: where a target has been dragged; what else puts it elsewhere begins anew."""

    def __init__(self) -> None:
        self._ways: list[list[np.ndarray]] = []
        self._plate: Plate | None = None
        self._drawn: dict[int, int] = {}

    def draw(self, canvas: Canvas, moment: Moment) -> None:
        session = moment.session
        if session.first_plate is not self._plate or len(self._ways) != len(session.plate):
            self._plate, self._drawn = session.first_plate, {}
            self._ways = [[] for _ in session.plate.targets]
            canvas.clear("world/plate/trails")
        is_drag = moment.entry is not None and isinstance(moment.entry.command, DRAGS)
        for i, (way, target) in enumerate(zip(self._ways, session.plate.targets, strict=True)):
            if not way or not np.array_equal(way[-1], target.xyz):
                if not is_drag:
                    self._forget(canvas, i, way)
                way.append(target.xyz)
                if len(way) > 2 * LONGEST:
                    del way[1:-1:2]
        if session.drag is None:
            for i, way in enumerate(self._ways):
                self._show(canvas, i, way)

    def _forget(self, canvas: Canvas, i: int, way: list[np.ndarray]) -> None:
        way.clear()
        if self._drawn.pop(i, None) is not None:
            canvas.clear(f"world/plate/trails/{i + 1}")

    def _show(self, canvas: Canvas, i: int, way: list[np.ndarray]) -> None:
        if len(way) > 1 and self._drawn.get(i) != id(way[-1]):
            self._drawn[i] = id(way[-1])
            chosen = np.unique(np.linspace(0, len(way) - 1, LONGEST).round().astype(int))
            strip = np.array([way[k] for k in chosen])
            canvas.log(f"world/plate/trails/{i + 1}", rr.LineStrips3D([strip], colors=REACHED, radii=0.0015))


def _bytes(array: np.ndarray | None) -> bytes:
    return b"" if array is None else array.tobytes()
