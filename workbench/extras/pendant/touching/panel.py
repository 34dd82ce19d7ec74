"""Touches on the page: a file of joints to the tool's tip or a user frame, each touch with what it is off."""

from collections.abc import Callable

import viser

from workbench.base.wording import capital
from workbench.extras.pendant.touching.session import (
    FRAME,
    TIP,
    ReadTouches,
    frame_toml,
    tool_toml,
    touched_of,
    usable,
)
from workbench.extras.pendant.touching.tool_tip import ToolTip
from workbench.extras.pendant.touching.user_frame import UserFrame
from workbench.report.result_display import as_html
from workbench.session.command import AbstractCommand
from workbench.session.commands.data import MAX_FILE_BYTES
from workbench.session.commands.messages import Tell
from workbench.session.page_state import Severity, Tab
from workbench.session.state import Session
from workbench.views.page.html import CAREFUL, GOOD, badge, block, note
from workbench.views.page.panels.panel import AbstractPanel

READY = (
    "A table of joints, one touch per row. Tip: touch one point in 4 or more orientations. Frame: name what "
    "was touched in a column 'contact': origin, x, xy; or plane, line, end (3-2-1); or a drawing's points. "
    "Frames use the tip that was found, else the arm's own tool."
)
CAD = "point, x[mm], y[mm], z[mm] of a fixture; give it before the touches of its frame."


class TouchesPanel(AbstractPanel):
    """A closed folder: files of touches, and what they show."""

    tab, order = Tab.CALIBRATE, 60
    depends = (touched_of,)

    def build(self, gui: viser.GuiApi) -> None:
        self._drawing = "", b""
        with gui.add_folder("Tool tip or user frame from touches", expand_by_default=False):
            gui.add_html(note(READY, "touches"))
            self._file("Touches of one point", ReadTouches, "Find the tool's tip from joints alone.")
            hint = "Of the ball that touches faces (3-2-1); else 0."
            self._radius = self.number("Ball's radius [mm]", (0.0, 99.0, 0.1), hint, unit=1e-3, value=0.0)
            self._file("Touches of a frame", self._frame, "Find a user frame from joints alone.")
            self._file("Points of a drawing", self._keep, CAD)
        self.html(_cards)
        self.download(
            "Arm with this tool (TOML)",
            tool_toml,
            "The arm of this session with the tip.",
            visible=lambda s: usable(touched_of(s).tip),
        )
        self.download(
            "User frame (TOML)",
            frame_toml,
            "Pose of the frame in the robot's base.",
            visible=lambda s: usable(touched_of(s).frame),
        )

    def _file(self, label: str, do: Callable[[str, bytes], AbstractCommand], hint: str) -> None:
        self.upload(label, do, hint, endings=".csv,.tsv,.txt,.xlsx", maximum=MAX_FILE_BYTES)

    def _frame(self, name: str, content: bytes) -> ReadTouches:
        return ReadTouches(name, content, FRAME, *self._drawing, self._radius.typed)

    def _keep(self, name: str, content: bytes) -> Tell:
        self._drawing = name, content
        return Tell(f"{name}: points of the drawing for the next touches of a frame", Severity.INFO)


def _cards(session: Session) -> str:
    kept = touched_of(session)
    cards = _card(TIP, kept.tip) + _card(FRAME, kept.frame)
    return block(cards, testid="touched", style="margin:4px 0 8px") if cards else ""


def _card(what: str, found: ToolTip | UserFrame | None) -> str:
    """Verdict, sentence, and what each touch is off."""
    if found is None:
        return ""
    mark = badge(f"{capital(what)}: don't use", CAREFUL) if found.doubt else badge(capital(what), GOOD)
    return mark + as_html(found.summary())
