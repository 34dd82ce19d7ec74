"""What is done with pictures between their choice and the first search: whether they suit their joints."""

from collections.abc import Mapping
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
from workbench.extras.camera.likelihood import Likelihood, Pictures
from workbench.extras.camera.model_selection import select_camera_step
from workbench.extras.camera.resection import with_parts_in_view
from workbench.extras.camera.rig import PictureReadings, owner_in, rig_of, with_rig
from workbench.identification.algorithms.opt2_levenberg_marquardt import Opt2
from workbench.identification.instrument_preparation import AbstractPreparation
from workbench.identification.problem import Noise, Problem

MIN_TURN, ENOUGH_TURN = np.deg2rad((3.0, 30.0))
"""Turns of the tool between pictures [rad]: less is none, and more tells of all orientations."""
TURN_MORE = "turn it by 30° or more, about several axes, in ten of the pictures"
MIN_PICTURES = 4
"""Pictures below which camera and target are not found."""
OUT_OF_LINE, FAR_OFF = 6.0, 2e-3
"""Pictures this many times the median off, and so many m, don't suit their joints …"""
MAX_WRONG = 0.4
"""… if they are a smaller part of all."""
ROBUST_ROUNDS = 5
"""Fits in turn with pictures weighed by how far they were off."""
HOPELESS = 0.02
"""Median error [m] from which on pictures are refused."""
ROUGH = Noise(1e-3, 2e-3, (), 1.0)
"""Corners share what an arm that is not calibrated yet lacks."""


@final
class PicturePreparation(AbstractPreparation):
    """Pictures that suit their joints and show a board that is used; their content decides on the arm."""

    readings = PictureReadings
    decide = staticmethod(select_camera_step)
    undiagnosed = "pictures can't be diagnosed; Identify decides what they can determine"

    def contradicted(self, robot: Robot, data: Dataset) -> Mapping[int, str]:
        """Pictures that don't suit their joints; one counts the less the farther it is off, so that a few
        wrong ones don't bend the fit."""
        if (turn := _largest_turn(robot, data)) < MIN_TURN:
            why = f"the tool turned by only {np.rad2deg(turn):.2g}°, too little to place camera and target"
            raise DataError(f"{data.source}: {why}; {TURN_MORE}", found=turn)
        free = tuple(n for n in robot.joint_offsets if n in robot.default_free)
        problem = Problem.build(robot, data, free=free).with_noise(ROUGH)
        x, off = problem.start, Pictures.at(problem, problem.start).off
        for _ in range(ROBUST_ROUNDS):
            weight = 1.0 / np.sqrt(1.0 + (off / (3.0 * np.median(off) + 1e-6)) ** 2)
            x = Opt2(limit=40).search(problem.with_row_weights(weight), begin=x).x
            off = Pictures.at(problem, x).off
        usual = float(np.median(off))
        if usual > HOPELESS:
            best = f"with the best poses of camera and target, half of them are {1e3 * usual:.0f} mm off"
            check = "check that each row is its picture's, the order, units and signs of the joints"
            text = f"the pictures don't fit their joint readings: {best} or more; {check}, the robot, and"
            raise DataError(f"{data.source}: {text} 'mounted' in target.toml and camera.toml")
        lost = off > max(OUT_OF_LINE * usual, FAR_OFF)
        if lost.mean() >= MAX_WRONG:
            return {}
        image = PictureReadings.of(data).image
        wrong = "image {} does not fit its joint readings: {:.1f} mm off"
        return {int(i): wrong.format(image[i], 1e3 * off[i]) for i in np.flatnonzero(lost)}

    def suited(self, robot: Robot, data: Dataset) -> Dataset:
        data = with_parts_in_view(data)
        if (turn := _largest_turn(robot, data)) > ENOUGH_TURN:
            return data
        why = f"the tool turned by only {np.rad2deg(turn):.0f}°, so other orientations are poorly determined"
        return replace(data, notes=(*data.notes, f"{why}; {TURN_MORE}"))

    def comparable(self, held: Dataset, fitted: Dataset) -> Dataset:
        own, other = rig_of(held), rig_of(fitted)
        freedom = {camera.owner: camera.free for camera in other.cameras}
        cameras = (replace(c, free=freedom.get(c.owner, c.free)) for c in own.cameras)
        known = {owner_in(p, s) for p in other.posed for s in fitted.sessions}
        held = with_rig(held, replace(own, cameras=tuple(cameras)))
        held = with_parts_in_view(held, MIN_PICTURES, known)
        sessions = held.take(held.included).sessions if held.included.any() else ()
        new = ((part.owner, s) for part, s in product(own.posed, sessions) if owner_in(part, s) not in known)
        how = "was found from its own pictures, the arm from the others"
        notes = (f"held-out session '{s}': the pose of {owner} {how}" for owner, s in new)
        return replace(held, notes=(*held.notes, *notes))

    def noise_left(self, problem: Problem, x: Float[np.ndarray, " p"]) -> Noise:
        return Likelihood.at(problem, x).likeliest().noise


def _largest_turn(robot: Robot, data: Dataset) -> float:
    """By which the tool turned from the first picture to any other [rad]; too few pictures are refused, with
    the reasons why others are not among them."""
    is_placed = np.isfinite(PictureReadings.of(data).sight[..., 0, 0]).any((1, 2))
    if (count := int((data.included & is_placed).sum())) < MIN_PICTURES:
        lost = [] if data.reason is None else data.reason[~data.included].tolist()
        why = "; ".join([*data.notes, *dict.fromkeys(reason for reason in lost if reason)])
        few = f"{count} pictures with four points of the target or more are left"
        more = f"give at least {MIN_PICTURES}{f' ({why})' * bool(why)}"
        raise DataError(f"{data.source}: {few}; {more}", found=count)
    turn = predict(robot, data.take(data.included))[:, :3, :3]
    return float(np.linalg.norm(se3.matrix_to_rotvec(turn[0].T @ turn), axis=1).max())
