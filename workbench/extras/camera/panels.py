"""Pictures of a board on the page: what they may identify."""

import json

import viser

from workbench.base.errors import DataError
from workbench.extras.camera.findings import Identifiability
from workbench.extras.camera.rig import PictureReadings
from workbench.extras.camera.session_commands import LARGEST_FOLDER, LoadPictures
from workbench.identification.report.results_json import identification_json
from workbench.identification.result import Identification
from workbench.report.blocks import ResultTable
from workbench.report.result_display import as_html
from workbench.session.commands.identify import Identify
from workbench.session.page_state import Tab
from workbench.session.state import Session
from workbench.views.page.html import BAD, CAREFUL, GOOD, badge, block, bullets, folded, heading, note, text
from workbench.views.page.panels.panel import AbstractPanel, Door

HOW_TO_TAKE = (
    "Print a board ('workbench board' writes its target.toml too). Take 15 to 30 pictures from different "
    "directions, with the arm at rest. Give a ZIP of the folder with the pictures, target.toml and a table "
    "with one row per picture: image, q1[deg] …"
)
PICTURES = "Choose the robot, then a ZIP of its pictures with target.toml and a table of the joints."


def upload(panel: AbstractPanel, gui: viser.GuiApi) -> None:
    """What takes a ZIP archive of the folder of the pictures: in the panel, and on the start card."""
    panel.upload(
        "Pictures in a folder (ZIP)",
        LoadPictures,
        "Pictures of a board or of tags, or a table of their corners, target.toml, and a table of the joints "
        f"with a column 'image'. Up to {LARGEST_FOLDER // 2**20} MiB.",
        endings=".zip",
        maximum=LARGEST_FOLDER,
    )


class CamerasPanel(AbstractPanel):
    """How to take pictures, and what was found of them."""

    tab, order = Tab.MEASURE, 30
    build_door = staticmethod(upload)
    door = Door("Pictures of a board", viser.Icon.CAMERA, Identify, asks=PICTURES, build=build_door)
    depends = ("results", "measurements.loaded")

    def build(self, gui: viser.GuiApi) -> None:
        with gui.add_folder("Pictures of a board", expand_by_default=True):
            gui.add_html(note(HOW_TO_TAKE, "steps-of-pictures"))
            upload(self, gui)
            self._gate = gui.add_html("")
            self._save = self.download(
                "Camera and target (JSON)",
                camera_json,
                "Poses, lenses and zeros with their standard errors, in SI units and degrees.",
            )

    def show(self, session: Session) -> None:
        loaded, result = session.measurements.loaded, session.results.identification
        is_pictures = loaded is not None and isinstance(loaded.dataset.readings, PictureReadings)
        self._gate.content = _identified(result) if is_pictures else ""
        self._save.visible = is_pictures and result is not None


def camera_json(session: Session) -> tuple[str, bytes]:
    """What was found of cameras, target and arm, as `identify --json` writes it."""
    if (found := session.results.identification) is None:
        raise DataError("camera and target are not identified yet")
    return "camera.json", json.dumps(identification_json(found), indent=1).encode()


def _identified(result: Identification | None) -> str:
    """The identification steps, and the poses of cameras and target."""
    if result is None or not isinstance(result.identifiability, Identifiability):
        sentence = "Not identified yet: camera and target are first guesses. Identify is in the next tab."
        return note(sentence, "gate")
    found = result.identifiability
    verdict = "Nothing of the arm was identified" if found.refused else f"Identified: {found.title}"
    rows = [
        (s.name, f"{1e3 * s.expected:.2f} mm", f"{s.pixel:.2f} px", "no" if s.refused else "yes")
        for s in found.steps
    ]
    reasons = [f"{text(step.name)}: {text(step.refused)}" for step in found.steps if step.refused]
    notes = [*found.doubts, *([found.advice] if found.advice else [])]
    places = "".join(f"<div>{text(sentence)}</div>" for sentence in found.found(result.best.fit))
    return block(
        badge(verdict, BAD if found.refused else GOOD)
        + heading("Step by step, at the tool")
        + as_html([ResultTable("", ("let go", "expected", "corners", "taken"), rows)])
        + bullets(reasons, style="margin:4px 0")
        + "".join(f'<div style="color:{CAREFUL}">{text(sentence)}</div>' for sentence in notes)
        + folded("Zeros, camera and target", places),
        testid="gate",
        style="margin:4px 0 8px",
    )
