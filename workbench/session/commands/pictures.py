"""The command that loads what cameras saw: a folder of pictures or of corners, as one archive."""

from dataclasses import field
from typing import Any

import numpy as np

from workbench.base.errors import DataError, WorkbenchError
from workbench.base.progress import Cancel
from workbench.base.wording import counted
from workbench.data.camera.camera import Mount
from workbench.data.dataset import Dataset
from workbench.session.command import AbstractTask, Progress, computed
from workbench.session.commands.data import matched, safe_name, with_data
from workbench.session.loaded import Loaded
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
            raise DataError(
                f"{safe_name(self.name)} has {len(self.content) / 2**20:.0f} MiB, but the page accepts up to "
                f"{LARGEST_FOLDER / 2**20:.0f} MiB; use 'workbench identify FOLDER' for larger ones"
            )

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
        return matched(session.robot, found)

    def finish(self, session: Session, result: Any) -> Session:
        rows = counted(len(result.dataset), "picture")
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
        ("Target", f"{rig.target.words}, {ON[rig.target.mounted]}"),
    )
