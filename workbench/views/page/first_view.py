"""The initial view of a session, also used when measurements are added or removed."""

import numpy as np

from workbench.arm.kinematics.skeleton import body_frames
from workbench.arm.robot import Robot
from workbench.base.types import Vector3
from workbench.session.comparison import Comparison
from workbench.session.state import Focus, Session
from workbench.views.page.camera import from_outside, view_of, view_of_region

MAX_POSTURES = 40
"""Rows at which the arm has to be in the picture."""


def first_view(session: Session) -> tuple[Vector3, Vector3]:
    """Initial camera position and point of view [m]: towards the measured rows, or else the plate."""
    rows, loaded = session.results.comparison, session.measurements.loaded
    if rows is not None and loaded is not None and (loaded.virtual or session.playback.focus is Focus.ROW):
        return view_of_rows(session.robot, rows)
    return view_of_region(session.robot, session.plate.region)


def view_of_rows(robot: Robot, rows: Comparison) -> tuple[Vector3, Vector3]:
    """Where the camera has the arm and all measured positions in its picture, from their side of the base."""
    seen = rows.measured[np.isfinite(rows.measured).all(1)]
    postures = rows.q[:: max(1, -(-len(rows) // MAX_POSTURES))]
    arm = body_frames(robot, postures)[..., :3, 3].reshape(-1, 3)
    return view_of(np.vstack([seen, arm]), along=from_outside(seen if len(seen) else arm))
