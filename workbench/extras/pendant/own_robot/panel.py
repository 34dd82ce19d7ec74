"""One's own robot on the page, by its table or its file, checked against typed poses."""

from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path

import viser

from workbench.base.errors import FileError, OptionError
from workbench.data.readers.text import decode
from workbench.extras.pendant.own_robot.table_meanings import read_joint_table
from workbench.session.commands.arm import LARGEST_MODEL, LoadModel
from workbench.session.commands.data import as_files
from workbench.session.export import robot_toml
from workbench.session.page_state import Tab
from workbench.session.state import Session
from workbench.views.page.html import MUTED, block, text
from workbench.views.page.panels.panel import AbstractPanel, set_value

HOW = """One joint a line below the headings, such as
theta [deg], d [mm], a [mm], alpha [deg]
0, 399, 0, -90
Poses tell units, signs, zeros and convention: three or more from the pendant (flange in the base), such as
0, -90, 90, 0, 90, 0 = 9, 2, 500, 180, 0, 90
or six or more measured rows below their headings, of any tool in any frame."""


def build_table(panel: AbstractPanel, gui: viser.GuiApi) -> Callable[[str, bytes], LoadModel]:
    """Fields for a table and poses, and what opens the robot; returns what opens a file likewise.

    They show the table that was last given, even if it was refused, until something else is typed there.
    """
    seen: LoadModel | None = None

    def given(session: Session) -> str:
        nonlocal seen
        opened = (e.command for e in reversed(panel._worker.journal) if isinstance(e.command, LoadModel))
        last = next((each for each in opened if each.name.lower().endswith(".csv")), None)
        if last is seen or last is None:
            return str(table.typed)
        seen = last
        set_value(poses.control, "\n".join(last.poses))
        with suppress(FileError):  # no text
            return decode(last.content, Path(last.name))[0]
        return ""

    gui.add_html(block(text(HOW), style=f"color:{MUTED};white-space:pre-line"))
    hint = "Of your robot; without one, poses check the open robot."
    table = panel.line("DH table", hint, multiline=True, value=given)
    hint = "Joint positions = x, y, z and three angles, one a line; or a table of measured rows."
    poses = panel.line("Poses", hint, multiline=True)
    fill = lambda _, content: set_value(poses.control, content.decode(errors="replace"))  # noqa: E731
    panel.upload("Poses from a file", fill, hint, endings=".csv,.txt", maximum=LARGEST_MODEL)

    def checked(name: str, content: bytes) -> LoadModel:
        return LoadModel(name, content, tuple(filter(None, map(str.strip, poses.typed.splitlines()))))

    def opened(convention: str) -> LoadModel:
        if not (table.typed.strip() or poses.typed.strip()):
            raise OptionError("type a DH table, or poses that the open robot has to give")
        if not table.typed.strip():
            return checked(*robot_toml(panel.session))
        with as_files({"the table": table.typed.encode()}) as (path,):
            read_joint_table(path)  # what is wrong is said by the lines that were typed
        said = convention and f"# convention = {convention}\n"
        return checked("own-robot.csv", f"{said}{table.typed}".encode())

    hint = "Start over with the arm of this table. Poses check it, and tell its convention if it isn't known."
    ways = {"Standard DH": "dh", "Modified (Craig)": "craig", "By poses": ""}
    panel.buttons("Open as", {name: partial(opened, own) for name, own in ways.items()}, hint)
    return checked


class OwnRobotPanel(AbstractPanel):
    """A closed folder: what it is, three poses, a check, the robot's file."""

    tab, order = Tab.ROBOT, 20
    keeps_typed = True
    names_robot = "… or its DH table", build_table
    depends = ("robot", "is_idle")

    def build(self, gui: viser.GuiApi) -> None:
        with gui.add_folder("Your own robot", expand_by_default=False):
            checked = build_table(self, gui)
            label, hint = ("… or its file", "Its table (.csv) or description, which has to give these poses.")
            self.upload(label, checked, hint, endings=".csv,.urdf,.xml,.toml", maximum=LARGEST_MODEL)
            self.download("This robot (TOML)", robot_toml, "The robot as it is now, before any calibration.")
