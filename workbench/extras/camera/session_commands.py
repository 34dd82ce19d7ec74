"""What pictures are in the session, and the command that loads a folder of them as a ZIP archive."""

import contextlib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NamedTuple, final

import numpy as np

from workbench.base.errors import DataError, FileError, WorkbenchError
from workbench.base.progress import part_of, progress
from workbench.base.wording import plural
from workbench.data.dataset import Dataset
from workbench.extras.camera.camera import ON, opencv
from workbench.extras.camera.folder import only_folder, packed, read_folder, unpacked
from workbench.extras.camera.picture_files import picture_files, read_picture
from workbench.extras.camera.pixel_table import plain_names
from workbench.extras.camera.rig import PictureReadings, rig_of
from workbench.identification.identify import identify
from workbench.identification.result import Identification
from workbench.session.command import AbstractLoad, computed
from workbench.session.commands.data import matched_to_arm, safe_name, too_large, with_other_data
from workbench.session.loaded_measurements import Loaded
from workbench.session.page_state import Severity
from workbench.session.part import AbstractPart, GoesWith
from workbench.session.state import Session

LARGEST_FOLDER = 256 * 1024 * 1024
"""Archives beyond this size are refused [bytes]."""
SEARCH = 0.9
"""Part of the work that is the search for corners."""
FOUND = (94, 197, 34)
"""Colour (blue, green, red) of corners as found."""
WIDTH = 160
"""Of a picture [px]."""
MAX_PICTURES = 200
"""Pictures that are shown."""
SUBPIXEL = 4
"""Binary digits of parts of a pixel in OpenCV's drawings."""


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
    """

    goes_with = GoesWith.MEASUREMENTS
    conclusion = "Camera and target are found. To calibrate the arm too, give the joints of each picture."

    data: Dataset
    found: Identification


class Read(NamedTuple):
    """Pictures that were read; as measurements of the arm, or what they tell without it, and small ones."""

    data: Dataset
    loaded: Loaded | None
    kept: tuple[AbstractPart, ...]


def _measured(session: Session, data: Dataset) -> Loaded:
    """Pictures as measurements, with how well they and the arm go together."""
    own = PictureReadings.of(data)
    seen = own.seen.sum((1, 2))
    cameras = (f"{c.name}, {ON[c.mounted]}, intrinsics {c.free}" for c in own.rig.cameras)
    facts = (
        ("Pictures", f"{int((seen > 0).sum())} of {len(data)} show the target, {int(seen.sum())} corners"),
        ("Camera", "; ".join(cameras)),
        ("Target", f"{own.rig.text}, {ON[own.rig.mounted]}"),
    )
    return matched_to_arm(session.robot, Loaded(data, data.source, facts, data.notes, read=data))


def small_pictures(folder: Path, data: Dataset) -> dict[tuple[str, str], bytes]:
    """Small JPEG of the pictures of a folder, by camera and image, with rings about their corners."""
    cv2, own, found = opencv(), PictureReadings.of(data), {}
    cameras = {camera.name: (c, camera.size) for c, camera in enumerate(own.rig.cameras)}
    rows = {str(image): k for k, image in enumerate(own.image)}
    with contextlib.suppress(FileError):  # a table of corners has no pictures, and some can't be read
        for name, path in [*picture_files(only_folder(folder), own.rig)][:MAX_PICTURES]:
            image, (camera, size) = plain_names([path.name])[0], cameras[name]
            small = WIDTH, round(size[1] * WIDTH / size[0])
            with contextlib.suppress(FileError):
                drawn = cv2.resize(read_picture(path, size), small, interpolation=cv2.INTER_AREA)
                drawn = cv2.cvtColor(drawn, cv2.COLOR_GRAY2BGR)
                pixels = own.pixels[rows[image], camera] if image in rows else np.zeros((0, 2))
                scaled = pixels[np.isfinite(pixels).all(1)] * WIDTH / size[0]
                for u, v in np.round(scaled * 2.0**SUBPIXEL).astype(int).tolist():
                    cv2.circle(drawn, (u, v), 4 << SUBPIXEL, FOUND, 1, cv2.LINE_AA, SUBPIXEL)
                found[name, image] = cv2.imencode(".jpg", drawn)[1].tobytes()
    return found


class LoadPictures(AbstractLoad[Read]):
    """Read pictures (or the corners found in them), joints, cameras and target, and replace the measurements.

    Args:
        name: Name of the archive.
        content: A ZIP archive of the folder.
    """

    name: str
    content: bytes = field(repr=False)
    endings = (".zip",)

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
                with part_of(0.0, SEARCH):
                    dataset = read_folder(folder, dof=session.robot.dof)
                progress(SEARCH, "making small pictures")
                previews = Previews(small_pictures(folder, dataset))
            except WorkbenchError as error:
                raise DataError(str(error).replace(f"{folder}/", "").replace(str(folder), name)) from error
        name = name.removesuffix(".zip")
        dataset = replace(dataset, source=name)
        if rig_of(dataset).tool_poses:
            return Read(dataset, None, (previews, CameraAlone(dataset, identify(None, dataset))))
        return Read(dataset, _measured(session, dataset), (previews,))

    def finish(self, session: Session, result: Read) -> Session:
        session = with_other_data(session, result.loaded)
        for part in result.kept:
            session = session.with_part(part)
        text = f"{plural(len(result.data), 'picture')} read from {result.data.source}"
        return session.with_message(Severity.INFO, text)

    @classmethod
    def packed(cls, folder: Path) -> tuple[str, bytes]:
        return f"{folder.resolve().name}.zip", packed(folder)
