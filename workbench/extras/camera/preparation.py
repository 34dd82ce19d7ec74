"""What is done with pictures between their choice and the first search: whether they suit their joints."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import combinations, product
from typing import final

import numpy as np
from jaxtyping import Float

from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.errors import DataError
from workbench.data.dataset import Dataset
from workbench.data.prediction import predict
from workbench.extras.camera.camera import ON
from workbench.extras.camera.doubts import PictureFit
from workbench.extras.camera.model_selection import select_camera_step
from workbench.extras.camera.pixel_noise import Likelihood, Pictures, Variances
from workbench.extras.camera.printed import NO_TARGET
from workbench.extras.camera.resection import with_boards, with_boards_in_view, with_sessions_in_view
from workbench.extras.camera.rig import PictureReadings, owner_in, rig_of, with_rig
from workbench.extras.camera.selection_steps import Identifiability
from workbench.identification.algorithms.opt2_levenberg_marquardt import Opt2
from workbench.identification.instrument_preparation import AbstractPreparation, Seek
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
SUSPICIOUS, HOPELESS = 5e-3, 0.05
"""Median error [m] from which on camera and target are tried in each other's place and other joints, and from
which on pictures are refused."""
OTHER_JOINTS = 0.3
"""Part of the median error that the right joints leave at most."""
ROUGH = Noise(1e-3, 2e-3, (), 1.0)
"""Corners share what an arm that is not calibrated yet lacks."""


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
        return Likelihood.at(problem, x).most_likely(Variances(problem.noise)).noise


def _check_number(data: Dataset) -> None:
    count = int(data.included.sum())
    if count < MIN_PICTURES:
        raise DataError(
            f"{data.source}: {count} pictures are left to fit; give at least {MIN_PICTURES}", found=count
        )


def _largest_turn(robot: Robot, data: Dataset) -> float:
    """By which the tool turned from the first picture to any other [rad]."""
    turn = predict(robot, data.take(data.included))[:, :3, :3]
    return float(np.linalg.norm(se3.matrix_to_rotvec(turn[0].T @ turn), axis=1).max())


def _check_turned(robot: Robot, data: Dataset) -> None:
    """Refuse pictures between which the tool hardly turns: they don't tell where camera and target are."""
    if (turn := _largest_turn(robot, data)) < MIN_TURN:
        raise DataError(
            f"{data.source}: the tool turned by only {np.rad2deg(turn):.2g}°, so the pictures can't "
            f"determine the poses of camera and target; {TURN_MORE}",
            found=turn,
        )


def mismatched_pictures(
    robot: Robot, data: Dataset, build: Callable[..., Problem] = Problem.build
) -> dict[int, str]:
    """Rows whose picture does not suit their joints, with the reason.

    A picture counts the less in the fit the farther it is off, so that a few wrong ones don't bend it.

    Raises:
        DataError: all suit a rig whose camera and target have changed places, or joints a row away or with
            one reversed, or most suit nothing.
    """
    free = tuple(n for n in robot.joint_offsets if n in robot.default_free)

    def fitted(rows: Dataset) -> tuple[Problem, np.ndarray, np.ndarray]:
        problem = build(robot, rows, free=free).with_noise(ROUGH)
        return problem, *_robust_errors(problem)

    problem, x, off = fitted(data)
    usual = float(np.median(off))
    if usual > SUSPICIOUS:
        _check_mounts(robot, data, build, problem, x)
        for text, q in _other_joints(data):
            if np.median(fitted(replace(data, q=q))[2]) < OTHER_JOINTS * usual:
                raise DataError(f"{data.source}: {text}")
    if usual > HOPELESS:
        raise DataError(
            f"{data.source}: the pictures don't fit their joint readings: with the best poses of camera and "
            f"target, half of them are {1e3 * usual:.0f} mm off or more; check the order of the rows, the "
            "order, units and signs of the joints, and the robot"
        )
    limit = max(OUT_OF_LINE * usual, FAR_OFF)
    lost = off > limit
    if not lost.any() or lost.mean() >= MAX_WRONG:
        return {}
    image = PictureReadings.of(data).image
    reasons = {
        int(i): f"image {image[i]} does not fit its joint readings: {1e3 * off[i]:.1f} mm off"
        for i in np.flatnonzero(lost)
    }
    for i, j in combinations(reasons, 2):
        order = np.arange(len(data))
        order[[i, j]] = j, i
        swapped = build(robot, replace(data, q=data.q[order]), free=free).with_noise(ROUGH)
        if (_errors(swapped, x)[[i, j]] <= limit).all():
            text = f"the joints of images {image[i]} and {image[j]} are exchanged"
            reasons |= {i: text, j: text}
    return reasons


def _other_joints(data: Dataset) -> Iterator[tuple[str, Float[np.ndarray, "rows n"]]]:
    """What joints may be in place of those of the file, in words and as numbers."""
    for ahead, word in ((1, "before"), (-1, "after")):
        yield (
            f"each picture fits the joints of the row {word} its own; correct the order of the joints, or "
            "the names of their pictures",
            np.roll(data.q, ahead, axis=0),
        )
    for joint in range(data.joints):
        yield (
            f"joint {joint + 1} counts backwards: the pictures fit its readings with the opposite sign; "
            "correct its column, or the robot",
            data.q * np.where(np.arange(data.joints) == joint, -1.0, 1.0),
        )


def _errors(problem: Problem, x: np.ndarray) -> Float[np.ndarray, " rows"]:
    """How far off every picture's corners are, where the target is [m, root mean square]."""
    pictures = Pictures.at(problem, x)
    slope = np.einsum("rii->r", pictures.normal[:, :3, :3])
    return np.sqrt(2.0 * pictures.square / np.maximum(slope, 1e-12))


def _robust_errors(problem: Problem) -> tuple[np.ndarray, Float[np.ndarray, " rows"]]:
    """Answer of a fit in which pictures that are far off count less, and how far each is off [m]."""
    x = problem.start
    for _ in range(ROBUST_ROUNDS):
        off = _errors(problem, x)
        weight = 1.0 / np.sqrt(1.0 + (off / (3.0 * np.median(off) + 1e-6)) ** 2)
        x = Opt2(limit=40).search(problem.with_row_weights(weight), begin=x).x
    return x, _errors(problem, x)


def _check_mounts(
    robot: Robot, data: Dataset, build: Callable[..., Problem], problem: Problem, x: np.ndarray
) -> None:
    """Refuse a rig whose camera rides where its file says that the target does."""
    rig = rig_of(data)
    other = with_rig(data, rig.with_mounts_exchanged())
    tried = build(robot, other, free=()).with_noise(ROUGH)
    if PictureFit(tried, _robust_errors(tried)[0]).pixel < 0.5 * PictureFit(problem, x).pixel:
        board, camera = ON[rig.cameras[0].mounted], ON[rig.mounted]
        is_asked = any(note.startswith(NO_TARGET) for note in data.notes)
        mend = "change 'Board is'" if is_asked else "exchange 'mounted' in target.toml and camera.toml"
        raise DataError(
            f"{data.source}: the mounts are exchanged: the board is {board} and the camera {camera}; {mend} "
            "and read the pictures again"
        )
