"""Commands for pictures: load a folder as one archive, or take pictures live."""

import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NamedTuple, final

from workbench.base.errors import DataError, WorkbenchError
from workbench.base.progress import part_of, progress
from workbench.base.wording import plural
from workbench.data.dataset import Dataset
from workbench.extras.camera.camera import ON
from workbench.extras.camera.capture import Capture, Previews, Shot
from workbench.extras.camera.folder import only_folder, packed, read_folder, shown_pictures, unpacked
from workbench.extras.camera.pixel_table import plain_names
from workbench.extras.camera.preparation import MIN_PICTURES
from workbench.extras.camera.readings import PictureReadings, rig_of
from workbench.extras.camera.rig import Rig, read_rig
from workbench.extras.camera.templates import Board
from workbench.identification.identify import identify
from workbench.identification.result import Identification
from workbench.session.command import AbstractChange, AbstractLoad, AbstractTask, computed
from workbench.session.commands.data import as_files, matched_to_arm, safe_name, too_large, with_other_data
from workbench.session.loaded_measurements import Loaded
from workbench.session.part import AbstractPart
from workbench.session.state import Session, Severity

LARGEST_FOLDER = 256 * 1024 * 1024
"""Archives beyond this size are refused [bytes]."""
SEARCH = 0.9
"""Part of the work that is the search for corners."""


class PictureFolder(NamedTuple):
    """Measurements from pictures, and these."""

    loaded: Loaded
    previews: Previews

    @classmethod
    def of(
        cls, session: Session, data: Dataset, name: str, pictures: Mapping[tuple[str, str], bytes]
    ) -> "PictureFolder":
        """With how well they and the arm go together."""
        found = Loaded(data, name, facts_of(data), data.notes, read=data)
        return cls(matched_to_arm(session.robot, found), Previews(pictures))

    def used(self, session: Session) -> Session:
        """The session with these measurements."""
        return with_other_data(session, self.loaded).with_part(self.previews)

    @property
    def text(self) -> str:
        """What was read."""
        return f"{plural(len(self.loaded.dataset), 'picture')} read from {self.loaded.name}"


@final
@dataclass(frozen=True, eq=False)
class CameraAlone(AbstractPart):
    """What pictures with poses of the tool tell: where camera and target are, and nothing of the arm.

    Args:
        data: The pictures.
        found: The poses.
        previews: The pictures to be looked at.
    """

    is_of_measurements = True
    conclusion = "Camera and target are found. To calibrate the arm too, give the joints of each picture."

    data: Dataset
    found: Identification
    previews: Previews

    def used(self, session: Session) -> Session:
        """The session with these poses, and without measurements of its arm."""
        return with_other_data(session, None).with_part(self)

    @property
    def text(self) -> str:
        """What was found."""
        pictures = plural(len(self.data), "picture")
        return f"camera and target are found from {pictures} of {self.data.source} with poses of the tool"


class LoadPictures(AbstractLoad[PictureFolder | CameraAlone]):
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

    def compute(self, session: Session) -> PictureFolder | CameraAlone:
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
            return CameraAlone(dataset, identify(None, dataset), Previews(pictures))
        return PictureFolder.of(session, dataset, name, pictures)

    def finish(self, session: Session, result: PictureFolder | CameraAlone) -> Session:
        return result.used(session).tell(Severity.INFO, result.text)

    @classmethod
    def packed(cls, folder: Path) -> tuple[str, bytes]:
        return f"{folder.resolve().name}.tar", packed(folder)


def facts_of(data: Dataset) -> tuple[tuple[str, str], ...]:
    """Pairs of a heading and what was understood."""
    own = PictureReadings.of(data)
    rig, seen = own.rig, own.seen.sum((1, 2))
    cameras = [
        f"{c.name}, {c.size[0]} × {c.size[1]} px, {ON[c.mounted]}, intrinsics {c.free}" for c in rig.cameras
    ]
    return (
        ("Pictures", f"{int((seen > 0).sum())} of {len(data)} show the target"),
        ("Corners", f"{int(seen.sum())}; {len(rig.rejected)} rejected"),
        ("Joints", f"{data.joints}"),
        ("Camera", "; ".join(cameras)),
        ("Target", f"{rig.text}, {ON[rig.mounted]}"),
    )


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


class TakeShot(AbstractChange):
    """Process a picture: kept if it is sharp, shows the target, and its joints are known."""

    is_automatic = True

    shot: Shot

    title = computed(lambda self: f"Picture {self.shot.name}")

    def check(self, session: Session) -> None:
        if session.part(Capture) is None:
            raise DataError("no pictures are being taken")
        if self.shot.q is not None and len(self.shot.q) != session.robot.dof:
            raise DataError(
                f"picture {self.shot.name} has {len(self.shot.q)} joints, the robot {session.robot.dof}"
            )

    def apply(self, session: Session) -> Session:
        capture = session.part(Capture)
        assert capture is not None
        return session.with_part(capture.with_shot(self.shot))


class DropShot(AbstractChange):
    """Drop the picture that was kept last, to take it again."""

    title = "Take the picture again"

    def check(self, session: Session) -> None:
        capture = session.part(Capture)
        if capture is None or not capture.kept:
            raise DataError("no picture has been kept yet")

    def apply(self, session: Session) -> Session:
        capture = session.part(Capture)
        assert capture is not None
        return session.with_part(replace(capture, kept=capture.kept[:-1], last=None))


class EndShooting(AbstractChange):
    """Stop, and drop the pictures."""

    title = "Stop taking pictures"

    def apply(self, session: Session) -> Session:
        return session.without_part(Capture)


class UseShots(AbstractTask[PictureFolder]):
    """The kept pictures become the session's measurements."""

    title = "Use the pictures"

    def check(self, session: Session) -> None:
        capture = session.part(Capture)
        kept = 0 if capture is None else len(capture.kept)
        if kept < MIN_PICTURES:
            raise DataError(f"{plural(kept, 'picture')} kept; take at least {MIN_PICTURES}")

    def compute(self, session: Session) -> PictureFolder:
        capture = session.part(Capture)
        assert capture is not None
        with tempfile.TemporaryDirectory(prefix="workbench-") as folder:
            capture.write(Path(folder))
            dataset = read_folder(folder, dof=session.robot.dof)
        dataset = replace(dataset, source=Path(capture.source).name)
        pictures = {(s.camera, plain_names([s.name])[0]): s.picture for s in capture.kept}
        return PictureFolder.of(session, dataset, dataset.source, pictures)

    def finish(self, session: Session, result: PictureFolder) -> Session:
        taken = plural(len(result.loaded.dataset), "picture")
        return result.used(session).without_part(Capture).tell(Severity.INFO, f"{taken} taken")
