"""`world/arm/nominal` and `world/arm/calibrated`: the two arms, solid and amber.

Each body moves with its own frame.
"""

import numpy as np
import rerun as rr

from workbench.arm.robot import Robot
from workbench.session.commands.arm import standing
from workbench.views.appearance.bodies import body_frames, make_bodies
from workbench.views.appearance.colours import GHOST
from workbench.views.recording.canvas import Canvas
from workbench.views.recording.entities.entity import AbstractEntity, Moment
from workbench.views.recording.shapes import mesh, quaternion

SHELL = 1.09
"""How much thicker the calibrated arm is, so that it encloses the nominal one."""
GHOSTLY = 0.35
MOST_ROWS = 2000
"""Rows for which the arms are drawn at most."""


class Arms(AbstractEntity):
    """The nominal arm as the page shows it, the calibrated one about it."""

    def __init__(self) -> None:
        self._nominal, self._calibrated = _Arm("world/arm/nominal"), _Arm("world/arm/calibrated", GHOST)

    def draw(self, canvas: Canvas, moment: Moment) -> None:
        session = moment.session
        q = standing(session)
        found = session.identification
        self._nominal.stand(canvas, session.robot, q)
        if found is None:
            self._calibrated.leave(canvas)
        else:
            self._calibrated.stand(canvas, found.runs[session.fit].calibrated, q)


class ArmsAtRows(AbstractEntity):
    """Both arms as they stood at every measured row, on the timeline `measured_row`."""

    def draw(self, canvas: Canvas, moment: Moment) -> None:
        session, rows = moment.session, moment.session.comparison
        if rows is None:
            return
        _Arm("world/arm/nominal").stand_at_rows(canvas, session.robot, rows.q[:MOST_ROWS])
        if session.identification is not None:
            arm = session.identification.runs[session.fit].calibrated
            _Arm("world/arm/calibrated", GHOST).stand_at_rows(canvas, arm, rows.q[:MOST_ROWS])


class _Arm:
    """One arm; its bodies are drawn anew when the robot is another one."""

    def __init__(self, path: str, ghost: tuple[int, int, int] | None = None):
        self._path, self._ghost = path, ghost
        self._robot: Robot | None = None
        self._q: np.ndarray | None = None
        self._parts: frozenset[str] = frozenset()

    def stand(self, canvas: Canvas, robot: Robot, q: np.ndarray) -> None:
        if robot is not self._robot:
            self._build(canvas, robot)
        elif self._q is not None and np.array_equal(q, self._q):
            return
        self._q = q
        for i, frame in enumerate(body_frames(robot, q)):
            turn = quaternion(frame[:3, :3])
            canvas.log(
                f"{self._path}/body{i}",
                rr.Transform3D(translation=frame[:3, 3], quaternion=rr.Quaternion(xyzw=turn)),
            )

    def stand_at_rows(self, canvas: Canvas, robot: Robot, rows: np.ndarray) -> None:
        self._build(canvas, robot)
        frames = np.stack([body_frames(robot, q) for q in rows], 1)
        for i, places in enumerate(frames):
            turns = quaternion(places[:, :3, :3])
            columns = rr.Transform3D.columns(translation=places[:, :3, 3], quaternion=turns)
            canvas.rows(f"{self._path}/body{i}", columns, len(rows))

    def leave(self, canvas: Canvas) -> None:
        if self._robot is not None:
            canvas.clear(self._path)
        self._robot = self._q = None
        self._parts = frozenset()

    def _build(self, canvas: Canvas, robot: Robot) -> None:
        """Draw the bodies over those of another robot; what that one had more goes.

        A `Clear` of the whole arm would take its poses of the same step away as well.
        """
        self._robot = robot
        solids = {
            f"{self._path}/body{i}/part{j}": part
            for i, body in enumerate(make_bodies(robot, swell=1.0 if self._ghost is None else SHELL))
            for j, part in enumerate(body.parts)
        }
        for path, part in solids.items():
            colour = part.colour if self._ghost is None else (*self._ghost, round(255 * GHOSTLY))
            canvas.log(path, mesh(part.solid, colour))
        for path in self._parts - solids.keys():
            canvas.clear(path)
        self._parts = frozenset(solids)
