"""The start card: what do you have? It closes once there is something to work on."""

from collections.abc import Callable, Iterable
from functools import partial

import viser

from workbench.base.assets import built_in_robots
from workbench.base.wording import capital
from workbench.session.command import AbstractCommand, at_stake
from workbench.session.commands.arm import ChooseRobot, LoadModel, holds_robot
from workbench.session.commands.data import MAX_FILE_BYTES, load_command, load_endings
from workbench.session.commands.identify import Identify
from workbench.session.commands.messages import OpenTab, SetCaption
from workbench.session.commands.plate import ImprovePlate
from workbench.session.page_state import Severity, Tab
from workbench.session.state import Session
from workbench.session.worker import Worker
from workbench.views.page.html import BAD, GOOD, MUTED, block, text
from workbench.views.page.panels import panels
from workbench.views.page.panels.arm import CHOSEN, MODELS
from workbench.views.page.panels.form import ask
from workbench.views.page.panels.panel import AbstractPanel, Build, Door

PURPOSE = (
    "workbench calibrates a robot arm, so that its tool goes where it is commanded: design a plate, measure "
    "the arm on it, identify its actual geometry, and find the errors that geometry can't explain."
)
"""What the program is for."""
INTRODUCTION = "Nothing is final: every tab stays available, and Undo takes any step back."
ROWS = Door("A robot and measurements", viser.Icon.DATABASE, Identify)
DEMO = "Play the demo"
ALONE = "Choose the robot: you get a plate with ten targets in front of it, to be optimised and manufactured."


class StartCard(AbstractPanel):
    """A modal over the page, there at first if `is_open`; `show_demo` begins the demo."""

    depends = ("robot", "measurements.loaded", "measurements.unread", "parts", "is_idle")

    def __init__(self, worker: Worker, show_demo: Callable[[], None], *, is_open: bool = True):
        super().__init__(worker)
        self._show_demo, self._is_open_at_first = show_demo, is_open
        self._unasked = worker.session.robot if is_open else None  # nobody has chosen it
        self._modal: viser.GuiModalHandle | None = None
        self._door: Door | None = None
        self._ends_at = Tab.CALIBRATE

    def build(self, gui: viser.GuiApi) -> None:
        self._every_page = gui
        if self._is_open_at_first:
            self._open(gui)

    def build_reopen_button(self, gui: viser.GuiApi) -> None:
        """A button that opens the card again."""

        def reopen(event: viser.GuiEvent) -> None:
            if event.client is not None:
                self._open(event.client.gui)

        self._gui = gui
        self.press("What do you have?", reopen, viser.Icon.HOME, INTRODUCTION)

        def play(event: viser.GuiEvent) -> None:
            lost = at_stake(self.session)
            ask(event, "Remove the present measurements?", lost, DEMO, self._demo) if lost else self._demo()

        self.press(DEMO, play, viser.Icon.PLAYER_PLAY, "A real arm, from plate to causes, in two minutes.")

    def ask(self) -> None:
        """Open it on every page, instead of the demo."""
        self._worker.submit(SetCaption(""))
        self._open(self._every_page)

    def _open(self, gui: viser.GuiApi) -> None:
        if self._modal is not None:
            self._modal.close()
            self._controls.clear()
        icon, self._gui = viser.Icon, gui
        self._before, self._door, self._ends_at = self._worker.session, None, Tab.CALIBRATE
        doors = {
            kind.door: kind.tab
            for kind in sorted(panels(), key=lambda kind: kind.order)
            if kind.door is not None and kind.tab is not None
        }
        entry = partial(self.button, hint=INTRODUCTION)
        self._modal = gui.add_modal("What do you have?")
        with self._modal:
            self._message = gui.add_html("")
            self._entries = [
                entry(ROWS.label, partial(self._ask, ROWS, Tab.CALIBRATE), ROWS.icon, main=True),
                entry("Only a robot: design a plate", partial(self._ask, None, Tab.CALIBRATE), icon.ROBOT),
                *(entry(door.label, partial(self._ask, door, tab), door.icon) for door, tab in doors.items()),
                entry("Nothing yet: show me", self._demo, icon.PLAYER_PLAY),
            ]
            self._questions = gui.add_folder(None, visible=False)
            with self._questions:
                self._build_questions(gui, dict.fromkeys(door.build for door in (ROWS, *doors)))
            self._done = entry("Look around", self._finish, icon.EYE)
            self._back = entry("Back", partial(self._open, gui), icon.ARROW_LEFT)
            self._back.visible = False
        self.show(self._worker.session)

    def _build_questions(self, gui: viser.GuiApi, builders: Iterable[Build | None]) -> None:
        """The robot, and its measurements; in folders, as viser always shows a button for uploads."""
        label, hint = (
            "Your robot: URDF, TOML, ZIP, DH table",
            "The nominal arm; a URDF with its meshes as a ZIP.",
        )
        self.upload(label, load, hint, endings=f"{MODELS},.csv", maximum=MAX_FILE_BYTES)
        robot = self.dropdown("… or built in", (CHOSEN, *built_in_robots()), "The built-in arms.")
        self.form(lambda name: None if name == CHOSEN else ChooseRobot(name), robot)
        for title, make in (kind.names_robot for kind in panels() if kind.names_robot is not None):
            with gui.add_folder(title, expand_by_default=False):
                make(self, gui)
        self._inputs = {build: gui.add_folder(None) for build in builders}
        for build, folder in self._inputs.items():
            with folder:
                (build or _ask_for_rows)(self, gui)

    def show(self, session: Session) -> None:
        if self._modal is None and self._door is None:
            return
        now, before = session.measurements, self._before.measurements
        loaded = None if now.loaded is before.loaded else now.loaded
        file = None if now.unread is before.unread else now.unread
        match = None if (given := loaded or file) is None else given.match
        rival = "" if match is None else match.rival
        is_other = rival if loaded is None else loaded.is_foreign
        if loaded is not None or is_other or session.mode is not None or self._modal is None:
            door, unasked, self._unasked = self._door, self._unasked, None
            self._leave(self._ends_at)
            if is_other:
                self._door = door  # what begins waits for that arm, which the strip offers
                if session.robot is unasked and rival:
                    self._worker.submit(ChooseRobot(rival, keep=True))
            elif loaded is not None and door is not None and door.begins is not None:
                self._worker.submit(door.begins())
            return
        old = self._before.page.message_count
        newer = (m for m in reversed(session.page.messages) if m.number > old)
        told = next((m for m in newer if m.severity is not Severity.LOG), None)
        working = f"{session.page.job.title} …" if session.page.job is not None else ""
        is_asking = self._questions.visible
        sentence = INTRODUCTION if not is_asking else ALONE if self._door is None else self._door.asks
        purpose = "" if is_asking else f'<div style="font-size:15px;margin-bottom:6px">{text(PURPOSE)}</div>'
        ink = GOOD if told is None or told.severity is Severity.INFO else BAD
        robot = f"<div><b>Robot: {text(session.robot.name)}</b>, {session.robot.dof} joints</div>"
        self._message.content = block(
            f'{purpose}<div style="color:{MUTED}">{sentence}</div>'
            + (robot if is_asking else "")
            + ("" if told is None else f'<div style="color:{ink}">{text(capital(told.text))}</div>')
            + f"<div>{text(working)}</div>",
            testid="start",
            style="margin-bottom:8px",
        )

    def _ask(self, door: Door | None, tab: Tab) -> None:
        """Show what is needed for an answer, which leads to this tab; None: a robot alone."""
        self._door, self._ends_at = door, tab
        for button in self._entries:
            button.visible = False
        self._questions.visible = self._back.visible = True
        for build, folder in self._inputs.items():
            folder.visible = door is not None and door.build is build
        if door is None:
            self._done.label, self._done.color = "Design a plate for it", None
            self._done.icon = viser.Icon.SPARKLES
        self.show(self._worker.session)

    def _finish(self) -> None:
        """Close it; with a robot alone, have its plate designed."""
        is_alone = self._questions.visible and self._door is None
        self._leave(Tab.PLATE if self._door in (None, ROWS) else self._ends_at)
        if is_alone:
            self._worker.submit(ImprovePlate(seed=len(self._worker.session.history.past)))

    def _demo(self) -> None:
        self._leave(Tab.PLATE)
        self._show_demo()

    def _leave(self, tab: Tab) -> None:
        self._door = None
        if self._modal is not None:
            modal, self._modal = self._modal, None
            modal.close()
            self._controls.clear()
            self._worker.submit(OpenTab(tab))


def _ask_for_rows(panel: AbstractPanel, gui: viser.GuiApi) -> None:
    panel.upload(
        "Measurements: CSV, Excel or Parquet",
        load,
        "Joint positions and measured poses, units in brackets as in q1[deg] or x[mm].",
        endings=",".join(load_endings()),
        maximum=MAX_FILE_BYTES,
        main=True,
    )


def load(name: str, content: bytes) -> AbstractCommand:
    """What a dropped file is: a robot or measurements, on whichever of the two buttons."""
    return LoadModel(name, content) if holds_robot(name, content) else load_command(name, content)
