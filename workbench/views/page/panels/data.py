"""Measurements: from a file, or from a virtual arm."""

import viser

from workbench.arm.joint_units import sliding
from workbench.data.simulation.simulate import LIKELY_ERRORS
from workbench.report.blocks import ResultTable
from workbench.report.result_display import as_html
from workbench.session.commands.data import (
    MAX_FILE_BYTES,
    ForgetData,
    MeasureVirtualArm,
    load_command,
    load_endings,
)
from workbench.session.loaded_measurements import Loaded, MeasurementFile
from workbench.session.next_step import next_step
from workbench.session.page_state import Tab
from workbench.views.page.html import BAD, LINE, block, bullets, heading, text
from workbench.views.page.panels.panel import AFTERWARDS, AbstractPanel

MORE = 60
"""Poses besides the targets: with these a diagnosis has enough rows."""


class DataPanel(AbstractPanel):
    """Two sources of measurements, and how they were interpreted."""

    tab, order, pause = Tab.MEASURE, 10, AFTERWARDS
    depends = ("measurements.loaded", "measurements.unread", next_step)
    _arms = 0
    """Virtual arms so far, each with other errors."""

    def build(self, gui: viser.GuiApi) -> None:
        with gui.add_folder("Real arm"):
            self.upload(
                "Load measurements",
                load_command,
                "Joint positions and measured poses: a CSV, Excel or Parquet file, units in "
                f"brackets as in q1[deg] or x[mm]; up to {MAX_FILE_BYTES // 2**20} MiB.",
                endings=",".join(load_endings()),
                maximum=MAX_FILE_BYTES,
                color=lambda s: "gray" if next_step(s).next or s.page.caption or s.page.job else None,
            )
        with gui.add_folder("Virtual arm"):
            self.button(
                "Measure a virtual arm",
                self._virtual,
                viser.Icon.ROBOT,
                "Create an arm with hidden manufacturing errors and one effect beyond geometry, and measure "
                "it at the targets and at more poses.",
            )
        self.html(lambda s: _preview(s.measurements.loaded, s.measurements.unread))
        self.button(
            "Remove these measurements",
            ForgetData,
            viser.Icon.TRASH,
            "Remove the measurements and everything identified from them.",
            visible=lambda s: s.measurements.loaded is not None,
        )

    def _virtual(self) -> MeasureVirtualArm:
        self._arms += 1
        turning = [k for k, slides in enumerate(sliding(self._worker.session.robot), 1) if not slides]
        hidden = tuple(f"joint-harmonic:{k}:3e-3" for k in turning[self._arms % max(len(turning), 1) :][:1])
        return MeasureVirtualArm(self._arms, MORE, LIKELY_ERRORS, hidden)


def _preview(loaded: Loaded | None, unread: MeasurementFile | None) -> str:
    """What is loaded, below the name of a file that was refused since."""
    if loaded is None:
        return ""  # the strip says it
    notes, refused = bullets(map(text, loaded.notes)), ""
    if unread is not None:
        refused = f'<div style="color:{BAD}">{text(unread.name)} was not read. What was loaded stays:</div>'
    return block(
        f'{refused}<div style="font-weight:600;overflow-wrap:anywhere">{text(loaded.name)}</div>'
        + as_html([ResultTable("", (), loaded.facts, words=2)])
        + (heading("Notes on reading") + notes if notes else ""),
        testid="preview",
        style=f"margin:8px 0;padding-top:8px;border-top:1px solid {LINE}",
    )
