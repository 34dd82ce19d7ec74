"""Keyboard shortcuts, which viser lists with its commands (Ctrl K)."""

from functools import partial
from typing import Any

import numpy as np
import viser

from workbench.session.commands.drag import MoveTarget, SelectTarget, plain
from workbench.session.commands.messages import OpenTab
from workbench.session.commands.undo import Redo, RestoreBest, Undo
from workbench.session.page_state import Tab
from workbench.views.page.panels.panel import AbstractPanel
from workbench.views.page.panels.row_errors import exclude

STEP = 0.01
"""By which a key moves a target [m]."""
STEPS = {"up": (1, 0, 0), "down": (-1, 0, 0), "left": (0, 1, 0), "right": (0, -1, 0)}
"""Directions of the arrow keys."""


class LookPanel(AbstractPanel):
    """Nothing to be seen."""

    tab, order = Tab.ROBOT, 90

    def build(self, gui: viser.GuiApi) -> None:
        add, send = gui.add_command, self.sending
        add(Undo.title, hotkey="Z", modifier="cmd/ctrl").on_trigger(send(lambda _: Undo()))
        add(Redo.title, hotkey="Z", modifier="cmd/ctrl+shift").on_trigger(send(lambda _: Redo()))
        for tab in Tab:
            add(f"Open the tab {tab}").on_trigger(send(lambda _, tab=tab: OpenTab(tab)))  # type: ignore[misc]
        add("Back to the best plate", hotkey="B").on_trigger(send(lambda _: RestoreBest()))
        add("Exclude the shown row, or use it again").on_trigger(send(lambda _: exclude(self.session)))
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
