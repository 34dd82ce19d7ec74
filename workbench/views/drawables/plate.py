"""The fixture: its solid, and the numbered target blocks."""

from collections.abc import Iterator

import numpy as np

from workbench.base.types import Matrix4
from workbench.plate.optimiser.target_blocks import SIDE
from workbench.plate.plate import Target
from workbench.session.state import Session
from workbench.session.target_postures import TargetState
from workbench.views.appearance.colours import BLOCKED, OUT_OF_REACH, PLATE, REACHED, SELECTED
from workbench.views.appearance.shapes import box, target_block
from workbench.views.drawables.drawable import Colour, Label, Mesh
from workbench.views.drawables.sink import Item


def plate(session: Session) -> Iterator[Item]:
    """Blocks: sand where reached, blue where selected, brown where blocked, red where out of reach."""
    fixture = session.plate
    if fixture.size is not None:
        solid = lambda size, pose: Mesh(solid=box(size), colour=PLATE, flat=True, pose=pose)  # noqa: E731
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
        return OUT_OF_REACH
    if state.hit:
        return BLOCKED
    return SELECTED if selected else REACHED
