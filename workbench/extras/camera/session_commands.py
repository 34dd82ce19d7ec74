"""What pictures are in the session, and its commands: load a folder as one archive, or take pictures live."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NamedTuple, final

import numpy as np
from jaxtyping import Float

from workbench.base.errors import DataError, WorkbenchError
from workbench.base.progress import part_of, progress
from workbench.base.wording import plural
from workbench.data.dataset import Dataset
from workbench.data.readers.fields import Fields
from workbench.extras.camera.camera import ON
from workbench.extras.camera.corner_detection import PixelRows
from workbench.extras.camera.folder import only_folder, packed, read_folder, shown_pictures, unpacked
from workbench.extras.camera.markers import MIN_FOUND
from workbench.extras.camera.pixel_table import pixel_data, plain_names
from workbench.extras.camera.preparation import MIN_PICTURES
from workbench.extras.camera.printed import Board
from workbench.extras.camera.rig import PictureReadings, Rig, read_rig, rig_of
from workbench.identification.identify import identify
from workbench.identification.result import Identification
from workbench.session.command import AbstractChange, AbstractLoad, AbstractTask, computed
from workbench.session.commands.data import as_files, matched_to_arm, safe_name, too_large, with_other_data
from workbench.session.loaded_measurements import Loaded
from workbench.session.page_state import Severity
from workbench.session.part import AbstractPart, GoesWith
from workbench.session.state import Session

LARGEST_FOLDER = 256 * 1024 * 1024
"""Archives beyond this size are refused [bytes]."""
SEARCH = 0.9
"""Part of the work that is the search for corners."""
SHARP = 2.0
"""Blur of a picture [px, standard deviation] from which on it is not kept."""


@dataclass(frozen=True, eq=False)
class Previews(AbstractPart):
    """Small JPEG of every measured picture, by camera and image."""

    by_image: Mapping[tuple[str, str], bytes]
    goes_with = GoesWith.MEASUREMENTS


@final
@dataclass(frozen=True, eq=False)
class CameraAlone(AbstractPart):
    """What pictures with poses of the tool tell: where camera and target are, and nothing of the arm.

    Args:
        data: The pictures.
        found: The poses.
        previews: The pictures to be looked at.
    """

    goes_with = GoesWith.MEASUREMENTS
    conclusion = "Camera and target are found. To calibrate the arm too, give the joints of each picture."

    data: Dataset
    found: Identification
    previews: Previews


class Read(NamedTuple):
    """Pictures that were read; as measurements of the arm, if they are, and what else is kept of them."""

    data: Dataset
    loaded: Loaded | None
    kept: Previews | CameraAlone

    def used(self, session: Session, how: str) -> Session:
        """The session with these in place of its measurements."""
        session = with_other_data(session, self.loaded).with_part(self.kept)
        return session.with_message(Severity.INFO, f"{plural(len(self.data), 'picture')} {how}")


def _measured(session: Session, data: Dataset, pictures: Mapping[tuple[str, str], bytes]) -> Read:
    """Pictures as measurements, with how well they and the arm go together."""
    own = PictureReadings.of(data)
    rig, seen = own.rig, own.seen.sum((1, 2))
    cameras = (
        f"{c.name}, {c.size[0]} × {c.size[1]} px, {ON[c.mounted]}, intrinsics {c.free}" for c in rig.cameras
    )
    facts = (
        ("Pictures", f"{int((seen > 0).sum())} of {len(data)} show the target"),
        ("Corners", f"{int(seen.sum())}; {len(rig.rejected)} rejected"),
        ("Joints", f"{data.joints}"),
        ("Camera", "; ".join(cameras)),
        ("Target", f"{rig.text}, {ON[rig.mounted]}"),
    )
    loaded = Loaded(data, data.source, facts, data.notes, read=data)
    return Read(data, matched_to_arm(session.robot, loaded), Previews(pictures))


class LoadPictures(AbstractLoad[Read]):
    """Read pictures (or the corners found in them), joints, cameras and target, and replace the measurements.

    Args:
        name: Name of the archive.
        content: A ZIP or tar archive of the folder.
        board: What it shows where the archive does not say: squares of this side, as many as are counted in
            the pictures; the lens is then found from these, too.
    """

    name: str
    content: bytes = field(repr=False)
    board: Board | None = None
    endings = (".tar", ".zip")

    title = computed(lambda self: f"Read {safe_name(self.name)}")

    def check(self, session: Session) -> None:
        if len(self.content) > LARGEST_FOLDER:
            text = too_large(self.name, len(self.content), LARGEST_FOLDER)
            raise DataError(f"{text}; use 'workbench identify FOLDER' for larger ones")

    def compute(self, session: Session) -> Read:
        name = safe_name(self.name)
        with unpacked(name, self.content) as folder:
            try:
                progress(0.0, "looking for the board")
                assumed = () if self.board is None else self.board.fill_in(only_folder(folder))
                with part_of(0.0, SEARCH):
                    dataset = read_folder(folder, dof=session.robot.dof)
                progress(SEARCH, "making small pictures")
                pictures = shown_pictures(folder, rig_of(dataset))
            except WorkbenchError as error:
                raise DataError(str(error).replace(f"{folder}/", "").replace(str(folder), name)) from error
        name = name.removesuffix(".tar").removesuffix(".zip")
        dataset = replace(dataset, source=name, notes=(*assumed, *dataset.notes))
        if rig_of(dataset).tool_poses:
            return Read(dataset, None, CameraAlone(dataset, identify(None, dataset), Previews(pictures)))
        return _measured(session, dataset, pictures)

    def finish(self, session: Session, result: Read) -> Session:
        return result.used(session, f"read from {result.data.source}")

    @classmethod
    def packed(cls, folder: Path) -> tuple[str, bytes]:
        return f"{folder.resolve().name}.tar", packed(folder)


@dataclass(frozen=True)
class Shot:
    """One picture.

    Args:
        name: Of its file.
        camera: That took it.
        picture: As a small JPEG.
        ids: Of tags, or of a board's corners.
        corners: Numbers of the tags' corners.
        uv: Where they are [px].
        reason: Why nothing was found; "" if something was.
        blur: How wide edges are [px].
        still: Whether camera, target and arm stood still.
        q: Joint positions [rad or m]; None where nobody said.
    """

    name: str
    camera: str
    picture: bytes
    ids: tuple[int, ...] = ()
    corners: tuple[int, ...] = ()
    uv: tuple[tuple[float, float], ...] = ()
    reason: str = ""
    blur: float = 0.0
    still: bool = True
    q: tuple[float, ...] | None = None

    @property
    def refused(self) -> str:
        """Why it is not kept; "" where it is."""
        if self.reason or len(self.ids) < MIN_FOUND:
            return self.reason or f"it shows {plural(len(self.ids), 'corner')}; {MIN_FOUND} are needed"
        if self.blur > SHARP:
            return (
                f"it is blurred by {self.blur:.1f} px, more than {SHARP:g}: hold still, focus, or add light"
            )
        if self.q is None:
            return "its joints are unknown: connect the arm (--source), or add a row to the folder's CSV"
        return "" if self.still else "the target still moves, or has not moved since the last picture"


@dataclass(frozen=True, eq=False, kw_only=True)
class Capture(AbstractPart):
    """Pictures being taken.

    Args:
        source: Folder that is watched, or `device:N`.
        rig: Cameras and target.
        last: The newest picture, kept or not.
        kept: Those that are.
    """

    source: str
    rig: Rig
    last: Shot | None = None
    kept: tuple[Shot, ...] = ()

    def with_shot(self, shot: Shot) -> "Capture":
        """With a new picture; it takes the place of one of its name."""
        others = tuple(s for s in self.kept if (s.camera, s.name) != (shot.camera, shot.name))
        return replace(self, last=shot, kept=others if shot.refused else (*others, shot))

    def points(self, camera: str) -> Float[np.ndarray, "corners 2"]:
        """Corners of all kept pictures of a camera [px]."""
        return np.array([uv for s in self.kept if s.camera == camera for uv in s.uv]).reshape(-1, 2)

    def data(self, dof: int) -> Dataset:
        """The kept pictures as measurements."""
        count = [len(shot.ids) for shot in self.kept]
        rows = PixelRows(
            image=np.repeat([shot.name for shot in self.kept], count),
            camera=np.repeat([shot.camera for shot in self.kept], count),
            id=np.concatenate([shot.ids for shot in self.kept]),
            corner=np.concatenate([shot.corners for shot in self.kept]),
            uv=np.concatenate([shot.uv for shot in self.kept]),
            source=Path(self.source).name,
        )
        q = {f"q{k + 1}": column for k, column in enumerate(np.array([shot.q for shot in self.kept]).T)}
        image = np.array([shot.name for shot in self.kept])
        joints = Fields(source=rows.source, lines=(*range(len(image)),), values={"image": image, **q})
        return pixel_data(rows, self.rig, joints, dof=dof)


class BeginShooting(AbstractChange):
    """Take pictures of a target, from a watched folder or a device.

    Args:
        source: The folder, or `device:N`.
        camera: Content of `camera.toml`.
        target: Content of `target.toml`.
    """

    title = "Take pictures"

    source: str
    camera: bytes = field(repr=False)
    target: bytes = field(repr=False)

    def check(self, session: Session) -> None:
        self._rig()

    def apply(self, session: Session) -> Session:
        return session.with_part(Capture(source=self.source, rig=self._rig()))

    def _rig(self) -> Rig:
        with as_files({"camera.toml": self.camera, "target.toml": self.target}) as paths:
            return read_rig(*paths)


def _capture(session: Session) -> Capture:
    if (capture := session.part(Capture)) is None:
        raise DataError("no pictures are being taken")
    return capture


class TakeShot(AbstractChange):
    """Process a picture: kept if it is sharp, shows the target, and its joints are known."""

    is_automatic = True

    shot: Shot

    title = computed(lambda self: f"Picture {self.shot.name}")

    def check(self, session: Session) -> None:
        _capture(session)
        if self.shot.q is not None and len(self.shot.q) != session.robot.dof:
            raise DataError(
                f"picture {self.shot.name} has {len(self.shot.q)} joints, the robot {session.robot.dof}"
            )

    def apply(self, session: Session) -> Session:
        return session.with_part(_capture(session).with_shot(self.shot))


class DropShot(AbstractChange):
    """Drop the picture that was kept last, to take it again."""

    title = "Take the picture again"

    def check(self, session: Session) -> None:
        if not _capture(session).kept:
            raise DataError("no picture has been kept yet")

    def apply(self, session: Session) -> Session:
        capture = _capture(session)
        return session.with_part(replace(capture, kept=capture.kept[:-1], last=None))


class EndShooting(AbstractChange):
    """Stop, and drop the pictures."""

    title = "Stop taking pictures"

    def apply(self, session: Session) -> Session:
        return session.without_part(Capture)


class UseShots(AbstractTask[Read]):
    """The kept pictures become the session's measurements."""

    title = "Use the pictures"

    def check(self, session: Session) -> None:
        if (kept := len(_capture(session).kept)) < MIN_PICTURES:
            raise DataError(f"{plural(kept, 'picture')} kept; take at least {MIN_PICTURES}")

    def compute(self, session: Session) -> Read:
        capture = _capture(session)
        pictures = {(s.camera, plain_names([s.name])[0]): s.picture for s in capture.kept}
        return _measured(session, capture.data(session.robot.dof), pictures)

    def finish(self, session: Session, result: Read) -> Session:
        return result.used(session.without_part(Capture), "taken")
