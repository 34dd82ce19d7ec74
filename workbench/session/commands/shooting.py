"""Commands of pictures that are taken live: begin, take in a picture, take it again, use them."""

import tempfile
from dataclasses import field, replace
from pathlib import Path
from typing import Any

from workbench.base.errors import DataError
from workbench.base.progress import Cancel
from workbench.base.wording import counted
from workbench.data.camera.folder import read_folder
from workbench.data.camera.pixel_table import plain_names
from workbench.data.camera.rig import Rig, read_rig
from workbench.session.command import AbstractChange, AbstractTask, Progress, computed
from workbench.session.commands.data import matched, with_data
from workbench.session.commands.pictures import facts_of
from workbench.session.loaded import Loaded
from workbench.session.shooting import Shooting, Shot
from workbench.session.state import Session, Severity

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
    """Take in a picture: kept where it is sharp, shows the target, and its joints are known."""

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
            raise DataError(f"{counted(kept, 'picture')} kept; take at least {FEWEST}")

    def compute(self, session: Session, *, progress: Progress, cancel: Cancel) -> Any:
        shooting = session.shooting
        assert shooting is not None
        with tempfile.TemporaryDirectory(prefix="workbench-") as folder:
            shooting.write(Path(folder))
            dataset = read_folder(folder, dof=session.robot.dof)
        dataset = replace(dataset, source=Path(shooting.source).name)
        pictures = {(s.camera, plain_names([s.name])[0]): s.picture for s in shooting.kept}
        found = Loaded(dataset, dataset.source, facts_of(dataset), read=dataset, pictures=pictures)
        return matched(session.robot, found)

    def finish(self, session: Session, result: Any) -> Session:
        session = replace(with_data(session, result), shooting=None)
        return session.tell(Severity.INFO, f"{counted(len(result.dataset), 'picture')} taken")
