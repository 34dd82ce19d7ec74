"""The fixture: its solid, and the numbered target blocks."""

from collections.abc import Iterator

import numpy as np

from workbench.base.types import Matrix4, Vector3
from workbench.plate.optimiser.target_blocks import SIDE
from workbench.plate.plate import Target
from workbench.session.state import Focus, Session
from workbench.session.target_state import TargetState
from workbench.views.appearance.colours import BLOCKED, BRANCH, OUT_OF_REACH, PLATE, REACHED, SELECTED
from workbench.views.appearance.shapes import box, target_block
from workbench.views.drawables.drawable import Colour, Label, Mesh
from workbench.views.drawables.sink import Item


def plate(session: Session) -> Iterator[Item]:
    """Blocks: sand where reached, blue where selected, brown where blocked, red where out of reach."""
    fixture = session.plate
    if fixture.size is not None:
        yield Item("plate/solid", _solid, (fixture.size, fixture.pose), shown=session.shows_plate)
    for i, (target, state) in enumerate(zip(fixture.targets, session.states, strict=True)):
        path, colour = f"plate/targets/{i + 1}", target_colour(state, selected=i == session.selected)
        yield Item(path, _block, (target, fixture.pose, colour, i), shown=session.shows_plate)
        yield Item(f"{path}/number", _number, (i, target), shown=session.shows_plate)


def plate_before(session: Session) -> Iterator[Item]:
    """Grey blocks at the targets' positions before the last step or before the current drag.

    None after another robot or plate was opened, whose last step was on another plate, or after a search that
    placed most of them anew: so many would hide the plate.
    """
    done = session.history.done
    if not done or session.playback.focus is not Focus.TARGET or done[-1].session is not None:
        return
    before, now = done[-1].plate, session.plate.targets
    moved = [
        (i, target)
        for i, target in enumerate(before.targets)
        if i >= len(now) or (now[i] is not target and not np.allclose(now[i].pose, target.pose))
    ]
    for i, target in moved if 2 * len(moved) <= len(before) else ():
        yield Item(f"plate/before/{i + 1}", _block, (target, before.pose, BRANCH, None, 0.35))


def _solid(size: Vector3, pose: Matrix4) -> Mesh:
    return Mesh(solid=box(size), colour=PLATE, flat=True, pose=pose)


def _block(target: Target, plate: Matrix4, ink: Colour, number: int | None, opacity: float = 1.0) -> Mesh:
    solid = target_block(target.pose, plate)
    return Mesh(solid=solid, colour=ink, opacity=opacity, flat=True, number=number)


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
