"""The arms: nominal, calibrated, deflected by effects, and in the other branches of the selected target."""

from collections.abc import Iterator

import numpy as np

from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.types import Matrix4
from workbench.session.commands.arm import drawn_joints
from workbench.session.deflection import bend, bending_robot, drawable_bending, driven_by_pose
from workbench.session.joint_errors import shown_effect
from workbench.session.state import NO_FIELD, Focus, Session
from workbench.views.appearance.bodies import body_frames
from workbench.views.appearance.colours import BLAMED, BRANCH, CALIBRATED, DEFLECTED
from workbench.views.appearance.shapes import ball
from workbench.views.drawables.drawable import Arm, Label, Mesh
from workbench.views.drawables.nominal_arm import bodies_of, nominal_arm_at
from workbench.views.drawables.sink import Item

SHELL = 1.09
"""How much thicker a ghost is, so that it encloses the arm that it is compared with."""
MAX_BRANCHES = 8
"""Arms of so many branches are drawn at most."""
ABOVE = 0.05
"""Height of the words over the bent arm's tool [m]."""
GLOW = 0.075
"""Radius of the glow about a blamed joint, in reaches."""
SAME_POSTURE = 1e-6
"""Joint positions this near are one posture [rad or m]."""


def arms(session: Session) -> Iterator[Item]:
    """The nominal arm in its current posture, and the calibrated one as a shell around it."""
    q, overlay = drawn_joints(session), session.choices.overlay
    is_shown = overlay.nominal or session.playback.focus is not Focus.ROW
    yield nominal_arm_at(session.robot, q, is_shown=is_shown)
    if session.results.calibrated is not None and session.results.identification is not None:
        is_shown = overlay.calibrated and session.playback.focus in (Focus.ROW, Focus.JOG)
        inputs = session.results.calibrated, q, session.results.identification.aligned
        yield Item("arm/calibrated", calibrated_arm, inputs, shown=is_shown)


def deflected_arm(session: Session) -> Iterator[Item]:
    """The arm deflected by its effects, labelled with its exaggeration, over the rigid one."""
    robot, overlay = bending_robot(session), session.choices.overlay
    if robot is not None:
        inputs = robot, drawn_joints(session), overlay.deflection
        yield Item("arm/bent", _deflected, inputs, shown=overlay.is_deflected)
        yield Item("arm/bent_words", _deflection_label, inputs, shown=overlay.is_deflected)


def blame(session: Session) -> Iterator[Item]:
    """A glow around every joint of the effect whose law is shown, with its name."""
    effect = shown_effect(session)
    for k, joint in enumerate(() if effect is None else effect.joints):
        inputs = session.robot, drawn_joints(session), joint
        yield Item(f"arm/blame/{joint + 1}", _glow, inputs)
        text = effect.plain if effect is not None and k == 0 else ""
        yield Item(f"arm/blame_words/{joint + 1}", _glow_label, (*inputs, text))


def branches(session: Session) -> Iterator[Item]:
    """Faint arms in the other branches; not during a drag, nor among cubes."""
    is_shown = (
        session.playback.focus is Focus.TARGET
        and session.drag is None
        and session.choices.overlay.ghosts
        and session.region.view.field == NO_FIELD
        and session.branches.of is session.plate.targets[session.selected]
    )
    now = session.states[session.selected].q
    others = (
        [b.q for b in session.branches.found if np.abs(b.q - now).max() > SAME_POSTURE] if is_shown else []
    )
    for i in range(MAX_BRANCHES):
        q = others[i] if i < len(others) else None
        yield Item(f"arm/branch/{i + 1}", _branch, (session.robot, q), shown=q is not None)


def calibrated_arm(robot: Robot, q: np.ndarray, aligned: Robot) -> Arm:
    """A shell about the nominal arm as it is aligned, where its effects have it: they were fitted with it."""
    moved = driven_by_pose(robot)
    frames = body_frames(robot, q) if moved is None else body_frames(moved, q, shift=bend(moved, q).shift)
    frames = beside_nominal(robot, aligned) @ frames
    bodies = bodies_of(robot, swell=SHELL, has_foot=False)
    return Arm(bodies=bodies, frames=frames, ghost=CALIBRATED, opacity=0.3)


def beside_nominal(robot: Robot, aligned: Robot) -> Matrix4:
    """From a calibrated arm's base to that of the aligned nominal one; the rows don't tell them apart."""
    return se3.inverse(aligned.base.pose) @ robot.base.pose


def deviating_arm(robot: Robot, q: np.ndarray) -> Arm:
    """The shell that follows a trajectory, drawn from its geometry alone and without a foot."""
    bodies = bodies_of(robot, swell=SHELL, is_plain=True, has_foot=False)
    return Arm(bodies=bodies, frames=body_frames(robot, q), ghost=CALIBRATED, opacity=0.3)


def _deflected(robot: Robot, q: np.ndarray, bending: float) -> Arm:
    shift = bend(robot, q).shift
    frames = body_frames(robot, q, shift=drawable_bending(robot, q, bending) * shift)
    return Arm(bodies=bodies_of(robot, has_foot=False), frames=frames, ghost=DEFLECTED, opacity=0.42)


def _deflection_label(robot: Robot, q: np.ndarray, bending: float) -> Label:
    times = drawable_bending(robot, q, bending)
    frames = body_frames(robot, q, shift=times * bend(robot, q).shift)
    return Label(text=f"deflection × {times:.3g}", place=frames[-1, :3, 3] + np.array([0.0, 0.0, ABOVE]))


def _glow(robot: Robot, q: np.ndarray, joint: int) -> Mesh:
    place = body_frames(robot, q)[joint + 1]
    return Mesh(solid=ball(GLOW * robot.reach, np.zeros(3)), colour=BLAMED, opacity=0.35, pose=place)


def _glow_label(robot: Robot, q: np.ndarray, joint: int, text: str) -> Label | None:
    place = body_frames(robot, q)[joint + 1, :3, 3] + np.array([0.0, 0.0, 1.2 * GLOW * robot.reach])
    return Label(text=text, place=place) if text else None


def _branch(robot: Robot, q: np.ndarray | None) -> Arm | None:
    if q is None:
        return None
    bodies = bodies_of(robot, swell=0.9, is_plain=True)
    return Arm(bodies=bodies, frames=body_frames(robot, q), ghost=BRANCH, opacity=0.13)
