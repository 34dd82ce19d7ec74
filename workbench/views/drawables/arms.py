"""The arms: nominal, the real one bent away from it, and in the other branches of the selected target."""

from collections.abc import Iterator

import numpy as np

from workbench.arm.robot import Robot
from workbench.base.types import Matrix4
from workbench.session.commands.arm import drawn_joints
from workbench.session.comparison import STAGES, ModelStage
from workbench.session.stages import shown_stage
from workbench.session.state import Focus, Session
from workbench.session.target_postures import branches_to
from workbench.views.appearance.bodies import body_frames, make_bodies
from workbench.views.appearance.colours import BLAMED, BRANCH, CALIBRATED
from workbench.views.appearance.shapes import ball
from workbench.views.drawables.drawable import Arm, Label, Mesh
from workbench.views.drawables.real_arm import bending_robot, bent_frames
from workbench.views.drawables.sink import Item

SHELL = 1.09
"""How much thicker a ghost is, so that it encloses the arm that it is compared with."""
MAX_BRANCHES = 8
"""Arms of so many branches are drawn at most."""
GLOW = 0.075
"""Radius of the glow about a blamed joint, in reaches."""
SAME_POSTURE = 1e-6
"""Joint positions this near are one posture [rad or m]."""


def arms(session: Session) -> Iterator[Item]:
    """The nominal arm in its current posture, and the real one beside it where it is known."""
    q, overlay, focus = drawn_joints(session), session.choices.overlay, session.playback.focus
    nominal = lambda robot, q: Arm(bodies=make_bodies(robot), frames=body_frames(robot, q))  # noqa: E731
    yield Item("arm/nominal", nominal, (session.robot, q))
    if (known := model_and_real(session)) is not None:
        is_shown, rows, k = focus in (Focus.ROW, Focus.JOG), session.results.comparison, session.results.row
        gap: np.ndarray | None = None  # to where the tool was measured, unless that is wrong
        if focus is Focus.ROW and rows is not None and rows.stages and not rows.set_apart[k]:
            gap = -rows.residuals[k, STAGES.index(shown_stage(session, rows))]
        yield Item("arm/calibrated", real_arm, (*known, q, gap, overlay.exaggeration), shown=is_shown)


def model_and_real(session: Session) -> tuple[Robot, Robot, Matrix4 | None] | None:
    """The shown model, what is known of the real arm, and the base of both; None where they are one.

    The last model that is known stands for the real arm; without measurements, an arm with its effects does.
    """
    rows = session.results.comparison
    if rows is not None and rows.stages:
        real, base = rows.models[rows.stages[-1]], rows.models[ModelStage.NOMINAL].base.pose
        return rows.models[shown_stage(session, rows)], real, base
    real_one = bending_robot(session)
    return None if real_one is None else (real_one.with_effects(), real_one, None)


def blame(session: Session) -> Iterator[Item]:
    """A glow around every joint of the strongest cause, with its name."""
    found, is_shown = session.results.diagnosis, session.choices.overlay.points
    for blamed in () if found is None else found.causes[:1]:
        for k, joint in enumerate(blamed.joints):
            inputs = session.robot, drawn_joints(session), joint
            words = *inputs, "" if k else session.measurements.named(blamed.plain)
            yield Item(f"arm/blame/{joint + 1}", _glow, inputs, shown=is_shown)
            yield Item(f"arm/blame_words/{joint + 1}", _glow_label, words, shown=is_shown)


def branches(session: Session) -> Iterator[Item]:
    """Faint arms in the other branches; not during a drag."""
    is_shown = (
        session.playback.focus is Focus.TARGET and session.drag is None and session.choices.overlay.ghosts
    )
    now = session.states[session.selected].q
    found = branches_to(session.robot, session.plate.targets[session.selected]) if is_shown else ()
    others = [branch.q for branch in found if np.abs(branch.q - now).max() > SAME_POSTURE]
    for i, q in enumerate(others[:MAX_BRANCHES], start=1):
        yield Item(f"arm/branch/{i}", _branch, (session.robot, q))


def real_arm(
    model: Robot, real: Robot, base: Matrix4 | None, q: np.ndarray, gap: np.ndarray | None, times: float
) -> Arm:
    """A shell where the real arm would stand if it were so many times farther off; as of `bent_frames`."""
    bodies = make_bodies(real, swell=SHELL, has_foot=False)  # around the one that it is compared with
    frames = bent_frames(model, real, q[None], times, gap=None if gap is None else gap[None], base=base)
    return Arm(bodies=bodies, frames=frames[0], ghost=CALIBRATED, opacity=0.5)


def _glow(robot: Robot, q: np.ndarray, joint: int) -> Mesh:
    place = body_frames(robot, q)[joint + 1]
    return Mesh(solid=ball(GLOW * robot.reach, np.zeros(3)), colour=BLAMED, opacity=0.35, pose=place)


def _glow_label(robot: Robot, q: np.ndarray, joint: int, text: str) -> Label | None:
    place = body_frames(robot, q)[joint + 1, :3, 3] + np.array([0.0, 0.0, 1.2 * GLOW * robot.reach])
    return Label(text=text, place=place) if text else None


def _branch(robot: Robot, q: np.ndarray) -> Arm:
    bodies = make_bodies(robot, swell=0.9, is_plain=True)
    return Arm(bodies=bodies, frames=body_frames(robot, q), ghost=BRANCH, opacity=0.13)
