"""What is done with pictures between their choice and the first search."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import product
from typing import final

import numpy as np
from jaxtyping import Float

from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.errors import DataError
from workbench.data.dataset import Dataset
from workbench.data.prediction import predict
from workbench.extras.camera.checks import mismatched_pictures
from workbench.extras.camera.model_selection import select_camera_step
from workbench.extras.camera.pixel_noise import Pictures, PixelPrior, Variances, most_likely
from workbench.extras.camera.resection import with_boards, with_boards_in_view, with_sessions_in_view
from workbench.extras.camera.rig import PictureReadings, owner_in, rig_of, with_rig
from workbench.extras.camera.selection_steps import Identifiability
from workbench.identification.own_preparation import AbstractPreparation, Seek
from workbench.identification.problem import Noise, Problem

MIN_TURN, ENOUGH_TURN = np.deg2rad((3.0, 30.0))
"""Turns of the tool between pictures [rad]: less is none, and more tells of all orientations."""
TURN_MORE = "turn it by 30° or more, about several axes, in ten of the pictures"
MIN_PICTURES = 4
"""Pictures below which camera and target are not found."""


@final
class PicturePreparation(AbstractPreparation):
    """Pictures that suit their joints and show a board that is used; their content decides on the arm."""

    name = "pictures"
    readings = PictureReadings
    undiagnosed = "pictures can't be diagnosed; Identify decides what they can determine"

    def contradicted(self, robot: Robot, data: Dataset) -> Mapping[int, str]:
        _check_number(data)
        _check_turned(robot, data)
        return mismatched_pictures(robot, data)

    def suited(self, robot: Robot, data: Dataset) -> Dataset:
        data = with_boards_in_view(data, fitted=True)
        _check_number(data)
        if (turn := _largest_turn(robot, data)) > ENOUGH_TURN:
            return data
        turned = (
            f"the tool turned by only {np.rad2deg(turn):.0f}°, so other orientations are poorly determined"
        )
        return replace(data, notes=(*data.notes, f"{turned}; {TURN_MORE}"))

    def decide(
        self,
        robot: Robot,
        data: Dataset,
        *,
        free: Sequence[str],
        build: Callable[..., Problem],
        seek: Seek | None,
    ) -> tuple[Problem, Identifiability]:
        return select_camera_step(robot, data, free=free, build=build, seek=seek)

    def comparable(self, held: Dataset, fitted: Dataset) -> Dataset:
        held = with_boards(held, [target.owner for target in rig_of(fitted).targets])
        freedom = {camera.owner: camera.free for camera in rig_of(fitted).cameras}
        own = rig_of(held)
        cameras = (replace(c, free=freedom.get(c.owner, c.free)) for c in own.cameras)
        rig = replace(own, cameras=tuple(cameras))
        held = with_rig(held, rig)
        known = {owner_in(p, s) for p in rig.posed for s in fitted.sessions}
        held = with_sessions_in_view(held, MIN_PICTURES, known)
        sessions = held.take(held.included).sessions if held.included.any() else ()
        new = tuple(
            f"held-out session '{s}': the pose of {part.owner} was found from its own pictures, the arm "
            "from the others"
            for part, s in product(rig.posed, sessions)
            if owner_in(part, s) not in known
        )
        return replace(held, notes=(*held.notes, *new))

    def noise_left(self, problem: Problem, x: Float[np.ndarray, " p"]) -> Noise:
        known = PixelPrior.of(problem, x, np.zeros(len(x)))
        return most_likely(Pictures.at(problem, x), known, Variances(problem.noise)).noise


def _check_number(data: Dataset) -> None:
    count = int(data.included.sum())
    if count < MIN_PICTURES:
        raise DataError(f"{data.source}: {count} pictures are left to fit; give at least {MIN_PICTURES}")


def _largest_turn(robot: Robot, data: Dataset) -> float:
    """By which the tool turned from the first picture to any other [rad]."""
    turn = predict(robot, data.take(data.included))[:, :3, :3]
    return float(np.linalg.norm(se3.matrix_to_rotvec(turn[0].T @ turn), axis=1).max())


def _check_turned(robot: Robot, data: Dataset) -> None:
    """Refuse pictures between which the tool hardly turns: they don't tell where camera and target are."""
    if (turn := _largest_turn(robot, data)) < MIN_TURN:
        raise DataError(
            f"{data.source}: the tool turned by only {np.rad2deg(turn):.2g}°, so the pictures can't "
            f"determine the poses of camera and target; {TURN_MORE}"
        )
