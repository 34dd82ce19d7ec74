"""The calibrated arm as a file: a button for every format, with the error of what it saves."""

import viser

from workbench.identification.file_errors import file_words
from workbench.identification.result import Identification
from workbench.session.export import calibrated_toml, calibrated_urdf, report_zip
from workbench.session.state import Session
from workbench.views.page.html import MUTED, block, text
from workbench.views.page.panels.panel import AbstractPanel

FORMATS = (
    "The arm of the shown fit: TOML for this program, effects and all; URDF for others, the best geometry "
    "without effects; the report as an HTML page with tables and figures."
)
SAVED = {"TOML": calibrated_toml, "URDF": calibrated_urdf, "Report": report_zip}


class ArmFiles:
    """Part of a panel; there once an arm is identified."""

    def __init__(self, panel: AbstractPanel, gui: viser.GuiApi):
        self._shown: tuple[Identification | None, str] = (None, "")
        self._errors = gui.add_html("", visible=False)
        self._formats = gui.add_button_group("Save", tuple(SAVED), visible=False, hint=FORMATS)
        self._formats.on_click(lambda event: panel.save(event, SAVED[event.target.value]))

    def show(self, session: Session) -> None:
        """The errors of the files as they would be saved now; they are evaluated once a fit."""
        found = session.identification
        self._errors.visible = self._formats.visible = found is not None
        if found is not None and (self._shown[0] is not found or self._shown[1] != session.fit):
            self._shown = found, session.fit
            self._errors.content = _errors(found, session.fit)


def _errors(found: Identification, shown: str) -> str:
    """Held-out error of what each button saves."""
    run = found.runs[shown]
    if found.identifiability is not None and found.identifiability.refused:
        return ""
    words = text(file_words(found, run))
    return block(
        f'<span style="color:{MUTED}">{words}</span>', testid="file-errors", style="margin:2px 0 6px"
    )
