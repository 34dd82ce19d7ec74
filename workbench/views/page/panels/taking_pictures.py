"""Taking pictures: the newest one with what was found in it, how sharp it is, and how many are kept."""

from pathlib import Path

import numpy as np
import viser

from workbench.base.files import read_bytes
from workbench.base.wording import counted
from workbench.session.camera_view import CameraView, cells
from workbench.session.commands.pictures import BeginShooting, DropShot, EndShooting, UseShots
from workbench.session.state import Session
from workbench.session.taking_pictures import SHARP, Shooting, Shot
from workbench.views.page.html import BAD, CAREFUL, GOOD, badge, block, note, text
from workbench.views.page.panels.cameras import covered, picture_of
from workbench.views.page.panels.panel import AbstractPanel

HOW = (
    "Every picture that appears in the folder (or every still one of the device) is looked at. The folder "
    "holds camera.toml and target.toml; joints come from the connected arm, or from a CSV beside them."
)


class ShootingPanel(AbstractPanel):
    """A closed folder: what is watched, the newest picture, and what to do with those that are kept."""

    depends = ("shooting", "is_idle")

    def build(self, gui: viser.GuiApi) -> None:
        with gui.add_folder("Take pictures", expand_by_default=False):
            self._folder = gui.add_text(
                "Folder", "", hint="On this machine, with camera.toml and target.toml."
            )
            self._device = gui.add_text(
                "Device", "", hint="Number of a camera, such as 0; empty: the folder is watched."
            )
            self._begin = self.button(
                "Watch",
                self._watch,
                viser.Icon.CAMERA,
                "Look at every new picture, and keep it if it is good.",
                main=True,
            )
            self._seen = gui.add_html("")
            self._again = self.button(
                "Drop the last", DropShot, viser.Icon.ROTATE, "Drop the last kept picture and take it again."
            )
            self._use = self.button(
                UseShots.title,
                UseShots,
                viser.Icon.DATABASE,
                "End here: the kept pictures become the session's measurements.",
                main=True,
            )
            self._stop = self.button(
                EndShooting.title, EndShooting, viser.Icon.X, "End here and drop the pictures."
            )

    def show(self, session: Session) -> None:
        shooting = session.shooting
        self._begin.visible = shooting is None
        for button in (self._again, self._use, self._stop):
            button.visible = shooting is not None
        seen = (
            "" if shooting is None else block(_shown(shooting), testid="shooting", style="margin:4px 0 8px")
        )
        self._seen.content = seen or note(HOW, "shooting")

    def _watch(self) -> BeginShooting:
        folder, device = Path(str(self._folder.value).strip()).expanduser(), str(self._device.value).strip()
        names = ("camera", "target")
        files = (read_bytes(folder / f"{name}.toml", wanted=f"a {name} TOML") for name in names)
        return BeginShooting(f"device:{device}" if device else str(folder), *files)


def _shown(shooting: Shooting) -> str:
    """The newest picture, what is said of it, and what has been kept."""
    camera, shot = shooting.rig.cameras[0], shooting.last
    head = f'<div style="font-weight:600">{counted(len(shooting.kept), "picture")} kept</div>'
    if shot is None:
        words = f"<div>Watching {text(shooting.source)}: no picture yet.</div>"
    else:
        words = f"{_verdict(shot)}{picture_of(_view(shot, camera.size))}"
        words += covered(cells(shooting.points(camera.name), camera.size))
    return block(head + words, testid="shooting", style="margin:4px 0 8px")


def _verdict(shot: Shot) -> str:
    sharp = badge(f"Blur {shot.blur:.1f} px", GOOD if shot.blur <= SHARP else CAREFUL)
    found = f"{text(shot.name)}: {counted(len(shot.ids), 'corner')} · {sharp}"
    reason = f'<div style="color:{BAD}">Not kept: {text(shot.refused)}.</div>' if shot.refused else ""
    return f"<div>{found}</div>{reason}"


def _view(shot: Shot, size: tuple[int, int]) -> CameraView:
    uv = np.array(shot.uv, float).reshape(-1, 2)
    return CameraView(
        name=shot.camera,
        size=size,
        pose=np.eye(4),
        focal=np.ones(2),
        target=np.zeros((0, 3)),
        predicted=np.full_like(uv, np.nan),
        measured=uv,
        picture=shot.picture,
    )
