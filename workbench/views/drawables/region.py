"""The region of interest and its cubes."""

from collections.abc import Iterator
from functools import partial

import numpy as np

from workbench.session.cube_fields import are_shown, drawn_field, inputs, shown_cubes
from workbench.session.state import NO_FIELD, Session
from workbench.views.appearance.colours import GHOST, NO_VALUE, REGION, UNBOUNDED, scale_colours
from workbench.views.drawables.drawable import Cubes, Cuboid
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
    yield Item("region/grid", Cuboid, (cuboid.min, cuboid.max, GHOST, cuboid.shape), shown=is_cut)


def _cubes(session: Session, *_: object) -> Cubes | None:
    """What the field and `shown_cubes` read of the session are the item's inputs."""
    view, field = session.region.view, drawn_field(session)
    numbers = None if field is None else field.values(session)
    shown = np.zeros(0) if numbers is None else shown_cubes(session, view, numbers)
    if field is None or numbers is None or not shown.any():
        return None
    shares, is_unknown = np.nan_to_num(numbers.shares), np.isnan(numbers.numbers)
    colours = scale_colours(shares if field.larger_is_better else 1.0 - shares)  # from bad to good
    colours[is_unknown] = NO_VALUE
    colours[np.isinf(numbers.numbers)] = UNBOUNDED
    return Cubes(region=session.plate.region, shown=shown, known=~is_unknown, colours=colours)
