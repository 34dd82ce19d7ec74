"""Measurements: from a file, or from a virtual arm."""

from typing import Any

import viser

from workbench.session.commands.data import (
    LARGEST_FILE,
    MOST_MORE,
    VIRTUAL_INSTRUMENTS,
    ForgetData,
    LoadData,
    MeasureVirtualArm,
)
from workbench.session.commands.messages import Tell
from workbench.session.state import Loaded, Session
from workbench.session.worker import Worker
from workbench.views.page.html import LINE, MUTED, block, heading, pairs, text
from workbench.views.page.panels.panel import AbstractPanel, on_press

FILES = ".csv,.tsv,.txt,.xlsx,.parquet"
SEAT = "plate seats"
NOTES = 8
"""Notes shown before the rest is counted."""


class DataPanel(AbstractPanel):
    """Two ways to measurements, and what was understood of them."""

    def build(self, server: viser.ViserServer) -> None:
        gui = server.gui
        with gui.add_folder("Real arm"):
            self._upload = gui.add_upload_button(
                "Load measurements",
                icon=viser.Icon.UPLOAD,
                mime_type=FILES,
                hint="Joint positions and measured poses: a CSV, Excel, Parquet or MATLAB file, units in "
                f"brackets as in q1[deg] or x[mm]; up to {LARGEST_FILE // 2**20} MiB.",
            )
        with gui.add_folder("Virtual arm"):
            self._seed = gui.add_number(
                "Seed",
                1,
                min=0,
                max=999_999,
                step=1,
                hint="Each number gives an arm with other hidden errors.",
            )
            self._surprise = gui.add_checkbox(
                "Surprise me",
                False,
                hint="Hide an effect that geometry can't explain (play, compliance or a bent gear) in one "
                "joint, to see which errors remain after an identification.",
            )
            self._more = gui.add_number(
                "More poses",
                0,
                min=0,
                max=MOST_MORE,
                step=10,
                hint="Poses in the region to measure for fitting, besides the targets.",
            )
            self._instrument = gui.add_dropdown(
                "Instrument",
                (SEAT, *VIRTUAL_INSTRUMENTS),
                hint="What measures. The seats have the noise that is set in the Plate tab; every other "
                "instrument has its own, and sees poses or points only.",
            )
            measure = gui.add_button(
                "Measure a virtual arm",
                icon=viser.Icon.ROBOT,
                hint="Make an arm with hidden manufacturing errors (up to 5 mm and 5°) and measure it at "
                "the targets.",
            )
        self._preview = gui.add_html("")
        self._forget = gui.add_button(
            "Remove these measurements",
            color="gray",
            icon=viser.Icon.TRASH,
            visible=False,
            hint="Remove the measurements and everything identified from them.",
        )
        on_press(measure, lambda: self._measure())
        on_press(self._forget, lambda: self._worker.submit(ForgetData()))
        on_press_upload(self._upload, self._worker)

    def parts(self, session: Session) -> tuple[Any, ...]:
        return (session.loaded,)

    def show(self, session: Session) -> None:
        self._preview.content = _nothing() if session.loaded is None else _preview(session.loaded)
        self._forget.visible = session.loaded is not None

    def _measure(self) -> None:
        seed, more = int(self._seed.value), int(self._more.value)
        name = str(self._instrument.value)
        instrument = "" if name == SEAT else name
        self._worker.submit(MeasureVirtualArm(seed, bool(self._surprise.value), more, instrument))


def on_press_upload(button: viser.GuiUploadButtonHandle, worker: Worker) -> None:
    """Send an uploaded file on, if it is not too large."""

    @button.on_upload
    async def _(event: viser.GuiEvent) -> None:
        file = event.target.value
        if len(file.content) > LARGEST_FILE:
            size, most = len(file.content) / 2**20, LARGEST_FILE // 2**20
            worker.submit(
                Tell(f"{file.name[-80:]} has {size:.0f} MiB, but the page accepts up to {most} MiB")
            )
            return
        worker.submit(LoadData(file.name, bytes(file.content)))


def _nothing() -> str:
    return block(
        "No measurements yet. Load a file of a real arm, or measure a virtual arm.",
        testid="preview",
        style=f"color:{MUTED};margin:8px 0",
    )


def _preview(loaded: Loaded) -> str:
    notes = "".join(f"<li>{text(note)}</li>" for note in loaded.notes[:NOTES])
    more = len(loaded.notes) - NOTES
    if more > 0:
        notes += f"<li>… and {more} more</li>"
    decisions = heading("Notes on reading") + f'<ul style="margin:0;padding-left:16px">{notes}</ul>'
    return block(
        f'<div style="font-weight:600;overflow-wrap:anywhere">{text(loaded.name)}</div>'
        + pairs(loaded.facts)
        + (decisions if notes else ""),
        testid="preview",
        style=f"margin:8px 0;padding-top:8px;border-top:1px solid {LINE}",
    )
