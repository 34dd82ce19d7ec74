"""Measurements: from a file, or from a virtual arm."""

import viser

from workbench.session.commands.data import (
    LARGEST_FILE,
    MOST_MORE,
    ForgetData,
    LoadData,
    MeasureVirtualArm,
    virtual_instruments,
)
from workbench.session.loaded_measurements import Loaded, MeasurementFile
from workbench.session.state import Session
from workbench.views.page.html import LINE, block, bullets, heading, note, pairs, text
from workbench.views.page.panels.panel import AbstractPanel

FILES = ".csv,.tsv,.txt,.xlsx,.parquet"
SEAT = "plate seats"
NOTHING = "No measurements yet. Load a file of a real arm, or measure a virtual arm."
NOTES = 8
"""Notes shown before the rest is counted."""


class DataPanel(AbstractPanel):
    """Two sources of measurements, and how they were interpreted."""

    depends = ("loaded", "unread")

    def build(self, gui: viser.GuiApi) -> None:
        with gui.add_folder("Real arm"):
            self.upload(
                "Load measurements",
                LoadData,
                "Joint positions and measured poses: a CSV, Excel or Parquet file, units in "
                f"brackets as in q1[deg] or x[mm]; up to {LARGEST_FILE // 2**20} MiB.",
                endings=FILES,
                most=LARGEST_FILE,
                main=True,
            )
        with gui.add_folder("Virtual arm"):
            self._seed = self.number(
                "Seed", 1, (0, 999_999, 1), "Each number gives an arm with different hidden errors."
            )
            self._surprise = gui.add_checkbox(
                "Surprise me",
                False,
                hint="Hide an effect that geometry can't explain (play, compliance or a bent gear) in one "
                "joint, to see the errors that remain after an identification.",
            )
            self._more = self.number(
                "More poses",
                0,
                (0, MOST_MORE, 10),
                "Poses in the region to measure for fitting, besides the targets.",
            )
            self._instrument = gui.add_dropdown(
                "Instrument",
                (SEAT, *virtual_instruments()),
                hint="The instrument. The seats have the noise set in the Plate tab; every other instrument "
                "has its own noise and measures poses or points.",
            )
            self.button(
                "Measure a virtual arm",
                self._virtual,
                viser.Icon.ROBOT,
                "Make an arm with hidden manufacturing errors (up to 5 mm and 5°) and measure it at "
                "the targets.",
                main=True,
            )
        self._preview = gui.add_html("")
        self._forget = self.button(
            "Remove these measurements",
            ForgetData,
            viser.Icon.TRASH,
            "Remove the measurements and everything identified from them.",
            visible=False,
        )

    def show(self, session: Session) -> None:
        self._preview.content = _preview(session.loaded, session.unread)
        self._forget.visible = session.loaded is not None

    def _virtual(self) -> MeasureVirtualArm:
        seed, more = int(self._seed.value), int(self._more.value)
        name = str(self._instrument.value)
        instrument = "" if name == SEAT else name
        return MeasureVirtualArm(seed, bool(self._surprise.value), more, instrument)


def _preview(loaded: Loaded | None, unread: MeasurementFile | None) -> str:
    """What is loaded; while another file waits for its columns or its arm, which are shown, only its name."""
    if loaded is not None and unread is not None:
        return note(f"{unread.name} is not read; {loaded.name} stays loaded.", "preview", margin="8px 0")
    if loaded is None:
        return note(NOTHING, "preview", margin="8px 0")
    notes, more = [*map(text, loaded.notes[:NOTES])], len(loaded.notes) - NOTES
    decisions = heading("Notes on reading") + bullets([*notes, f"… and {more} more"] if more > 0 else notes)
    return block(
        f'<div style="font-weight:600;overflow-wrap:anywhere">{text(loaded.name)}</div>'
        + pairs(loaded.facts)
        + (decisions if notes else ""),
        testid="preview",
        style=f"margin:8px 0;padding-top:8px;border-top:1px solid {LINE}",
    )
