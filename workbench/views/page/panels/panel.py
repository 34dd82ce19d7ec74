"""The base class of panels, shared helpers, and the decision which panels need redrawing."""

import asyncio
import math
import time
from abc import abstractmethod
from collections.abc import Callable
from functools import partial
from operator import attrgetter
from typing import Any, ClassVar, NamedTuple

import viser

from workbench.base.errors import WorkbenchError
from workbench.base.wording import capital
from workbench.session.command import AbstractCommand
from workbench.session.commands.data import too_large
from workbench.session.commands.messages import Tell
from workbench.session.export import Make, calibrated_toml, calibrated_urdf
from workbench.session.page_state import Severity, Tab
from workbench.session.state import Session
from workbench.session.worker import Worker
from workbench.views.drawables.sink import is_same
from workbench.views.page.panels.form import AbstractControls, Control, ask
from workbench.views.page.viser_internals import forget_uploads, limit_upload
from workbench.views.page.viser_internals import set_value as set_value

ARRIVED = 0.3
"""How long a page has to note that a file has come [s]: without its button the note would load for ever."""
AFTERWARDS = math.inf
"""The `pause` of a panel that waits until a drag is over."""


Build = Callable[["AbstractPanel", viser.GuiApi], object]
"""Makes controls for a panel that sends what they ask for."""


class Door(NamedTuple):
    """An answer to "What do you have?" on the start card that leads to a panel.

    Args:
        label: The answer.
        icon: Its icon.
        begins: What begins by itself with robot and measurements.
        asks: What the card asks for, in a sentence.
        build: Makes the controls for it; None: those for a file of measurements.
    """

    label: str
    icon: viser.IconName
    begins: type[AbstractCommand] | None = None
    asks: str = "Choose the robot, then its measurements; rows of a built-in robot tell which one."
    build: Build | None = None


class AbstractPanel(AbstractControls):
    """Controls on the page: `build` makes them once; afterwards each shows what it was made to show of the
    session, and `show` changes what is left."""

    tab: ClassVar[Tab | None] = Tab.ROBOT
    """Where it stands; None: above the tabs, and in place of them in a mode (`AbstractPart.is_mode`)."""
    order: ClassVar[int] = 100
    """Its place there: a panel of a lower number is above it."""
    pause: ClassVar[float] = 0.25
    """Minimum time between two drawings during a drag [s]; with 0, at every step before all else."""
    depends: ClassVar[tuple[str | Callable[[Session], Any], ...]] = ()
    """What the controls show: names of parts of the session, or what finds one; plain values, and objects
    that a command replaces to change them."""
    door: ClassVar[Door | None] = None
    names_robot: ClassVar[tuple[str, Build] | None] = None
    """Another way to say on the start card which robot it is: its title, and its controls."""
    keeps_typed: ClassVar[bool] = False
    """Whether controls stay as they are when a message comes. It may be a refusal: all others then go back to
    what the session has."""

    link: Callable[[str, Callable[[], None]], str] = staticmethod(lambda name, do: "")
    """Where a link leads that does something; its name must be unique, and empty is what pages can't tell."""

    def __init__(self, worker: Worker):
        super().__init__(worker)
        self._parts: tuple[Any, ...] = ()
        self._drawn = -math.inf

    def make(self, gui: viser.GuiApi) -> None:
        """Make the controls in the present container of this interface."""
        self._gui = gui
        self.build(gui)

    @abstractmethod
    def build(self, gui: viser.GuiApi) -> None:
        """Make the controls in the present container; their callbacks only send commands."""

    def show(self, session: Session) -> None:
        """Bring in line with this snapshot what no control shows by itself."""

    def update(self, session: Session) -> bool:
        """Show this snapshot, if anything is new in it; returns whether that has to wait a while."""
        if session.drag is not None and time.monotonic() - self._drawn < self.pause:
            return self.pause < AFTERWARDS
        finders = (attrgetter(part) if isinstance(part, str) else part for part in self.depends)
        parts = (0 if self.keeps_typed else session.page.message_count, *(find(session) for find in finders))
        if len(parts) != len(self._parts) or not all(map(is_same, parts, self._parts)):
            self._parts, self._drawn = parts, time.monotonic()
            self.show_fields(session)
            self.show(session)
        return False

    def download(self, label: str, make: Make, hint: str, **more: Any) -> viser.GuiButtonHandle:
        """A button that saves a file on the user's machine."""
        return self.press(label, lambda event: self.save(event, make), viser.Icon.DOWNLOAD, hint, **more)

    def upload(
        self,
        label: str,
        command: Callable[[str, bytes], AbstractCommand | None],
        hint: str,
        *,
        endings: str,
        maximum: int,
        main: bool = False,
        **more: Any,
    ) -> viser.GuiUploadButtonHandle:
        """A button that sends a command with a file's name and contents; a file of more bytes is refused."""
        made = self._gui.add_upload_button(
            label, icon=viser.Icon.UPLOAD, color=None if main else "gray", mime_type=endings, hint=hint
        )
        self.add(Control(made, **more))
        too_much = f"'{label}' takes files of at most {maximum / 2**20:.3g} MiB; nothing was sent"
        address = self.link(f"large-{id(made)}", lambda: self._worker.submit(Tell(too_much)))
        limit_upload(self._gui, made, maximum, address)

        @made.on_upload
        async def _(event: viser.GuiEvent) -> None:
            file = event.target.value
            name, content = file.name, bytes(file.content)
            if len(file.content) > maximum:
                self._worker.submit(Tell(f"{too_large(file.name, len(file.content), maximum)} here"))
                return
            await asyncio.sleep(ARRIVED)
            forget_uploads(self._gui)
            await asyncio.to_thread(self.send, partial(command, name, content), event)

        return made

    def save(self, event: viser.GuiEvent, make: Make, *, is_arm: bool = False) -> None:
        """Download a file; errors are shown on the page instead of being lost in viser's thread pool.

        Args:
            is_arm: Whether the file is a calibrated arm, so that one that should not be used is asked about.
        """
        results, reason = self._worker.session.results, ""
        is_arm = is_arm or make in (calibrated_toml, calibrated_urdf)
        if is_arm and results.identification is not None and results.run is not None:
            refused = results.identification.refused(results.run)
            held = ("", "TOML" if make is calibrated_toml else "URDF")
            reason = "; ".join(refused[name] for name in held if name in refused)
        if reason:
            anyway = partial(self._download, event, partial(make, force=True))
            ask(event, "Save an arm that should not be used?", capital(reason), "Save anyway", anyway)
        else:
            self._download(event, make)

    def _download(self, event: viser.GuiEvent, make: Make) -> None:
        notice = event.client and event.client.add_notification("Making the file …", "", loading=True)
        try:
            made = make(self._worker.session)
            if event.client is not None:
                event.client.send_file_download(made[0], made[1], save_immediately=True)
            if len(made) == 3 and made[2]:
                self._worker.submit(Tell(f"{made[0]}: {'; '.join(made[2])}.", Severity.WARNING))
        except WorkbenchError as error:
            self._worker.submit(Tell(str(error)))
        except Exception as error:
            self._worker.submit(Tell(f"the file could not be made ({type(error).__name__}: {error})"))
        finally:
            if notice is not None:
                notice.remove()
