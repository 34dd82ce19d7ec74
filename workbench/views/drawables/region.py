"""The region of interest, its cubes, and the arm's reach at the height of a dragged target."""

from collections.abc import Iterator
from functools import partial

import numpy as np

from workbench.arm.kinematics.envelope import ring_at
from workbench.arm.robot import Robot
from workbench.session.cube_fields import CubeField, CubeValues, are_shown, drawn_field, inputs, shown_cubes
from workbench.session.state import NO_FIELD, Session
from workbench.views.appearance.colours import GHOST, GHOST_DARK, NO_VALUE, REGION, UNBOUNDED, scale_colours
from workbench.views.drawables.drawable import Cubes, Cuboid, Label, Line
from workbench.views.drawables.sink import Item


def region(session: Session) -> Iterator[Item]:
    """Cubes may wait during a drag: their numbers change with every step, and those in the panel go first."""
    view, cuboid = session.region.view, session.plate.region
    is_seen = session.shows_plate or are_shown(session)
    yield Item("region/outline", Cuboid, (cuboid.min, cuboid.max, REGION), shown=is_seen)
    if view.field != NO_FIELD:
        read = (view, cuboid, *inputs(session), session.history.first.plate, session.drag)
        is_dragged = session.drag is not None
        cubes = partial(_cubes, session)
        yield Item("region/cubes", cubes, read, shown=are_shown(session), can_wait=is_dragged)


def grid(session: Session) -> Iterator[Item]:
    """The cubes' edges on the sides of a region that is cut, on the page alone; a drag needs their time."""
    view, cuboid = session.region.view, session.plate.region
    is_cut = are_shown(session) and view.cut is not None and session.drag is None
    ghost = GHOST_DARK if session.page.is_dark else GHOST
    yield Item("region/grid", Cuboid, (cuboid.min, cuboid.max, ghost, cuboid.shape), shown=is_cut)


def _cubes(session: Session, *_: object) -> Cubes | None:
    """What the field and `shown_cubes` read of the session are the item's inputs."""
    view, field = session.region.view, drawn_field(session)
    numbers = None if field is None else field.values(session)
    shown = np.zeros(0) if numbers is None else shown_cubes(session, view, numbers)
    if field is None or numbers is None or not shown.any():
        return None
    return Cubes(
        region=session.plate.region,
        shown=shown,
        known=~np.isnan(numbers.numbers),
        colours=_colours(field, numbers),
        picked=view.picked,
    )


def _colours(field: CubeField, numbers: CubeValues) -> np.ndarray:
    """Colour of every cube: from bad to good; grey where there is no number, dark red where unbounded."""
    shares = np.nan_to_num(numbers.shares)
    colours = scale_colours(shares if field.larger_is_better else 1.0 - shares)
    colours[np.isnan(numbers.numbers)] = NO_VALUE
    colours[np.isinf(numbers.numbers)] = UNBOUNDED
    return colours


LAYER, DIRECTION = 0.04, 0.2
"""Steps of height [m] and of direction [rad] in which it is drawn, so that a drag draws few of them."""


def envelope(session: Session) -> Iterator[Item]:
    """A ring at the height of the dragged target, as far out as the tool comes in any orientation."""
    if session.drag is not None:
        at = session.plate.targets[session.drag.target].xyz
        height = LAYER * round(float(at[2]) / LAYER)
        yield Item("reach/envelope", _ring, (session.robot, height))
        turn = DIRECTION * round(float(np.arctan2(at[1], at[0])) / DIRECTION)
        yield Item("reach/words", _label, (session.robot, height, turn))


def _ring(robot: Robot, height: float) -> Line | None:
    places = ring_at(robot, height)
    return Line(places=places, colours=np.array([REGION], np.uint8), pixels=2.5) if len(places) > 1 else None


def _label(robot: Robot, height: float, turn: float) -> Label | None:
    """Where the ring is nearest to the target."""
    places = ring_at(robot, height)
    if len(places) < 2:
        return None
    off = np.angle(np.exp(1j * (np.arctan2(places[:, 1], places[:, 0]) - turn)))
    return Label(text="reach", place=places[int(np.argmin(np.abs(off)))])
