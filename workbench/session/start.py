"""The start of a session: a robot, a plate, and everything derived from them.

An arm without a plate of its own gets a circle of ten targets, sized by its reach as Table 2 is, where it
meets all of them well clear of limits and plate, made as its drawing asks for. A target that it can't reach
so is turned about the vertical, and moved in or out if need be, until it does; it then has the orientation
that the tool has there. Arms with fewer than six joints, which fit no seat, get sockets.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

from workbench.arm.inverse.branch import Branch
from workbench.arm.inverse.solve import Task, solve_many
from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.kinematics.reachable import reachable
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.errors import OptionError
from workbench.base.types import frozen
from workbench.data.accuracy_requirement import default_requirement
from workbench.identification.problem_blocks import Noise
from workbench.plate.collision import unobstructed
from workbench.plate.measured_plate import load_plate
from workbench.plate.optimiser.target_blocks import APART
from workbench.plate.patterns import CENTRE, CIRCLE, circle_before
from workbench.plate.plate import Kind, Plate, Target
from workbench.plate.target_readings import sigma_of, usual_kind
from workbench.session.live_score import draw_region, score
from workbench.session.state import Choices, EvaluationRegion, PlateHistory, Session, UndoStep
from workbench.session.target_postures import TargetState, branches_to, settled, solve_all_targets
from workbench.session.target_steps import with_history


@lru_cache(maxsize=8)
def start(
    robot: Robot,
    plate: Plate,
    *,
    is_given: bool = False,
    noise: Noise | None = None,
    states: tuple[TargetState, ...] = (),
) -> Session:
    """A session in which nothing has happened yet.

    Arms of fewer than six joints take seconds to be brought to random poses: their predicted error is left
    to a chore (`SampleRegion`).

    Args:
        robot: Nominal robot.
        plate: Fixture with at least one target.
        is_given: Whether the plate is the user's, not one made for the arm.
        noise: The instrument; the usual one of the plate if None.
        states: How the arm stands at every target; in the branches that tell most if empty.
    """
    if not len(plate):
        raise OptionError(f"plate '{plate.name}' has no targets; give at least one [[target]]")
    noise = noise or Noise(*sigma_of(usual_kind(plate)))
    is_quick = robot.dof >= int(Task.POSE)
    region_q = draw_region(robot, plate) if is_quick else frozen(np.zeros((0, robot.dof)))
    known = len(states) == len(plate)
    states = settled(robot, plate, states) if known else solve_all_targets(robot, plate, region_q=region_q)
    first = score(robot, plate, states, noise=noise, region_q=region_q)
    return with_history(
        Session(
            robot=robot,
            plate=plate,
            states=states,
            score=first,
            region=EvaluationRegion(q=region_q, sampled=plate.region if is_quick else None),
            is_plate_given=is_given,
            noise=noise,
            history=PlateHistory(first=UndoStep(plate, states, first)),
            choices=Choices(wanted=default_requirement(robot.name)),
        )
    )


ARIA, TABLE_2, TABLE_2_NAME = "ARIA", "table2", "Table 2"
"""The paper's arm and its plate, as it is loaded and called."""
TURNS = 6
"""Turns about the vertical that are tried at a place."""
CENTRES = (CENTRE, (0.55, 0.25), (0.5, 0.25), (0.5, 0.35), (0.5, 0.15), (0.6, 0.35), (0.6, 0.15))
"""Where the middle of the circle is tried, as shares of the reach."""
DISTANCES = (1.0, 0.95, 0.9, 0.85, 1.05, 1.1, 1.2)
"""Shares of a place's distance from the base at which they are tried."""


def default_plate(robot: Robot) -> Plate:
    """The plate that an arm begins on: Table 2 for the arm that it was made for, a circle for any other."""
    return load_plate(TABLE_2) if robot.name == ARIA else default_circle(robot)


def is_default_plate(session: Session) -> bool:
    """Whether the plate is still the one that the arm began on."""
    if session.is_plate_given or session.plate is not session.history.first.plate:
        return False
    return session.plate.name == CIRCLE or (session.robot.name == ARIA and session.plate.name == TABLE_2_NAME)


@lru_cache(maxsize=16)
def default_circle(robot: Robot) -> Plate:
    """The circle before an arm that has room at every target, or else at most of them."""
    best, most = None, -1
    for centre in CENTRES:
        plate = _circle(robot, centre)
        count = sum(_has_room(robot, plate, i, branches_to(robot, t)) for i, t in enumerate(plate.targets))
        if count > most:
            best, most = plate, count
        if count == len(plate):
            break
    assert best is not None
    return best.made_as_drawn


def _circle(robot: Robot, centre: tuple[float, float]) -> Plate:
    circle, straight = circle_before(robot, centre), robot.with_effects()
    plate, is_free = circle, robot.dof >= int(Task.POSE)
    for number in (2 if is_free else 1) * list(range(len(circle))):  # again: other blocks have turned by then
        if not (is_free and _has_room(robot, plate, number, branches_to(robot, plate.targets[number]))):
            met = _met(straight, plate, number, circle.targets[number])
            plate = replace(plate, targets=(*plate.targets[:number], met, *plate.targets[number + 1 :]))
    return plate


def _has_room(robot: Robot, plate: Plate, number: int, branches: Sequence[Branch]) -> bool:
    """Whether one of a target's branches keeps well clear of limits and plate."""
    return any(branch.is_roomy for branch in unobstructed(robot, plate, number, branches))


def _stands_free(plate: Plate, number: int, target: Target) -> bool:
    """Whether the block of a target, however turned, stands on the plate and beside all others."""
    assert plate.size is not None
    others = np.delete(plate.poses[:, :2, 3], number, axis=0)
    inside = np.abs(target.xyz[:2] - plate.xyz[:2]) <= 0.5 * (plate.size[:2] - APART)
    return bool(inside.all() and np.linalg.norm(others - target.xyz[:2], axis=1).min() > APART)


def _met(robot: Robot, plate: Plate, number: int, placed: Target) -> Target:
    """The target, turned, nearer or farther, as the arm meets it; a socket where it can't hold any."""
    turns = se3.rotvec_to_matrix(np.linspace(0.0, 2.0 * np.pi, TURNS, endpoint=False)[:, None] * [0, 0, 1])
    found: list[tuple[bool, float, Target]] = []
    places = [replace(placed, xyz=frozen(placed.xyz * [share, share, 1.0])) for share in DISTANCES]
    places = [placed, *(place for place in places[1:] if _stands_free(plate, number, place))]
    is_free = robot.dof >= int(Task.POSE)  # fewer joints don't fit a seat
    for target in places if is_free else ():
        poses = robot.base.pose @ se3.pose(turns @ target.pose[:3, :3], np.tile(target.xyz, (TURNS, 1)))
        branches = [branch for result in solve_many(robot, poses) for branch in result.within_limits]
        if not branches:
            continue
        clear = unobstructed(robot, plate, number, branches)
        best = max(clear or branches, key=lambda branch: branch.room)
        tool = se3.inverse(robot.base.pose) @ tool_poses(robot, Motion(best.q[None]))[0]
        met = replace(target, rpy=frozen(se3.matrix_to_rpy(tool[:3, :3])))
        found.append((bool(clear), best.room, met))
        if _has_room(robot, plate, number, clear):
            break
    if found:
        return max(found, key=lambda one: one[:2])[2]
    sockets = [replace(target, kind=Kind.SOCKET) for target in places]
    poses = robot.base.pose @ np.stack([socket.pose for socket in sockets])
    near, _ = reachable(robot, poses, task=Task.POSITION)  # far quicker than all branches
    open_ = (socket for socket, is_near in zip(sockets, near, strict=True) if is_near)
    return next((s for s in open_ if _has_room(robot, plate, number, branches_to(robot, s))), sockets[0])
