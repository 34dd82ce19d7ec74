"""What pictures are in the session: the command that loads a folder of them as a ZIP archive."""

from dataclasses import field, replace
from pathlib import Path

from workbench.base.errors import DataError, WorkbenchError
from workbench.base.wording import plural
from workbench.extras.camera.camera import ON
from workbench.extras.camera.folder import packed, read_folder, unpacked
from workbench.extras.camera.rig import PictureReadings, rig_of
from workbench.session.command import AbstractLoad, computed
from workbench.session.commands.data import matched_to_arm, safe_name, too_large, with_other_data
from workbench.session.loaded_measurements import Loaded
from workbench.session.page_state import Severity
from workbench.session.state import Session

LARGEST_FOLDER = 256 * 1024 * 1024
"""Archives beyond this size are refused [bytes]."""


class LoadPictures(AbstractLoad[Loaded]):
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

    def compute(self, session: Session) -> Loaded:
        """The pictures as measurements, with how well they and the arm go together."""
        name = safe_name(self.name)
        with unpacked(name, self.content) as folder:
            try:
                data = read_folder(folder, dof=session.robot)
            except WorkbenchError as error:
                raise DataError(str(error).replace(f"{folder}/", "").replace(str(folder), name)) from error
        data, rig = replace(data, source=name.removesuffix(".zip")), rig_of(data)
        if rig.tool_poses:
            why = f"{name} has poses of the tool in place of joints, which tell nothing of the arm"
            alone = "find camera and target alone with 'workbench identify FOLDER --target FILE'"
            raise DataError(f"{why}: give the joints, or {alone}")
        seen = PictureReadings.of(data).seen.sum((1, 2))
        shown = f"{int((seen > 0).sum())} of {len(data)} show the target, {int(seen.sum())} corners"
        cameras = (f"{c.name}, {ON[c.mounted]}, intrinsics {c.free}" for c in rig.cameras)
        target = f"{rig.text}, {ON[rig.mounted]}"
        facts = ("Pictures", shown), ("Camera", "; ".join(cameras)), ("Target", target)
        return matched_to_arm(session.robot, Loaded(data, data.source, facts, data.notes, read=data))

    def finish(self, session: Session, result: Loaded) -> Session:
        text = f"{plural(len(result.dataset), 'picture')} read from {result.dataset.source}"
        return with_other_data(session, result).with_message(Severity.INFO, text)

    @classmethod
    def packed(cls, folder: Path) -> tuple[str, bytes]:
        return f"{folder.resolve().name}.zip", packed(folder)
