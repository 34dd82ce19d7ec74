"""Pictures of a board on the page: given or taken, what was found in them, and what they may identify."""

import json
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import viser

from workbench.base.errors import DataError
from workbench.base.files import read_bytes
from workbench.base.wording import plural
from workbench.data.dataset import Dataset
from workbench.extras.camera.camera import ON
from workbench.extras.camera.camera_view import CameraView, camera_views, cells, coverage
from workbench.extras.camera.folder import says_target
from workbench.extras.camera.picture_html import covered, drawn, thumbnails
from workbench.extras.camera.printed import Board, PrintedSheet, across_down
from workbench.extras.camera.rig import PictureReadings, rig_of
from workbench.extras.camera.selection_steps import Identifiability
from workbench.extras.camera.session_commands import (
    LARGEST_FOLDER,
    SHARP,
    BeginShooting,
    CameraAlone,
    Capture,
    DropShot,
    EndShooting,
    LoadPictures,
    Previews,
    Shot,
    UseShots,
)
from workbench.identification.report.results_json import identification_json
from workbench.identification.result import Identification
from workbench.session.commands.compare import ShowRow
from workbench.session.commands.identify import Identify
from workbench.session.page_state import Tab
from workbench.session.state import Session
from workbench.views.page.html import (
    BAD,
    CAREFUL,
    GOOD,
    LINE,
    MUTED,
    badge,
    block,
    bullets,
    folded,
    heading,
    note,
    number,
    table,
    text,
)
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
ENDING = ".tar,.zip"
"""File types of the upload button, by which the script finds the button's field."""
_SCRIPT = """
(async field => {
  const coder = new TextEncoder(), parts = [];
  const wanted = /\\.(png|jpe?g|bmp|tiff?|pgm|webp|csv|tsv|xlsx|parquet|toml)$/i;
  let folder = 'pictures';
  for (const file of field.files) {
    const way = (file.webkitRelativePath || file.name).split('/');
    if (way.length > 1) folder = way.shift();
    if (!wanted.test(file.name) || way.some(part => part.startsWith('.'))) continue;
    const head = new Uint8Array(512), put = (at, s) => head.set(coder.encode(s).slice(-100), at);
    put(0, way.join('/')); put(100, '0000644'); put(124, file.size.toString(8).padStart(11, '0'));
    put(136, '00000000000'); put(148, '        '); put(156, '0'); put(257, 'ustar'); put(263, '00');
    put(148, head.reduce((a, b) => a + b).toString(8).padStart(6, '0') + '\\0 ');
    parts.push(head, file, new Uint8Array((512 - file.size % 512) % 512));
  }
  parts.push(new Uint8Array(1024));
  const given = new DataTransfer(), place = field.closest('[role=dialog]') ?? document;
  const button = place.querySelector('input[accept="ENDING"]');
  given.items.add(new File(parts, folder + '.tar'));
  button.files = given.files;
  button.dispatchEvent(new Event('change', { bubbles: true }));
  field.value = '';
})(this)
""".replace("ENDING", ENDING)


def folder_field(label: str) -> str:
    """A field, in HTML, on which a folder is dropped or chosen.

    viser's upload button takes one file. A field for folders (`webkitdirectory`) lies over the label; what it
    is given is put into one tar archive in the page, and that archive into the button's own field.
    """
    return (
        '<div data-testid="folder" style="position:relative;margin:2px 12px 8px;padding:14px 10px;'
        f'border:1.5px dashed {LINE};border-radius:6px;text-align:center;font-size:13px;color:{MUTED}">'
        f'{text(label)}<input type="file" webkitdirectory multiple onchange="{text(_SCRIPT)}" '
        f'title="{text(label)}" style="position:absolute;inset:0;width:100%;height:100%;opacity:0;'
        'cursor:pointer"></div>'
    )


class PictureFields:
    """What is asked of a board, and what takes its pictures: in the panel, and on the start card."""

    def __init__(self, panel: AbstractPanel, gui: viser.GuiApi):
        self._side = panel.number(
            "Square [mm]",
            (5.0, 200.0, 0.1),
            "Side of a square, as measured on the print.",
            unit=1e-3,
            value=1e3 * Board().square,
        )
        self._carrier = panel.dropdown("Board is", CARRIERS, "The camera is on the other.")

    @property
    def board(self) -> Board:
        """One of these squares."""
        return Board(square=self._side.typed, mounted=self._carrier.typed)

    def show(self, data: Dataset) -> None:
        """The board of pictures that were read."""
        rig = rig_of(data)
        set_value(self._carrier.control, ON[rig.mounted])
        if (board := rig.targets[0].charuco) is not None:
            set_value(self._side.control, 1e3 * board.square)

    def build_upload(self, panel: AbstractPanel, gui: viser.GuiApi) -> None:
        """What takes the folder of the pictures, or an archive of it."""
        gui.add_html(folder_field("Drop or choose the folder of the pictures"))
        panel.upload(
            "… or an archive of it (ZIP)",
            lambda name, content: LoadPictures(name, content, self.board),
            "Pictures of a board or of tags, or a table of their corners, and a table of the joints with "
            "a column 'image'. Without target.toml the board's squares are counted in the pictures. Up to "
            f"{LARGEST_FOLDER // 2**20} MiB.",
            endings=ENDING,
            maximum=LARGEST_FOLDER,
            question=Question("Is this the board?", self._assumed, "Read with this board"),
        )

    def _assumed(self, content: bytes) -> str:
        """What is taken for the board of pictures without `target.toml`, as a question."""
        return "" if says_target(content) else f"No target.toml is beside the pictures. {self.board.question}"


def ask_for_pictures(panel: AbstractPanel, gui: viser.GuiApi) -> None:
    PictureFields(panel, gui).build_upload(panel, gui)


def _alone(session: Session) -> CameraAlone | None:
    return session.part(CameraAlone)


class CamerasPanel(AbstractPanel):
    """Step by step: a board to print, the pictures, what was found of them."""

    tab, order = Tab.MEASURE, 30
    door = Door("Pictures of a board", viser.Icon.CAMERA, Identify, asks=PICTURES, build=ask_for_pictures)
    depends = ("results", "playback.focus", "measurements.loaded", _alone)
    _read: Dataset | None = None

    def build(self, gui: viser.GuiApi) -> None:
        with gui.add_folder("Pictures of a board", expand_by_default=True):
            with gui.add_folder("Your board, or one to print", expand_by_default=True):
                self._fields = fields = PictureFields(self, gui)
                board = Board()
                squares = self.line("Squares", "Across x down.", value=f"{board.across}x{board.down}")

                def printed(_: Session) -> tuple[str, bytes]:
                    across, down = across_down(squares.typed)
                    board = replace(fields.board, across=across, down=down)
                    return "board.pdf", PrintedSheet.of(board.charuco).pdf()

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
        views, alone = camera_views(session), _alone(session)
        loaded = session.measurements.loaded
        data = alone.data if alone is not None else loaded.dataset if views and loaded is not None else None
        if data is not None and data is not self._read:
            self._fields.show(data)
        self._read, seen, gate = data, "", ""
        result = session.results.identification if alone is None else alone.found
        if data is not None:
            previews = session.part(Previews) if alone is None else alone.previews
            cameras = (_camera(c, view, coverage(data, c), result) for c, view in enumerate(views))
            seen = "".join([self._thumbnails(data, previews), *cameras])
            gate = _identified(result, is_alone=alone is not None)
        self._seen.content, self._gate.content = seen, gate
        self._save.visible = data is not None and result is not None

    def _thumbnails(self, data: Dataset, previews: Previews | None) -> str:
        """Every picture with its corners; a press shows it large, and the arm as it stood."""
        pictures = []
        for k, (image, html) in enumerate(thumbnails(data, previews).items()):
            address = text(self.link(f"picture-{k}", partial(self._look_at, image)))
            pictures.append(f'<a href="{address}" style="color:inherit;text-decoration:none">{html}</a>')
        grid = "display:grid;grid-template-columns:repeat(4,1fr);gap:6px"
        return block("".join(pictures), testid="thumbnails", style=f"{grid};margin:4px 0 8px")

    def _look_at(self, image: str) -> None:
        session = self._worker.session
        if session.measurements.loaded is None or session.results.comparison is None:
            return
        data = session.measurements.loaded.dataset
        number = data.row[PictureReadings.of(data).image == image]
        place = np.flatnonzero(np.isin(session.results.comparison.number, number))
        if len(place):
            self._worker.submit(ShowRow(int(place[0])))


def _camera(camera: int, view: CameraView, used: np.ndarray, result: Identification | None) -> str:
    """What one camera sees, how far the model is off, and how much of its pictures is used."""
    off = np.linalg.norm(view.measured - view.predicted, axis=1)
    off = off[np.isfinite(off)]
    head = f"{view.name}: image {view.image}" if view.image else f"{view.name}: what it would see here"
    inside = ((view.predicted >= 0.0) & (view.predicted < np.array(view.size))).all(axis=1)
    caption = plural(len(off), "corner") if view.image else f"{plural(int(inside.sum()), 'corner')} in view"
    if len(off) and result is not None:
        caption += f", {number(float(np.sqrt((off**2).mean())))} px off the model"
    return block(
        f'<div style="display:flex;justify-content:space-between"><b>{text(head)}</b>'
        f"<span>{text(caption)}</span></div>"
        + drawn(view.picture, view.size, view.measured, view.predicted)
        + covered(used),
        testid=f"camera_{camera}",
        style="margin:4px 0 8px",
    )


def camera_json(session: Session) -> tuple[str, bytes]:
    """What was found of cameras, target and arm, as `identify --json` writes it."""
    alone = _alone(session)
    found = session.results.identification if alone is None else alone.found
    if found is None:
        raise DataError("camera and target are not identified yet")
    return "camera.json", json.dumps(identification_json(found), indent=1).encode()


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
    reasons = [f"{text(step.name)}: {text(step.refused)}" for step in found.steps if step.refused]
    notes = [*found.doubts, *([found.advice] if found.advice else [])]
    places = "".join(f"<div>{text(sentence)}</div>" for sentence in found.found(result.best.fit))
    return block(
        badge(verdict, colour)
        + heading("Step by step, at the tool")
        + _steps(found)
        + bullets(reasons, style="margin:4px 0")
        + "".join(f'<div style="color:{CAREFUL}">{text(sentence)}</div>' for sentence in notes)
        + folded("Zeros, camera and target", places),
        testid="gate",
        style="margin:4px 0 8px",
    )


def _steps(identifiability: Identifiability) -> str:
    rows = [
        (
            f"<span style='white-space:normal'>{text(step.name)}</span>",
            f"{number(1e3 * step.expected, 2)} mm",
            f"{step.pixel:.2f} px",
            "no" if step.refused else "yes",
        )
        for step in identifiability.steps
    ]
    return table(("let go", "expected", "corners", "taken"), rows, testid="steps")


HOW = (
    "Every picture that appears in the folder (or every still frame of the device) is examined. The folder "
    "holds camera.toml and target.toml; joints come from the connected arm, or from a CSV beside them."
)


class PictureCapturePanel(AbstractPanel):
    """A closed folder: what is watched, the newest picture, and what to do with those that are kept."""

    tab, order = Tab.MEASURE, 40
    depends = (lambda session: session.part(Capture), "is_idle")

    def build(self, gui: viser.GuiApi) -> None:
        with gui.add_folder("Take pictures", expand_by_default=False):
            folder = self.line("Folder", "On this machine, with camera.toml and target.toml.")
            device = self.line("Device", "Number of a camera, such as 0; empty: the folder is watched.")
            self.button(
                "Watch",
                lambda: _watch(folder.typed.strip(), device.typed.strip()),
                viser.Icon.CAMERA,
                "Check every new picture, and keep it if it is good.",
                main=True,
                visible=lambda s: s.part(Capture) is None,
            )
            self.html(lambda s: note(HOW, "shooting") if (now := s.part(Capture)) is None else _shown(now))
            hint = "Drop the last kept picture and take it again."
            self.button("Drop the last", DropShot, viser.Icon.ROTATE, hint, visible=_is_capturing)
            self.button(
                UseShots.title,
                UseShots,
                viser.Icon.DATABASE,
                "End here: the kept pictures become the session's measurements.",
                main=True,
                visible=_is_capturing,
            )
            hint = "End here and drop the pictures."
            self.button(EndShooting.title, EndShooting, viser.Icon.X, hint, visible=_is_capturing)


def _is_capturing(session: Session) -> bool:
    return session.part(Capture) is not None


def _watch(typed: str, device: str) -> BeginShooting:
    folder, names = Path(typed).expanduser(), ("camera", "target")
    files = (read_bytes(folder / f"{name}.toml", wanted=f"a {name} TOML") for name in names)
    return BeginShooting(f"device:{device}" if device else str(folder), *files)


def _shown(capture: Capture) -> str:
    """The newest picture, its corners and blur, and what has been kept."""
    camera, shot = capture.rig.cameras[0], capture.last
    head = f'<div style="font-weight:600">{plural(len(capture.kept), "picture")} kept</div>'
    if shot is None:
        content = f"<div>Watching {text(capture.source)}: no picture yet.</div>"
    else:
        uv = np.array(shot.uv, float).reshape(-1, 2)
        content = f"{_verdict(shot)}{drawn(shot.picture, camera.size, uv)}"
        content += covered(cells(capture.points(camera.name), camera.size))
    return block(head + content, testid="shooting", style="margin:4px 0 8px")


def _verdict(shot: Shot) -> str:
    sharp = badge(f"Blur {shot.blur:.1f} px", GOOD if shot.blur <= SHARP else CAREFUL)
    found = f"{text(shot.name)}: {plural(len(shot.ids), 'corner')} · {sharp}"
    reason = f'<div style="color:{BAD}">Not kept: {text(shot.refused)}.</div>' if shot.refused else ""
    return f"<div>{found}</div>{reason}"
