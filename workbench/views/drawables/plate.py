"""The fixture: its solid, and the numbered target blocks; the region of interest and its cubes."""

from collections.abc import Iterator
from functools import partial

import numpy as np

from workbench.base.types import Matrix4
from workbench.plate.optimiser.target_blocks import SIDE
from workbench.plate.plate import Target
from workbench.session.cube_fields import are_shown, drawn_field, inputs, shown_cubes
from workbench.session.state import NO_FIELD, Session
from workbench.session.target_postures import TargetState
from workbench.views.appearance import colours
from workbench.views.appearance.shapes import box, target_block
from workbench.views.drawables.drawable import Colour, Cubes, Cuboid, Label, Mesh
from workbench.views.drawables.sink import Item


def plate(session: Session) -> Iterator[Item]:
    """Blocks: sand where reached, blue where selected, brown where blocked, red where out of reach."""
    fixture = session.plate
    if fixture.size is not None:
        solid = lambda size, pose: Mesh(solid=box(size), colour=colours.PLATE, flat=True, pose=pose)  # noqa: E731
        yield Item("plate/solid", solid, (fixture.size, fixture.pose), shown=session.shows_plate)
    for i, (target, state) in enumerate(zip(fixture.targets, session.states, strict=True)):
        path, colour = f"plate/targets/{i + 1}", target_colour(state, selected=i == session.selected)
        yield Item(path, _block, (target, fixture.pose, colour, i), shown=session.shows_plate)
        yield Item(f"{path}/number", _number, (i, target), shown=session.shows_plate)


def _block(target: Target, plate: Matrix4, ink: Colour, number: int) -> Mesh:
    return Mesh(solid=target_block(target.pose, plate), colour=ink, flat=True, number=number)


def _number(i: int, target: Target) -> Label:
    text = f"{i + 1} (locked)" if target.locked else f"{i + 1}"
    return Label(text=text, place=target.xyz + np.array([0.0, 0.0, 0.75 * SIDE]))


def target_colour(state: TargetState, *, selected: bool) -> tuple[int, int, int]:
    """Colour of a target by its state; trouble shows even where it is selected."""
    if not state.reached:
        return colours.OUT_OF_REACH
    if state.hit:
        return colours.BLOCKED
    return colours.SELECTED if selected else colours.REACHED


def region(session: Session) -> Iterator[Item]:
    """Cubes may wait during a drag: their numbers change with every step, and those in the panel go first."""
    view, cuboid = session.region.view, session.plate.region
    is_seen = session.shows_plate or are_shown(session)
    yield Item("region/outline", Cuboid, (cuboid.min, cuboid.max, colours.REGION), shown=is_seen)
    if view.field != NO_FIELD:
        read = (view, cuboid, *inputs(session), session.history.first.plate, session.drag)
        is_dragged = session.drag is not None
        cubes = partial(_cubes, session)
        yield Item("region/cubes", cubes, read, shown=are_shown(session), can_wait=is_dragged)


def grid(session: Session) -> Iterator[Item]:
    """The cubes' edges on the sides of a region that is cut, on the page alone; a drag needs their time."""
    view, cuboid = session.region.view, session.plate.region
    is_cut = are_shown(session) and view.cut is not None and session.drag is None
    yield Item("region/grid", Cuboid, (cuboid.min, cuboid.max, colours.GHOST, cuboid.shape), shown=is_cut)


def _cubes(session: Session, *_: object) -> Cubes | None:
    """What the field and `shown_cubes` read of the session are the item's inputs."""
    view, field = session.region.view, drawn_field(session)
    numbers = None if field is None else field.values(session)
    shown = np.zeros(0) if numbers is None else shown_cubes(session, view, numbers)
    if field is None or numbers is None or not shown.any():
        return None
    shares, is_unknown = np.nan_to_num(numbers.shares), np.isnan(numbers.numbers)
    inks = colours.scale_colours(shares if field.larger_is_better else 1.0 - shares)  # from bad to good
    inks[is_unknown] = colours.NO_VALUE
    inks[np.isinf(numbers.numbers)] = colours.UNBOUNDED
    return Cubes(region=session.plate.region, shown=shown, known=~is_unknown, colours=inks)
