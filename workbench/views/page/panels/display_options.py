"""Light or dark mode, the help sheet, and keyboard shortcuts."""

from functools import partial
from typing import Any

import numpy as np
import viser

from workbench.session.commands.compare import SetDark
from workbench.session.commands.drag import MoveTarget, SelectTarget, plain
from workbench.session.commands.messages import OpenTab
from workbench.session.commands.undo import Redo, RestoreBest, Undo
from workbench.session.page_state import Tab
from workbench.session.state import Session
from workbench.views.page.html import block, heading, pairs
from workbench.views.page.panels.panel import AbstractPanel

TITLE = "How to use this page"
BRAND = (37, 99, 235)
MOUSE = (
    ("Drag an arrow or a ring", "moves or turns the selected target"),
    ("Click a block", "selects its target"),
    ("Click a measured point", "moves the arm there (Compare)"),
    ("Drag elsewhere", "rotates the view; the right button pans, the wheel zooms"),
)
KEYS = (
    ("Ctrl Z", "undo"),
    ("Ctrl Shift Z", "redo"),
    ("N · P", "next and previous target"),
    ("Shift ← → ↑ ↓", "moves the selected target by 1 cm along y and x"),
    ("B", "back to the best plate so far"),
    ("Esc", "closes a sheet"),
)
WORDS = (
    ("Geometry", "lengths and angles between the joints, and their zeros"),
    ("Effects", "what geometry can't explain: bending under load, gears, play"),
    ("Held out", "rows that were not fitted: the errors at them are honest"),
    ("O", "how evenly the targets tell all constants, from 0 to 1"),
)
STEP = 0.01
"""By which a key moves a target [m]."""
STEPS = {"up": (1, 0, 0), "down": (-1, 0, 0), "left": (0, 1, 0), "right": (0, -1, 0)}
"""Directions of the arrow keys."""


class LookPanel(AbstractPanel):
    """Appearance of the page, and help."""

    tab, order = Tab.ROBOT, 90
    keeps_typed = True
    depends = ("page.is_dark",)

    def build(self, gui: viser.GuiApi) -> None:
        with gui.add_folder("Page"):
            self.form(SetDark, self.checkbox("Dark", "Dark colours.", lambda s: s.page.is_dark))
            hint = f"{TITLE}, and its keyboard shortcuts."
            self.press("Help and keys", show_help, viser.Icon.HELP, hint)
        self._keys(gui)

    def show(self, session: Session) -> None:
        self._gui.configure_theme(
            show_logo=False, show_share_button=False, brand_color=BRAND, dark_mode=session.page.is_dark
        )

    def _keys(self, gui: viser.GuiApi) -> None:
        add, send = gui.add_command, self.sending
        add(Undo.title, hotkey="Z", modifier="cmd/ctrl").on_trigger(send(lambda _: Undo()))
        add(Redo.title, hotkey="Z", modifier="cmd/ctrl+shift").on_trigger(send(lambda _: Redo()))
        for tab in Tab:
            add(f"Open the tab {tab}").on_trigger(send(lambda _, tab=tab: OpenTab(tab)))  # type: ignore[misc]
        add("Back to the best plate", hotkey="B").on_trigger(send(lambda _: RestoreBest()))
        add("Next target", hotkey="N").on_trigger(send(lambda _: self._step(1)))
        add("Previous target", hotkey="P").on_trigger(send(lambda _: self._step(-1)))
        for key, along in STEPS.items():
            name: Any = f"arrow{key}"
            move = send(partial(self._moved, STEP * np.array(along)))
            add(f"Move the target 1 cm ({key})", hotkey=name, modifier="shift").on_trigger(move)

    def _moved(self, by: np.ndarray, _: object) -> MoveTarget:
        session = self._worker.session
        target = session.plate.targets[session.selected]
        return MoveTarget(session.selected, plain(target.xyz + by), plain(target.rpy))

    def _step(self, by: int) -> SelectTarget:
        session = self._worker.session
        return SelectTarget((session.selected + by) % len(session.plate))


def show_help(event: viser.GuiEvent) -> None:
    """A sheet over the page of the user who pressed, until it is closed."""
    if event.client is None:
        return
    parts = {"Mouse": MOUSE, "Keys": KEYS, "Words": WORDS}
    lines = "".join(heading(title) + pairs(rows) for title, rows in parts.items())
    gui = event.client.gui
    with (made := gui.add_modal(TITLE)):
        gui.add_html(block(lines, testid="help"))
        close = gui.add_button("Close", color="gray", hint="Close this sheet.")
        close.on_click(lambda _: made.close())
