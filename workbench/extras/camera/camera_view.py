"""Poses of cameras and target, what a camera sees at a pose, and the uncertainty of the tool there.

Before anything is identified, camera and target are where closed forms put them with the nominal arm.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from jaxtyping import Float

from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.types import Matrix4
from workbench.data.dataset import Dataset
from workbench.data.prediction import predict
from workbench.extras.camera.camera import INTRINSICS, Mount
from workbench.extras.camera.model_selection import by_frames, columns
from workbench.extras.camera.observation import POSE, PixelObservation, Placed
from workbench.extras.camera.rig import PictureReadings
from workbench.extras.camera.session_commands import Previews
from workbench.identification.fit import Fit
from workbench.session.commands.arm import drawn_joints
from workbench.session.state import Focus, Session

COLUMNS, ROWS = 8, 6
"""Cells into which a picture is divided to say how much of it was used."""


@dataclass(frozen=True, eq=False)
class CameraView:
    """One camera, and its view of the target with the arm as shown in the scene.

    Args:
        name: Of the camera.
        size: Of its pictures [px].
        pose: In the frame of the robot's base.
        focal: Focal length [px].
        target: Corners of the target in the frame of the robot's base [m].
        predicted: Where the corners are in the picture [px]; NaN where the camera can't see them.
        measured: Where they were found [px]; NaN where they were not, or no row is looked at.
        picture: JPEG of the row that is looked at; None without.
        image: Its name.
    """

    name: str
    size: tuple[int, int]
    pose: Matrix4
    focal: Float[np.ndarray, "2"]
    target: Float[np.ndarray, "points 3"]
    predicted: Float[np.ndarray, "points 2"]
    measured: Float[np.ndarray, "points 2"]
    picture: bytes | None = None
    image: str = ""

    @property
    def frame(self) -> Float[np.ndarray, "4 2"]:
        """X/Z and Y/Z of the picture's corners, the lens aside."""
        width, height = self.size
        return (
            np.array([[0, 0], [width, 0], [width, height], [0, height]]) - np.array(self.size) / 2
        ) / self.focal


def camera_views(session: Session) -> tuple[CameraView, ...]:
    """What every camera sees now; none without pictures."""
    loaded = session.measurements.loaded
    if loaded is None or not isinstance(loaded.dataset.readings, PictureReadings):
        return ()
    data, readings = loaded.dataset, loaded.dataset.readings
    rig, previews = readings.rig, session.part(Previews)
    fit = None if session.results.run is None else session.results.run.fit
    robot = (session.robot if fit is None else fit.calibrated).in_session(data.sessions[0])
    values = _values(session.robot if fit is None else fit.calibrated, data, fit)
    row = _row(session, data)
    q = drawn_joints(session) if row is None else data.q[row]
    observation = PixelObservation.of(data.take(np.array([0 if row is None else row])))
    tool = robot.predict(q[None])
    nowhere = replace(observation, measured=np.zeros_like(observation.measured))
    unknown = np.array([values.get(name, np.nan) for name in nowhere.unknowns])
    predicted = -nowhere.linearise(tool, unknown).residual.reshape(observation.measured.shape)[0]
    eyes, plates = nowhere.placements
    to_base = se3.inverse(robot.base.pose)
    carriers = {Mount.WORLD: to_base, Mount.TOOL: to_base @ tool[0]}
    boards = zip(plates, rig.targets, strict=True)
    carrier = carriers[rig.mounted]
    placed = (se3.apply(carrier @ _placed(values, plate.owner), board.points) for plate, board in boards)
    points = np.concatenate([*placed])
    image = "" if row is None else str(readings.image[row])
    views = []
    for c, camera in enumerate(rig.cameras):
        pose = carriers[camera.mounted] @ _placed(values, eyes[c].owner)
        before = se3.apply(se3.inverse(pose), points)[:, 2] > 0.0
        views.append(
            CameraView(
                name=camera.name,
                size=camera.size,
                pose=pose,
                focal=np.array(
                    [values.get(f"{camera.owner}.{INTRINSICS[k]}", camera.intrinsics[k]) for k in (0, 1)]
                ),
                target=points,
                predicted=np.where(before[:, None], predicted[c], np.nan),
                measured=np.full_like(predicted[c], np.nan) if row is None else observation.measured[0, c],
                picture=None if previews is None else previews.by_image.get((camera.name, image)),
                image=image,
            )
        )
    return tuple(views)


def tool_covariance(session: Session) -> Float[np.ndarray, "3 3"] | None:
    """Covariance of the tool's position [m²] in the current posture, from that of the identified constants.

    What a base and a tool frame could do as well is aside: the camera takes it.
    """
    found, run = session.results.identification, session.results.run
    if found is None or run is None or found.identifiability is None or found.identifiability.refused:
        return None
    fit = run.fit
    names, robot, share = _frames_aside(fit)
    places = [fit.problem.names.index(name) for name in names]
    mine, frames = columns(robot, Motion(drawn_joints(session)[None]), names)
    left = (mine - frames @ share)[0, :3]
    covariance = left @ fit.covariance[np.ix_(places, places)] @ left.T
    turn = robot.base.pose[:3, :3]
    return turn.T @ covariance @ turn


@lru_cache(maxsize=4)
def coverage(data: Dataset, camera: int) -> Float[np.ndarray, "rows columns"]:
    """How many corners each cell of a camera's picture has, over all pictures."""
    readings = PictureReadings.of(data)
    return cells(readings.pixels[:, camera][readings.seen[:, camera]], readings.rig.cameras[camera].size)


def cells(seen: Float[np.ndarray, "corners 2"], size: tuple[int, int]) -> Float[np.ndarray, "rows columns"]:
    """How many corners each cell of a picture of this size has."""
    ends = (0.0, size[1]), (0.0, size[0])
    return np.histogram2d(seen[:, 1], seen[:, 0], bins=(ROWS, COLUMNS), range=ends)[0]


@lru_cache(maxsize=4)
def _values(robot: Robot, data: Dataset, fit: Fit | None) -> Mapping[str, float]:
    """The instrument's unknowns: as identified, or as first guesses."""
    found = {} if fit is None else fit.problem.named(fit.x)
    observation = PixelObservation.of(data)
    if found.keys() >= set(observation.unknowns):
        return found
    first = observation.start(predict(robot, data)).tolist()
    return dict(zip(observation.unknowns, first, strict=True)) | found


def _placed(values: Mapping[str, float], owner: str) -> Matrix4:
    """A pose; NaN where no picture of its session shows it."""
    return Placed.at(np.array([values.get(f"{owner}.{part}", np.nan) for part in POSE])).pose


def _row(session: Session, data: Dataset) -> int | None:
    if session.playback.focus is not Focus.ROW or session.results.comparison is None:
        return None
    found = np.flatnonzero(data.row == session.results.comparison.number[session.results.row])
    return int(found[0]) if len(found) else None


@lru_cache(maxsize=4)
def _frames_aside(fit: Fit) -> tuple[tuple[str, ...], Robot, Float[np.ndarray, "f k"]]:
    """The arm's constants, the arm, and what frames do of what these constants do at the measured poses."""
    names = tuple(p.name for p in fit.problem.parameters if p.is_geometry)
    robot = fit.calibrated.in_session(fit.problem.data.sessions[0])
    both = columns(robot, Motion.of(fit.problem.data), names)
    mine, frames = (each[:, :3].reshape(-1, each.shape[2]) for each in both)
    return names, robot, by_frames(mine, frames)
