"""Cameras as the instrument: pictures given or taken, what was found in them, and what they may identify."""

import base64
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
from workbench.extras.camera.camera_view import CameraView, camera_views, cells, coverage
from workbench.extras.camera.capture import SHARP, Capture, Previews, Shot
from workbench.extras.camera.picture_fields import PictureFields, ask_for_pictures
from workbench.extras.camera.readings import PictureReadings, rig_of
from workbench.extras.camera.selection_steps import Identifiability
from workbench.extras.camera.session_commands import (
    BeginShooting,
    CameraAlone,
    DropShot,
    EndShooting,
    UseShots,
)
from workbench.extras.camera.templates import Board, across_down
from workbench.extras.camera.thumbnails import thumbnails
from workbench.identification.report.results_json import identification_json
from workbench.identification.result import Identification
from workbench.session.commands.compare import ShowRow
from workbench.session.commands.identify import Identify
from workbench.session.state import Session, Tab
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
from workbench.views.page.panels.panel import AbstractPanel, Door

FOUND, MODEL, FAR = "#22c55e", "#f43f5e", "#f59e0b"
"""Colours of corners as found, as the model puts them, and of what lies between."""
ARROWS = 20.0
"""How many times residuals are drawn."""
ENOUGH = 0.6
"""Part of the picture that is well used."""
HOW_TO_TAKE = (
    "Take 15 to 30 pictures from different directions, with the arm at rest. Add a table with one row per "
    "picture: image, q1[deg] … of the joints; or image, x[mm], y[mm], z[mm], qw, qx, qy, qz of the tool, "
    "which identifies camera and target only."
)

PICTURES = (
    "Choose the robot, then its pictures, with a table of the joints beside them. None yet? Look around: the "
    "Measure tab has a board to print."
)


def _alone(session: Session) -> CameraAlone | None:
    return session.part(CameraAlone)


class CamerasPanel(AbstractPanel):
    """Step by step: a board to print, the files beside the pictures, the pictures, what was found of them."""

    tab, order = Tab.MEASURE, 30
    door = Door("Pictures of a board", viser.Icon.CAMERA, Identify, asks=PICTURES, build=ask_for_pictures)
    depends = ("results", "focus", "measurements.loaded", _alone)
    _read: Dataset | None = None

    def build(self, gui: viser.GuiApi) -> None:
        with gui.add_folder("Pictures of a board", expand_by_default=True):
            with gui.add_folder("Your board, or one to print", expand_by_default=True):
                self._fields = fields = PictureFields(self, gui)
                board = Board()
                squares = gui.add_text("Squares", f"{board.across}x{board.down}", hint="Across x down.")

                def printed() -> Board:
                    across, down = across_down(str(squares.value))
                    return replace(fields.board, across=across, down=down)

                self.download("Board (PDF)", lambda _: ("board.pdf", printed().pdf()), "To print at 100 %.")
                self.download(
                    "Files beside the pictures (ZIP)",
                    lambda session: ("pictures.zip", printed().folder(session.robot)),
                    "target.toml of this board, and joints.csv: a row for each picture.",
                )
            gui.add_html(note(HOW_TO_TAKE, "steps-of-pictures"))
            fields.build_upload(self, gui)
            self._thumbs = gui.add_html("")
            self._seen = gui.add_html("")
            self._gate = gui.add_html("")
            self._save = self.download(
                "Camera and target (JSON)",
                camera_json,
                "Poses, lenses and zeros with their standard errors, in SI units and degrees.",
                visible=False,
            )

    def show(self, session: Session) -> None:
        views, alone = camera_views(session), _alone(session)
        loaded = session.measurements.loaded
        data = alone.data if alone is not None else loaded.dataset if views and loaded is not None else None
        if data is not None and data is not self._read:
            self._fields.show(rig_of(data))
        self._read = data
        result = session.results.identification if alone is None else alone.found
        previews = session.part(Previews) if alone is None else alone.previews
        self._thumbs.content = "" if data is None else self._thumbnails(data, previews)
        self._seen.content = "".join(_camera(session, c, view) for c, view in enumerate(views))
        self._gate.content = (
            _identified(result, is_alone=alone is not None) if views or alone is not None else ""
        )
        self._save.visible = self._gate.content != "" and result is not None

    def _thumbnails(self, data: Dataset, previews: Previews | None) -> str:
        """Every picture with its corners; a press shows it large, and the arm as it stood."""
        cells = []
        for k, shown in enumerate(thumbnails(data, previews)):
            address = self.link(f"picture-{k}", partial(self._look_at, shown.image))
            cells.append(
                f'<a href="{text(address)}" style="color:inherit;text-decoration:none">{shown.html}</a>'
            )
        grid = "display:grid;grid-template-columns:repeat(4,1fr);gap:6px"
        return block("".join(cells), testid="thumbnails", style=f"{grid};margin:4px 10px 8px;padding:2px")

    def _look_at(self, image: str) -> None:
        session = self._worker.session
        if session.measurements.loaded is None or session.results.comparison is None:
            return
        data = session.measurements.loaded.dataset
        number = data.row[PictureReadings.of(data).image == image]
        place = np.flatnonzero(np.isin(session.results.comparison.number, number))
        if len(place):
            self._worker.submit(ShowRow(int(place[0])))


def _camera(session: Session, number_of: int, view: CameraView) -> str:
    """What one camera sees, with its words and its coverage."""
    assert session.measurements.loaded is not None, "a camera has pictures"
    off = np.linalg.norm(view.measured - view.predicted, axis=1)
    found = int(np.isfinite(off).sum())
    head = f"{view.name}: image {view.image}" if view.image else f"{view.name}: what it would see here"
    inside = ((view.predicted >= 0.0) & (view.predicted < np.array(view.size))).all(axis=1)
    caption = f"{plural(found, 'corner')}" if view.image else f"{plural(int(inside.sum()), 'corner')} in view"
    if found and session.results.identification is not None:
        caption += f", {number(float(np.sqrt((off[np.isfinite(off)] ** 2).mean())))} px off the model"
    return block(
        f'<div style="display:flex;justify-content:space-between"><b>{text(head)}</b>'
        f"<span>{text(caption)}</span></div>"
        + picture_of(view)
        + covered(coverage(session.measurements.loaded.dataset, number_of)),
        testid=f"camera_{number_of}",
        style="margin:4px 0 8px",
    )


def picture_of(view: CameraView) -> str:
    """The picture, or an empty one, with corners as found (rings) and as the model has them (crosses)."""
    width, height = view.size
    r = width / 160.0
    parts = [f'<rect width="{width}" height="{height}" fill="#1f2937"/>']
    if view.picture is not None:
        data = base64.b64encode(view.picture).decode()
        parts.append(f'<image width="{width}" height="{height}" href="data:image/jpeg;base64,{data}"/>')
    for place, seen in zip(view.predicted, view.measured, strict=True):
        if np.isfinite(place).all():
            x, y = place
            cross = f"M{x - r:.1f} {y:.1f}h{2 * r:.1f}M{x:.1f} {y - r:.1f}v{2 * r:.1f}"
            parts.append(f'<path d="{cross}" stroke="{MODEL}" stroke-width="{0.4 * r:.1f}"/>')
        if np.isfinite(seen).all():
            u, v = seen
            parts.append(
                f'<circle cx="{u:.1f}" cy="{v:.1f}" r="{r:.1f}" fill="none" stroke="{FOUND}" '
                f'stroke-width="{0.4 * r:.1f}"/>'
            )
            if np.isfinite(place).all():
                far = seen + ARROWS * (seen - place)
                parts.append(
                    f'<path d="M{u:.1f} {v:.1f}L{far[0]:.1f} {far[1]:.1f}" stroke="{FAR}" '
                    f'stroke-width="{0.4 * r:.1f}"/>'
                )
    has_model = bool(np.isfinite(view.predicted).any())
    caption = "rings: found" + (
        f"; crosses: by the model; lines: the difference × {ARROWS:g}" if has_model else ""
    )
    return (
        f'<svg viewBox="0 0 {width} {height}" width="100%" data-testid="picture" style="border-radius:4px">'
        f"<title>{caption}</title>{''.join(parts)}</svg>"
        f'<div style="color:{MUTED};font-size:11.5px">{caption}</div>'
    )


def covered(cells: np.ndarray) -> str:
    """How much of the picture has corners, and which parts of it."""
    share = float((cells > 0).mean())
    content = badge(f"{100 * share:.0f} % of the picture used", GOOD if share > ENOUGH else CAREFUL)
    return (
        f'<div style="display:flex;gap:10px;align-items:center;margin-top:4px">{_cells(cells)}'
        f'<span data-testid="coverage">{content}</span></div>'
    )


def _cells(cells: np.ndarray) -> str:
    maximum = max(float(cells.max()), 1.0)
    parts = [
        f'<rect x="{12 * c}" y="{12 * r}" width="11" height="11" rx="2" fill="{FOUND}" '
        f'fill-opacity="{0.0 if not n else 0.25 + 0.75 * n / maximum:.2f}" stroke="{LINE}" stroke-width=".7">'
        f"<title>{plural(int(n), 'corner')}</title></rect>"
        for (r, c), n in np.ndenumerate(cells)
    ]
    return f'<svg width="{12 * cells.shape[1]}" height="{12 * cells.shape[0]}">{"".join(parts)}</svg>'


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
                "Check every new picture, and keep it if it is good.",
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
        capture = session.part(Capture)
        self._begin.visible = capture is None
        for button in (self._again, self._use, self._stop):
            button.visible = capture is not None
        seen = "" if capture is None else block(_shown(capture), testid="shooting", style="margin:4px 0 8px")
        self._seen.content = seen or note(HOW, "shooting")

    def _watch(self) -> BeginShooting:
        folder, device = Path(str(self._folder.value).strip()).expanduser(), str(self._device.value).strip()
        names = ("camera", "target")
        files = (read_bytes(folder / f"{name}.toml", wanted=f"a {name} TOML") for name in names)
        return BeginShooting(f"device:{device}" if device else str(folder), *files)


def _shown(capture: Capture) -> str:
    """The newest picture, what is said of it, and what has been kept."""
    camera, shot = capture.rig.cameras[0], capture.last
    head = f'<div style="font-weight:600">{plural(len(capture.kept), "picture")} kept</div>'
    if shot is None:
        content = f"<div>Watching {text(capture.source)}: no picture yet.</div>"
    else:
        content = f"{_verdict(shot)}{picture_of(_view(shot, camera.size))}"
        content += covered(cells(capture.points(camera.name), camera.size))
    return block(head + content, testid="shooting", style="margin:4px 0 8px")


def _verdict(shot: Shot) -> str:
    sharp = badge(f"Blur {shot.blur:.1f} px", GOOD if shot.blur <= SHARP else CAREFUL)
    found = f"{text(shot.name)}: {plural(len(shot.ids), 'corner')} · {sharp}"
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
