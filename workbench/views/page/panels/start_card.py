"""The start card: what do you have? It closes once there is something to work on."""

from collections.abc import Callable
from functools import partial

import viser

from workbench.base.assets import built_in_robots
from workbench.session.command import AbstractCommand
from workbench.session.commands.arm import ChooseRobot, LoadModel
from workbench.session.commands.data import LARGEST_FILE, load_command
from workbench.session.commands.messages import OpenTab, SetCaption
from workbench.session.commands.plate import ImprovePlate
from workbench.session.state import Session, Severity, Tab
from workbench.session.worker import Worker
from workbench.views.page.html import BAD, MUTED, block, text
from workbench.views.page.panels import PANELS
from workbench.views.page.panels.arm import CHOSEN, MODELS
from workbench.views.page.panels.data import FILES
from workbench.views.page.panels.panel import AbstractPanel, on_press

PURPOSE = (
    "workbench calibrates a robot arm, so that its tool goes where it is commanded: design a plate, measure "
    "the arm on it, identify its actual geometry, and find the errors that geometry can't explain."
)
"""What the program is for."""
INTRODUCTION = "Nothing is final: every tab stays available, and Undo restores the current state."
BOTH = "Choose the robot, then its measurements; files can be dropped on the buttons."
FIRST = "Choose the robot; the rest is in the {} tab."
ALONE = "Choose the robot: you get a plate with ten targets in front of it, to be optimised and manufactured."


class StartCard(AbstractPanel):
    """A modal over the page, there at first if `is_open`; `show_demo` begins the demo."""

    depends = ("robot", "measurements.loaded", "measurements.unread", "is_idle")

    def __init__(self, worker: Worker, show_demo: Callable[[], None], *, is_open: bool = True):
        super().__init__(worker)
        self._show_demo, self._is_open_at_first = show_demo, is_open
        self._modal: viser.GuiModalHandle | None = None
        self._wants_data = False
        self._begins: type[AbstractCommand] | None = None
        self._ends_at, self._designs = Tab.PLATE, False

    def build(self, gui: viser.GuiApi) -> None:
        self._every_page = gui
        if self._is_open_at_first:
            self._open(gui)

    def build_reopen_button(self, gui: viser.GuiApi) -> None:
        """A button that opens the card again."""
        again = gui.add_button("What do you have?", icon=viser.Icon.HOME, color="gray", hint=INTRODUCTION)

        @again.on_click
        def _(event: viser.GuiEvent) -> None:
            if event.client is not None:
                self._open(event.client.gui)

    def ask(self) -> None:
        """Open it on every page, instead of the demo."""
        self._worker.submit(SetCaption(""))
        self._open(self._every_page)

    def _open(self, gui: viser.GuiApi) -> None:
        if self._modal is not None:
            self._modal.close()
        icon, self._gui = viser.Icon, gui
        before = self._worker.session.measurements
        self._before, self._message_number = (
            (before.loaded, before.unread),
            self._worker.session.page.message_count,
        )
        self._begins, self._ends_at, self._designs = None, Tab.PLATE, False
        self._modal = gui.add_modal("What do you have?")
        with self._modal:
            self._message = gui.add_html("")
            self._entries = [
                self._entry(
                    gui,
                    "A robot and measurements",
                    icon.DATABASE,
                    lambda: self._ask(wants_data=True),
                    main=True,
                ),
                self._entry(gui, "Only a robot", icon.ROBOT, lambda: self._ask(wants_data=False)),
                *(
                    self._entry(gui, *kind.door[:2], partial(self._go_in, kind))
                    for kind in sorted(PANELS.values(), key=lambda kind: kind.order)
                    if kind.door is not None
                ),
                self._entry(gui, "Nothing yet: show me", icon.PLAYER_PLAY, self._demo),
            ]
            self._questions = gui.add_folder(None, visible=False)
            with self._questions:
                self._build_questions(gui)
            self._done = self._entry(gui, "Look around", icon.EYE, self._finish)
            self._back = self._entry(gui, "Back", icon.ARROW_LEFT, lambda: self._open(gui))
            self._back.visible = False
        self.show(self._worker.session)

    def _build_questions(self, gui: viser.GuiApi) -> None:
        """The robot, and its measurements; in folders, as viser always shows a button for uploads."""
        self._robot = gui.add_dropdown("Built in", (CHOSEN, *built_in_robots()), hint="The built-in arms.")
        self.sends(self._robot, self._choose)
        self.upload(
            "… or your robot: URDF or TOML", load, "The nominal arm.", endings=MODELS, maximum=LARGEST_FILE
        )
        self._data = gui.add_folder(None)
        with self._data:
            self.upload(
                "Measurements: CSV, Excel or Parquet",
                load,
                "Joint positions and measured poses, units in brackets as in q1[deg] or x[mm].",
                endings=FILES,
                maximum=LARGEST_FILE,
                main=True,
            )

    def show(self, session: Session) -> None:
        if self._modal is None:
            return
        loaded, unread = self._before
        is_read = session.measurements.loaded not in (None, loaded)
        file = None if session.measurements.unread is unread else session.measurements.unread
        rival = "" if file is None or file.match is None else file.match.rival  # the strip offers that arm
        if is_read or rival or session.measuring is not None:
            self._leave(Tab.CALIBRATE)
            if is_read and self._begins is not None:
                self._worker.submit(self._begins())
            return
        newer = (m for m in reversed(session.page.messages) if m.number > self._message_number)
        newest, bad = next(newer, None), (Severity.WARNING, Severity.ERROR)
        wrong = newest.text if newest is not None and newest.severity in bad else ""
        working = f"{session.page.job.title} …" if session.page.job is not None else ""
        self._message.content = self._message_text(session, wrong, working)

    def _message_text(self, session: Session, wrong: str, working: str) -> str:
        is_asking = self._questions.visible
        designs = ALONE if self._designs else FIRST.format(self._ends_at.value.capitalize())
        sentence = INTRODUCTION if not is_asking else BOTH if self._wants_data else designs
        purpose = "" if is_asking else f'<div style="font-size:15px;margin-bottom:6px">{text(PURPOSE)}</div>'
        robot = f"<div><b>Robot: {text(session.robot.name)}</b>, {session.robot.dof} joints</div>"
        return block(
            f'{purpose}<div style="color:{MUTED}">{sentence}</div>'
            + (robot if is_asking else "")
            + f'<div style="color:{BAD}">{text(wrong)}</div><div>{text(working)}</div>',
            testid="start",
            style="margin-bottom:8px",
        )

    def _entry(
        self,
        gui: viser.GuiApi,
        label: str,
        icon: viser.IconName,
        go: Callable[[], None],
        *,
        main: bool = False,
    ) -> viser.GuiButtonHandle:
        made = gui.add_button(label, icon=icon, color=None if main else "gray", hint=INTRODUCTION)
        on_press(made, go)
        return made

    def _choose(self) -> ChooseRobot | None:
        return None if self._robot.value == CHOSEN else ChooseRobot(self._robot.value)

    def _ask(self, *, wants_data: bool) -> None:
        """Show what is needed for one of the first two options."""
        self._wants_data = wants_data
        for button in self._entries:
            button.visible = False
        self._questions.visible, self._data.visible, self._back.visible = True, wants_data, True
        if not wants_data:
            self._done.label, self._done.color = "Design a plate for it", None
            self._done.icon, self._designs = viser.Icon.SPARKLES, True
        self.show(self._worker.session)

    def _go_in(self, kind: type[AbstractPanel]) -> None:
        """Ask for what a panel begins with, and lead there."""
        assert kind.door is not None
        self._begins = kind.door[2]
        self._ask(wants_data=self._begins is not None)
        if self._begins is None:
            self._done.label, self._ends_at, self._designs = "With this robot", kind.tab, False
            self.show(self._worker.session)

    def _finish(self) -> None:
        """Close it; with a robot alone, have its plate designed."""
        self._leave(self._ends_at)
        if self._designs:
            self._worker.submit(ImprovePlate(seed=len(self._worker.session.history.scores)))

    def _demo(self) -> None:
        self._leave(Tab.PLATE)
        self._show_demo()

    def _leave(self, tab: Tab) -> None:
        if self._modal is not None:
            modal, self._modal = self._modal, None
            modal.close()
            self._worker.submit(OpenTab(tab))


def load(name: str, content: bytes) -> AbstractCommand:
    """What a dropped file is: a robot or measurements, on whichever of the two buttons."""
    is_model = name.lower().endswith((*MODELS.split(","), ".xacro"))
    return LoadModel(name, content) if is_model else load_command(name, content)
