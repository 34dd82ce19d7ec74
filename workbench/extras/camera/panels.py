"""Pictures of a board on the page: what was found in them, and what they may identify."""

import base64
import json
from collections.abc import Mapping

import viser

from workbench.base.errors import DataError
from workbench.data.dataset import Dataset
from workbench.extras.camera.findings import Identifiability
from workbench.extras.camera.rig import PictureReadings
from workbench.extras.camera.session_commands import LARGEST_FOLDER, CameraAlone, LoadPictures, Previews
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
    "with one row per picture: image, q1[deg] … of the joints; or image, x[mm], y[mm], z[mm], qw, qx, qy, qz "
    "of the tool, which identifies camera and target only."
)
PICTURES = "Choose the robot, then a ZIP of its pictures with target.toml and a table of the joints."
TELLING_CORNERS = 8
"""Corners from which on a picture tells much."""


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


def _alone(session: Session) -> CameraAlone | None:
    return session.part(CameraAlone)


class CamerasPanel(AbstractPanel):
    """How to take pictures, the pictures, and what was found of them."""

    tab, order = Tab.MEASURE, 30
    build_door = staticmethod(upload)
    door = Door("Pictures of a board", viser.Icon.CAMERA, Identify, asks=PICTURES, build=build_door)
    depends = ("results", "measurements.loaded", _alone)

    def build(self, gui: viser.GuiApi) -> None:
        with gui.add_folder("Pictures of a board", expand_by_default=True):
            gui.add_html(note(HOW_TO_TAKE, "steps-of-pictures"))
            upload(self, gui)
            self._seen = gui.add_html("")
            self._gate = gui.add_html("")
            self._save = self.download(
                "Camera and target (JSON)",
                camera_json,
                "Poses, lenses and zeros with their standard errors, in SI units and degrees.",
            )

    def show(self, session: Session) -> None:
        alone, loaded = _alone(session), session.measurements.loaded
        data = alone.data if alone is not None else None if loaded is None else loaded.dataset
        result, previews = (
            session.results.identification if alone is None else alone.found,
            session.part(Previews),
        )
        is_pictures, seen, gate = data is not None and isinstance(data.readings, PictureReadings), "", ""
        if is_pictures:
            seen = thumbnails(data, previews.by_image if previews else {})
            gate = _identified(result, is_alone=alone is not None)
        self._seen.content, self._gate.content = seen, gate
        self._save.visible = is_pictures and result is not None


def camera_json(session: Session) -> tuple[str, bytes]:
    """What was found of cameras, target and arm, as `identify --json` writes it."""
    alone = _alone(session)
    found = session.results.identification if alone is None else alone.found
    if found is None:
        raise DataError("camera and target are not identified yet")
    return "camera.json", json.dumps(identification_json(found), indent=1).encode()


def thumbnails(data: Dataset, pictures: Mapping[tuple[str, str], bytes]) -> str:
    """Small pictures, framed green, amber with few corners, or red."""
    own, found = PictureReadings.of(data), []
    seen = dict(zip(map(str, own.image), own.seen.sum(2), strict=True))
    number = {camera.name: c for c, camera in enumerate(own.rig.cameras)}
    for (camera, image), content in pictures.items():
        count = int(seen[image][number[camera]]) if image in seen else 0
        colour = GOOD if count >= TELLING_CORNERS else CAREFUL if count else BAD
        source = f"data:image/jpeg;base64,{base64.b64encode(content).decode()}"
        style = f"width:100%;border-radius:4px;display:block;outline:2px solid {colour}"
        label = f'<div style="font-size:12px;text-align:center">{text(image)} · {count}</div>'
        found.append(f'<div><img src="{source}" alt="rings: corners" style="{style}">{label}</div>')
    grid = "display:grid;grid-template-columns:repeat(4,1fr);gap:6px;margin:4px 0 8px"
    return block("".join(found), testid="thumbnails", style=grid)


def _identified(result: Identification | None, *, is_alone: bool = False) -> str:
    """The identification steps, and the poses of cameras and target."""
    if result is None or not isinstance(result.identifiability, Identifiability):
        sentence = "Not identified yet: camera and target are first guesses. Identify is in the next tab."
        return note(sentence, "gate")
    found = result.identifiability
    verdict = "Nothing of the arm was identified" if found.refused else f"Identified: {found.title}"
    if is_alone:
        verdict = "Camera and target found; tool poses contain no information on the joints"
    colour = BAD if found.refused and not is_alone else GOOD
    rows = [
        (s.name, f"{1e3 * s.expected:.2f} mm", f"{s.pixel:.2f} px", "no" if s.refused else "yes")
        for s in found.steps
    ]
    reasons = [f"{text(step.name)}: {text(step.refused)}" for step in found.steps if step.refused]
    notes = [*found.doubts, *([found.advice] if found.advice else [])]
    places = "".join(f"<div>{text(sentence)}</div>" for sentence in found.found(result.best.fit))
    return block(
        badge(verdict, colour)
        + heading("Step by step, at the tool")
        + as_html([ResultTable("", ("let go", "expected", "corners", "taken"), rows)])
        + bullets(reasons, style="margin:4px 0")
        + "".join(f'<div style="color:{CAREFUL}">{text(sentence)}</div>' for sentence in notes)
        + folded("Zeros, camera and target", places),
        testid="gate",
        style="margin:4px 0 8px",
    )
