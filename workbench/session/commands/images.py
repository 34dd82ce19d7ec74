"""Commands for pictures: load a folder as one archive, or take pictures live."""

import tempfile
from dataclasses import field, replace
from pathlib import Path
from typing import Any

import numpy as np

from workbench.base.errors import DataError, WorkbenchError
from workbench.base.progress import Cancel
from workbench.base.wording import plural
from workbench.data.camera.camera import Mount
from workbench.data.camera.folder import read_folder
from workbench.data.camera.pixel_table import plain_names
from workbench.data.camera.rig import Rig, read_rig
from workbench.data.dataset import Dataset
from workbench.session.command import AbstractChange, AbstractTask, Progress, computed
from workbench.session.commands.data import matched_to_arm, safe_name, too_large, with_data
from workbench.session.image_capture import Shooting, Shot
from workbench.session.loaded_measurements import Loaded
from workbench.session.state import Session, Severity

LARGEST_FOLDER = 256 * 1024 * 1024
"""Archives beyond this size are refused [bytes]."""
ON = {Mount.TOOL: "on the tool", Mount.WORLD: "in the cell"}
SEARCH = 0.9
"""Part of the work that is the search for corners."""


class LoadPictures(AbstractTask):
    """Read pictures (or the corners found in them), joints, cameras and target, and replace the measurements.

    Args:
        name: Name of the archive.
        content: A ZIP or tar archive of the folder.
    """

    name: str
    content: bytes = field(repr=False)

    title = computed(lambda self: f"Read {safe_name(self.name)}")

    def check(self, session: Session) -> None:
        if len(self.content) > LARGEST_FOLDER:
            words = too_large(self.name, len(self.content), LARGEST_FOLDER)
            raise DataError(f"{words}; use 'workbench identify FOLDER' for larger ones")

    def compute(self, session: Session, *, progress: Progress, cancel: Cancel) -> Any:
        from workbench.data.camera.folder import read_folder, shown_pictures, unpacked

        name = safe_name(self.name)
        with unpacked(name, self.content) as folder:
            try:
                dataset = read_folder(
                    folder, dof=session.robot.dof, progress=lambda part, words: progress(SEARCH * part, words)
                )
                assert dataset.rig is not None, "a folder of pictures has cameras"
                progress(SEARCH, "making small pictures")
                pictures = shown_pictures(folder, dataset.rig)
            except WorkbenchError as error:
                raise DataError(str(error).replace(f"{folder}/", "").replace(str(folder), name)) from error
        name = name.removesuffix(".tar").removesuffix(".zip")
        found = Loaded(dataset, name, facts_of(dataset), read=dataset, pictures=pictures)
        return matched_to_arm(session.robot, found)

    def finish(self, session: Session, result: Any) -> Session:
        rows = plural(len(result.dataset), "picture")
        return with_data(session, result).tell(Severity.INFO, f"{rows} read from {result.name}")


def facts_of(data: Dataset) -> tuple[tuple[str, str], ...]:
    """Pairs of a heading and what was understood."""
    rig, pixels = data.rig, data.pixels
    assert rig is not None, "pictures have cameras"
    assert pixels is not None, "they come together"
    seen = np.isfinite(pixels[..., 0]).sum((1, 2))
    cameras = [
        f"{c.name}, {c.size[0]} × {c.size[1]} px, {ON[c.mounted]}, intrinsics {c.free}" for c in rig.cameras
    ]
    return (
        ("Pictures", f"{int((seen > 0).sum())} of {len(data)} show the target"),
        ("Corners", f"{int(seen.sum())}; {len(rig.apart)} set apart as wrong"),
        ("Joints", f"{data.joints}"),
        ("Camera", "; ".join(cameras)),
        ("Target", f"{rig.words}, {ON[rig.mounted]}"),
    )


FEWEST = 4
"""Pictures that are enough to be used."""


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
        return replace(session, shooting=Shooting(source=self.source, rig=self._rig()))

    def _rig(self) -> Rig:
        with tempfile.TemporaryDirectory(prefix="workbench-") as folder:
            paths = Path(folder, "camera.toml"), Path(folder, "target.toml")
            for path, content in zip(paths, (self.camera, self.target), strict=True):
                path.write_bytes(content)
            return read_rig(*paths)


class TakeShot(AbstractChange):
    """Process a picture: kept if it is sharp, shows the target, and its joints are known."""

    is_automatic = True

    shot: Shot

    title = computed(lambda self: f"Picture {self.shot.name}")

    def check(self, session: Session) -> None:
        if session.shooting is None:
            raise DataError("no pictures are being taken")
        if self.shot.q is not None and len(self.shot.q) != session.robot.dof:
            raise DataError(
                f"picture {self.shot.name} has {len(self.shot.q)} joints, the robot {session.robot.dof}"
            )

    def apply(self, session: Session) -> Session:
        assert session.shooting is not None
        return replace(session, shooting=session.shooting.with_shot(self.shot))


class DropShot(AbstractChange):
    """Drop the picture that was kept last, to take it again."""

    title = "Take the picture again"

    def check(self, session: Session) -> None:
        if session.shooting is None or not session.shooting.kept:
            raise DataError("no picture has been kept yet")

    def apply(self, session: Session) -> Session:
        assert session.shooting is not None
        shooting = replace(session.shooting, kept=session.shooting.kept[:-1], last=None)
        return replace(session, shooting=shooting)


class EndShooting(AbstractChange):
    """Stop, and drop the pictures."""

    title = "Stop taking pictures"

    def apply(self, session: Session) -> Session:
        return replace(session, shooting=None)


class UseShots(AbstractTask):
    """The kept pictures become the session's measurements."""

    title = "Use the pictures"

    def check(self, session: Session) -> None:
        kept = 0 if session.shooting is None else len(session.shooting.kept)
        if kept < FEWEST:
            raise DataError(f"{plural(kept, 'picture')} kept; take at least {FEWEST}")

    def compute(self, session: Session, *, progress: Progress, cancel: Cancel) -> Any:
        shooting = session.shooting
        assert shooting is not None
        with tempfile.TemporaryDirectory(prefix="workbench-") as folder:
            shooting.write(Path(folder))
            dataset = read_folder(folder, dof=session.robot.dof)
        dataset = replace(dataset, source=Path(shooting.source).name)
        pictures = {(s.camera, plain_names([s.name])[0]): s.picture for s in shooting.kept}
        found = Loaded(dataset, dataset.source, facts_of(dataset), read=dataset, pictures=pictures)
        return matched_to_arm(session.robot, found)

    def finish(self, session: Session, result: Any) -> Session:
        session = replace(with_data(session, result), shooting=None)
        return session.tell(Severity.INFO, f"{plural(len(result.dataset), 'picture')} taken")
