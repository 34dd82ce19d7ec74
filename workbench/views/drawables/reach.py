"""How far the arm reaches at the height of the target that is dragged."""

from collections.abc import Iterator

import numpy as np

from workbench.arm.kinematics.envelope import ring_at
from workbench.arm.robot import Robot
from workbench.session.state import Session
from workbench.views.appearance.colours import REGION
from workbench.views.drawables.drawable import Label, Line
from workbench.views.drawables.item import Item

LAYER, DIRECTION = 0.04, 0.2
"""Steps of height [m] and of direction [rad] in which it is drawn, so that a drag draws few of them."""


def envelope(session: Session) -> Iterator[Item]:
    """A ring at the height of the dragged target, as far out as the tool comes in any orientation."""
    if session.drag is not None:
        at = session.plate.targets[session.drag.target].xyz
        height = LAYER * round(float(at[2]) / LAYER)
        yield Item("reach/envelope", _ring, (session.robot, height))
        turn = DIRECTION * round(float(np.arctan2(at[1], at[0])) / DIRECTION)
        yield Item("reach/words", _words, (session.robot, height, turn))


def _ring(robot: Robot, height: float) -> Line | None:
    places = ring_at(robot, height)
    return Line(places=places, colours=np.array([REGION], np.uint8), pixels=2.5) if len(places) > 1 else None


def _words(robot: Robot, height: float, turn: float) -> Label | None:
    """Where the ring is nearest to the target."""
    places = ring_at(robot, height)
    if len(places) < 2:
        return None
    off = np.angle(np.exp(1j * (np.arctan2(places[:, 1], places[:, 0]) - turn)))
    return Label(text="reach", place=places[int(np.argmin(np.abs(off)))])
