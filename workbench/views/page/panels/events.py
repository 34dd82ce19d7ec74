"""What happened while the rows were measured, each with a button that makes the rows after it a session."""

from collections.abc import Callable
from functools import partial

import viser

from workbench.base.errors import WorkbenchError
from workbench.session.commands.sessions import MakeSession, new_frames
from workbench.session.state import Session
from workbench.views.page.html import block, text
from workbench.views.page.panels.panel import AbstractPanel

SPLIT = "Make the rows after it a session"
HINT = (
    "These rows get a base and a tool of their own, so that nothing has to be measured again; Undo (Ctrl+Z) "
    "takes it back."
)
APART = "margin:2px 0 6px"
MAX_BUTTONS = 3
"""Events with a button; of more, those after them once these have been pressed."""


class EventButtons:
    """Part of a panel; there once something is found to have happened to base or tool."""

    def __init__(self, panel: AbstractPanel, gui: viser.GuiApi, session: Callable[[], Session]):
        def split(place: int) -> MakeSession | None:
            steps = list(_splittable(session()))
            return MakeSession(steps[place]) if place < len(steps) else None

        self._lines = [
            (
                gui.add_html("", visible=False),
                panel.button(SPLIT, partial(split, place), viser.Icon.ARROWS_SPLIT_2, HINT, visible=False),
            )
            for place in range(MAX_BUTTONS)
        ]

    def show(self, session: Session) -> None:
        steps = list(_splittable(session).values())
        for place, (words, button) in enumerate(self._lines):
            words.visible = button.visible = place < len(steps)
            if place < len(steps):
                words.content = block(text(f"{steps[place]}."), testid=f"event-{place + 1}", style=APART)


def _splittable(session: Session) -> dict[int, str]:
    """Steps of base or tool, found in the present rows, which share a session with rows before them."""
    if session.diagnosis is None or session.loaded is None:
        return {}
    steps = new_frames(session.diagnosis)
    return {row: words for row, words in steps.items() if _is_taken(MakeSession(row), session)}


def _is_taken(command: MakeSession, session: Session) -> bool:
    try:
        command.check(session)
    except WorkbenchError:
        return False
    return True
