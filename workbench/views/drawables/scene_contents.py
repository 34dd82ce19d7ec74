"""Which parts of a session are drawn on the page and in recordings; where one looks from at first, and when
the arm, its plate or its measurements are others."""

from collections.abc import Iterator

import numpy as np

from workbench.arm.kinematics.skeleton import body_frames, height_above_floor
from workbench.base.types import Vector3
from workbench.parts import warn_of_broken
from workbench.session.state import Focus, Session
from workbench.views.drawables.arms import arms, blame, branches
from workbench.views.drawables.measured import measured, selected_row_mark
from workbench.views.drawables.plate import grid, plate, region
from workbench.views.drawables.sink import Item

SUBJECTS = (arms, blame, plate, region, measured)
"""What page and recordings show; each yields its items for a session."""
ON_PAGE = (grid, branches, selected_row_mark)
"""What the page alone shows besides."""


def items(session: Session, *, on_page: bool) -> Iterator[Item]:
    """Everything that the page, or a recording, shows."""
    for subject in (*SUBJECTS, *(ON_PAGE if on_page else ())):
        try:
            yield from subject(session)
        except Exception as error:  # the rest is shown
            warn_of_broken(f"the drawable {subject.__name__}", error)


VIEW = np.array([1.0, -0.86, 0.66])
"""Direction from which everything is looked at first."""
BALL_FILLS_PICTURE = 3.4
"""Distance from which a ball fills the picture, in its radii."""
MIN_RADIUS = 0.3
"""Minimum radius of what is looked at [m]."""
MAX_POSTURES = 40
"""Rows at which the arm has to be in the picture."""


def title(session: Session) -> str:
    """The arm, and what is seen beside it: the plate, or the rows."""
    loaded = session.measurements.loaded
    beside = session.plate if loaded is None or session.shows_plate else loaded
    return f"{session.robot.name} · {beside.name}"


def occasion(session: Session) -> tuple[object, ...]:
    """Arm, plate and measurements as they are looked at: where one of these is another, so is the view."""
    first, loaded = session.history.first.plate, session.measurements.loaded
    is_placed = session.results.identification is not None  # only then it is known where the rows lie
    return session.robot, first, loaded, session.shows_plate, is_placed


def first_view(session: Session) -> tuple[Vector3, Vector3]:
    """Initial camera position and point of view [m].

    It shows the arm and all measured positions from their side of the base, or else what is in front of it.
    """
    robot, rows, loaded = session.robot, session.results.comparison, session.measurements.loaded
    if rows is None or loaded is None or not (loaded.virtual or session.playback.focus is Focus.ROW):
        middle = 0.5 * (session.plate.region.min + session.plate.region.max)
        height = 0.24 * robot.reach - height_above_floor(robot)
        look_at = np.array([0.62 * middle[0], 0.62 * middle[1], height])
        return look_at + robot.reach * VIEW, look_at
    seen = rows.measured[np.isfinite(rows.measured).all(1)]
    postures = rows.q[:: max(1, -(-len(rows) // MAX_POSTURES))]
    arm = body_frames(robot, postures)[..., :3, 3].reshape(-1, 3)
    x, y = (seen if len(seen) else arm)[:, :2].mean(0)
    size, places = float(np.hypot(x, y)), np.vstack([seen, arm])
    outward = np.array([x, y]) / size if size > 0.0 else np.array([1.0, 0.0])
    along = np.array([*(outward + 0.7 * np.array([outward[1], -outward[0]])), 0.7])  # a little from above
    middle = 0.5 * (places.min(0) + places.max(0))
    radius = max(float(np.linalg.norm(places - middle, axis=1).max()), MIN_RADIUS)
    return middle + BALL_FILLS_PICTURE * radius * along / np.linalg.norm(along), middle
