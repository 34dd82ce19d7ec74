"""Poses that are kept while jogging, before and after calibration."""

from typing import Any

import numpy as np
import viser

from workbench.session.captured import Captured, captured
from workbench.session.commands.arm import CapturePose, ForgetPoses
from workbench.session.export import captured_csv
from workbench.session.state import Session
from workbench.views.page.html import (
    MUTED,
    block,
    number,
    table,
)
from workbench.views.page.panels.files import save
from workbench.views.page.panels.panel import AbstractPanel, on_press

LISTED = 12
"""Poses that the table shows, the newest; the file has all."""


class CapturedPanel(AbstractPanel):
    """A button that keeps, a table, a file."""

    def build(self, server: viser.ViserServer) -> None:
        gui = server.gui
        with gui.add_folder("Kept poses"):
            keep = gui.add_button(
                "Keep this pose",
                icon=viser.Icon.PLUS,
                color="gray",
                hint="Note the joints as the arm stands, and where its tool is by either model.",
            )
            self._table = gui.add_html("")
            self._file = gui.add_button(
                "Save the kept poses (CSV)",
                icon=viser.Icon.DOWNLOAD,
                color="gray",
                visible=False,
                hint="Joints, and the tool's pose by the nominal and the calibrated arm, one line a pose.",
            )
            self._forget = gui.add_button(
                "Forget the kept poses",
                icon=viser.Icon.TRASH,
                color="gray",
                visible=False,
                hint="Take them off the list.",
            )
        on_press(keep, lambda: self._worker.submit(CapturePose()))
        on_press(self._forget, lambda: self._worker.submit(ForgetPoses()))
        self._file.on_click(lambda event: save(event, self._worker, captured_csv))

    def parts(self, session: Session) -> tuple[Any, ...]:
        return session.captured, session.identification, session.fit, session.robot

    def show(self, session: Session) -> None:
        self._table.content = _content(captured(session))
        for button in (self._file, self._forget):
            button.visible = bool(session.captured)


def _content(poses: Captured) -> str:
    if not len(poses.q):
        words = "Keep poses before and after a calibration to see where the arm really goes."
        return block(words, testid="captured", style=f"color:{MUTED}")
    places = poses.nominal if poses.calibrated is None else poses.calibrated
    rows = [
        [f"{i + 1}", *(f"{1e3 * v:.2f}" for v in places[i, :3, 3]), number(1e3 * float(poses.apart[i]))]
        for i in np.arange(len(poses.q))[-LISTED:]
    ]
    model = "nominal arm" if poses.calibrated is None else "calibrated arm"
    note = f"Tool of the {model}; last column: how far the calibrated arm is from the nominal one."
    body = table(("", "x [mm]", "y [mm]", "z [mm]", "apart [mm]"), rows)
    return block(f'{body}<div style="color:{MUTED};margin-top:4px">{note}</div>', testid="captured")
