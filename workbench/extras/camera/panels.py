"""Pictures of a board on the page: given or taken, what was found in them, and what they may identify."""

import base64
import json
from collections.abc import Mapping

import viser

from workbench.base.errors import DataError
from workbench.data.dataset import Dataset
from workbench.extras.camera.camera import ON
from workbench.extras.camera.findings import Identifiability
from workbench.extras.camera.folder import says_target
from workbench.extras.camera.printed import Board, across_down, board_pdf
from workbench.extras.camera.rig import PictureReadings, rig_of
from workbench.extras.camera.session_commands import LARGEST_FOLDER, CameraAlone, LoadPictures, Previews
from workbench.identification.report.results_json import identification_json
from workbench.identification.result import Identification
from workbench.report.blocks import ResultTable
from workbench.report.result_display import as_html
from workbench.session.commands.identify import Identify
from workbench.session.page_state import Tab
from workbench.session.state import Session
from workbench.views.page.html import BAD, CAREFUL, GOOD, badge, block, bullets, folded, heading, note, text
from workbench.views.page.panels.panel import AbstractPanel, Door, Question, set_value

CARRIERS = {place: mount for mount, place in ON.items()}
HOW_TO_TAKE = (
    "Take 15 to 30 pictures from different directions, with the arm at rest. Add a table with one row per "
    "picture: image, q1[deg] … of the joints; or image, x[mm], y[mm], z[mm], qw, qx, qy, qz of the tool, "
    "which identifies camera and target only."
)
PICTURES = (
    "Choose the robot, then its pictures, with a table of the joints beside them. None yet? Look around: the "
    "Measure tab has a board to print."
)
TELLING_CORNERS = 8
"""Corners from which on a picture tells much."""


class PictureFields:
    """What is asked of a board, and what takes its pictures: in the panel, and on the start card."""

    def __init__(self, panel: AbstractPanel, gui: viser.GuiApi):
        board = Board()
        squares = f"{board.across}x{board.down}"
        self._squares = panel.line("Squares", "Across x down.", value=squares)
        self._side = panel.number(
            "Square [mm]",
            (5.0, 200.0, 0.1),
            "Side of a square, as measured on the print.",
            unit=1e-3,
            value=1e3 * board.square,
        )
        self._carrier = panel.dropdown("Board is", CARRIERS, "The camera is on the other.")

    @property
    def board(self) -> Board:
        """As it is described."""
        return Board(*across_down(self._squares.typed), self._side.typed, self._carrier.typed)

    def show(self, data: Dataset) -> None:
        """The board of pictures that were read."""
        rig = rig_of(data)
        set_value(self._carrier.control, ON[rig.mounted])
        if (board := rig.targets[0].charuco) is not None:
            set_value(self._side.control, 1e3 * board.square)
            set_value(self._squares.control, "{}x{}".format(*board.squares))

    def build_upload(self, panel: AbstractPanel, gui: viser.GuiApi) -> None:
        """What takes a ZIP archive of the folder of the pictures."""
        panel.upload(
            "Pictures in a folder (ZIP)",
            lambda name, content: LoadPictures(name, content, self.board),
            "Pictures of a board or of tags, or a table of their corners, and a table of the joints with "
            "a column 'image'. Without target.toml the board is as above. Up to "
            f"{LARGEST_FOLDER // 2**20} MiB.",
            endings=".zip",
            maximum=LARGEST_FOLDER,
            question=Question("Is this the board?", self._assumed, "Read with this board"),
        )

    def _assumed(self, name: str, content: bytes) -> str:
        """What is taken for the board of pictures without `target.toml`, as a question."""
        question = f"No target.toml is beside the pictures. Is it {self.board.text}?"
        return "" if says_target(content) else question


def _alone(session: Session) -> CameraAlone | None:
    return session.part(CameraAlone)


class CamerasPanel(AbstractPanel):
    """Step by step: a board to print, the pictures, what was found of them."""

    tab, order = Tab.MEASURE, 30
    build_door = staticmethod(lambda panel, gui: PictureFields(panel, gui).build_upload(panel, gui))
    door = Door("Pictures of a board", viser.Icon.CAMERA, Identify, asks=PICTURES, build=build_door)
    depends = ("results", "measurements.loaded", _alone)
    _read: Dataset | None = None

    def build(self, gui: viser.GuiApi) -> None:
        with gui.add_folder("Pictures of a board", expand_by_default=True):
            with gui.add_folder("Your board, or one to print", expand_by_default=True):
                self._fields = fields = PictureFields(self, gui)

                def printed(_: Session) -> tuple[str, bytes]:
                    return "board.pdf", board_pdf(fields.board.charuco)[0]

                self.download("Board (PDF)", printed, "To print at 100 %.")
            gui.add_html(note(HOW_TO_TAKE, "steps-of-pictures"))
            fields.build_upload(self, gui)
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
        if data is not None and not isinstance(data.readings, PictureReadings):
            data = None
        if data is not None and data is not self._read:
            self._fields.show(data)
        self._read, seen, gate = data, "", ""
        previews = session.part(Previews)
        result = session.results.identification if alone is None else alone.found
        if data is not None:
            seen = thumbnails(data, previews.by_image if previews else {})
            gate = _identified(result, is_alone=alone is not None)
        self._seen.content, self._gate.content = seen, gate
        self._save.visible = data is not None and result is not None


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
