"""Choices for the next identification: manually excluded rows, parameters held at nominal."""

import re
from functools import partial

import viser

from workbench.arm.robot import Robot
from workbench.base.errors import OptionError
from workbench.session.commands.identify import HoldParameter, LeaveRowsOut
from workbench.session.state import Session, Tab
from workbench.session.worker import Worker
from workbench.views.page.panels.panel import AbstractPanel, on_press, set_value


class ChoicesPanel(AbstractPanel):
    """Two closed folders; the parameters' boxes are rebuilt for another arm."""

    tab, order = Tab.CALIBRATE, 40
    depends = ("robot", "loaded", "left_out", "fixed")

    def __init__(self, worker: Worker):
        super().__init__(worker)
        self._robot: Robot | None = None
        self._boxes: dict[str, viser.GuiCheckboxHandle] = {}

    def build(self, gui: viser.GuiApi) -> None:
        with gui.add_folder("Excluded rows", expand_by_default=False):
            self._rows = gui.add_text(
                "Rows",
                "",
                hint="Numbers of data rows that are not fitted, such as 3, 17, 20-24. In the Compare tab a "
                "row can be excluded while you look at it.",
            )
            self.sends(self._rows, lambda: LeaveRowsOut(read_rows(self._rows.value)))
        self._folder = gui.add_folder("Free parameters", expand_by_default=False)
        with self._folder:
            everything = gui.add_button("Free all", color="gray", hint="Tick all parameters.")
            on_press(everything, self._free_all)

    def show(self, session: Session) -> None:
        if session.robot is not self._robot:
            self._rebuild(session.robot)
        self._rows.disabled = session.loaded is None
        set_value(self._rows, ", ".join(map(str, sorted(session.left_out))))
        for name, box in self._boxes.items():
            set_value(box, name not in session.fixed)

    def _rebuild(self, robot: Robot) -> None:
        self._robot = robot
        for box in self._boxes.values():
            box.remove()
        with self._folder:
            self._boxes = {
                name: self._gui.add_checkbox(
                    name, True, hint="Ticked: identified. Not ticked: fixed at its nominal value."
                )
                for name in robot.default_free
            }
        for name, box in self._boxes.items():
            self.sends(box, partial(self._fix, name))

    def _fix(self, name: str) -> HoldParameter:
        return HoldParameter(name, not self._boxes[name].value)

    def _free_all(self) -> None:
        for name in self._worker.session.fixed:
            self._worker.submit(HoldParameter(name, False))


def read_rows(words: str) -> tuple[int, ...]:
    """Row numbers from `3, 17, 20-24`."""
    rows: set[int] = set()
    try:
        for part in filter(None, re.split(r"[,;\s]+", words.strip())):
            first, _, last = part.partition("-")
            begin, end = int(first), int(last or first)
            if end - begin > 100_000:
                raise ValueError(part)
            rows |= set(range(begin, end + 1))
    except ValueError:
        raise OptionError(f"'{words[:40]}' is not a list of row numbers; give e.g. 3, 17, 20-24") from None
    return tuple(sorted(rows))
