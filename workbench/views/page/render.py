"""The browser as a view of the session: the scene and the panels, drawn together; tabs that the program can
open, and what pages tell it."""

import json
import re
from collections.abc import Callable
from functools import partial

import viser

from workbench.base.remedy import speak_to_page
from workbench.parts import BROKEN, warn_of_broken
from workbench.session.commands.messages import NoteTab, Tell
from workbench.session.page_state import Severity, Tab
from workbench.session.state import Session
from workbench.session.view import AbstractView
from workbench.session.worker import Worker
from workbench.views.page.local_server import LocalServer
from workbench.views.page.panels import panels as all_panels
from workbench.views.page.panels.header import CaptionPanel, Messages, Strip
from workbench.views.page.panels.legend import LegendPanel
from workbench.views.page.panels.panel import AbstractPanel
from workbench.views.page.panels.start_card import StartCard
from workbench.views.page.scene.gizmo import Gizmo
from workbench.views.page.scene.scene import Scene, aim
from workbench.views.page.style import NARROW, PANEL_WIDTH, PHONE, PHONE_SCENE, WIDE_SHARE, paint
from workbench.views.page.viser_internals import hand_over, icons_at_once, run_script

MIN_WIDTH, WINDOW_SHARE = 340, 0.42
"""Where the window is narrow: minimum width of the panel [px], and its share of the window."""
FIRST = Tab.PLATE
"""The tab that a page opens at first."""
SIZED = """{
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const tell = () => {
    new Image().src = `ADDRESS${innerWidth}x${innerHeight}${dark.matches ? "-dark" : ""}`;
  };
  let soon;
  addEventListener("resize", () => { clearTimeout(soon); soon = setTimeout(tell, 400); });
  dark.addEventListener("change", tell);
  tell();
}"""


class PageSignals:
    """Messages from the pages of a local server: viser has no message for it, so a page asks for a picture.

    The picture is not there; its address is the message. It holds a secret, so that no other page can send
    one.
    """

    def __init__(self, server: viser.ViserServer):
        self._server = server
        self._answers: dict[str, Callable[[], None]] = {}
        self._told: dict[str, Callable[[int, int, bool], None]] = {}
        if isinstance(server, LocalServer):
            server.heard = self._heard

    def turned(self, do: Callable[[Tab], None]) -> None:
        """Have every page tell which of its tabs is open, also a page that comes later."""
        addresses = {tab: self.pressed(f"open-{tab}", partial(do, tab)) for tab in Tab}
        run_script(self._server.gui, f"window.tabs = {json.dumps(addresses)};")

    def told(self, client: viser.ClientHandle, do: Callable[[int, int, bool], None]) -> None:
        """Have a client's page tell the width and height of its window [px], and whether its system prefers
        dark colours, now and when they change: the camera's size is that of the scene, without a docked
        panel, in the screen's pixels."""
        self._told[name := f"window-{client.client_id}"] = do
        address = self._address(f"{name}-")
        run_script(client.gui, SIZED.replace("ADDRESS", address))

    def pressed(self, text: str, do: Callable[[], None]) -> str:
        """Where a link leads that does something: a page gets no answer there, and stays as it is."""
        self._answers[text] = do
        return self._address(text)

    def _heard(self, text: str) -> None:
        if text in self._answers:
            self._answers[text]()
        elif window := re.fullmatch(r"(window-\d+)-(\d{1,5})x(\d{1,5})(-dark)?", text):
            name, width, height, dark = window.groups()
            if (do := self._told.get(name)) is not None:
                do(int(width), int(height), bool(dark))

    def _address(self, text: str) -> str:
        return self._server.message_path + text if isinstance(self._server, LocalServer) else ""


class Tabs:
    """The tab group of the panel; a new page opens the `first` one, or else the leftmost.

    viser has no word for opening a tab: a script of the page's presses it (`style.py`).
    """

    def __init__(self, server: viser.ViserServer, *, first: Tab | None = None):
        self._server, self._opened = server, first
        self.group = server.gui.add_tab_group()
        server.on_client_connect(
            lambda client: self.open_on(client, self._opened)
        )  # pages that are there, too

    def open(self, tab: Tab) -> None:
        """Open a tab on every page, and on those that come later."""
        self._opened = tab
        for client in self._server.get_clients().values():
            self.open_on(client, tab)

    def open_on(self, client: viser.ClientHandle, tab: Tab | None) -> None:
        if tab is not None:
            run_script(client.gui, f"window.wanted = {json.dumps(tab)};")


class BrowserView(AbstractView):
    """Draws every snapshot in one atomic message batch, so that no page shows half of it.

    In a drag the numbers that count go first, alone: a page shows them without waiting for its next frame,
    which takes long where the scene is drawn without a graphics card. Nothing waits for viser's own window.
    The arguments are those of `App`.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        worker: Worker,
        *,
        show_demo: Callable[[], None] = lambda: None,
        asks: bool = False,
    ):
        self._server, self._worker = server, worker
        self._failed: set[str] = set()
        self._shown_broken = set[str]()
        session = worker.session
        speak_to_page()
        with server.atomic():
            self._scene = Scene(server, worker, session)
        server.flush()  # a page draws the arm while the panels are made
        with server.atomic(), icons_at_once():
            self._opened = session.page.opened
            self._card = StartCard(worker, show_demo, is_open=asks)
            signals = PageSignals(server)
            self._panels, self._tabs = _build_panels(server, worker, self._card, signals)
            signals.turned(lambda tab: worker.submit(NoteTab(tab)))
            for panel in self._panels:
                self._update(panel, session)
            self._is_mode = session.mode is not None
            self._tabs.group.visible = not self._is_mode

    @property
    def gizmo(self) -> Gizmo:
        """The handles of the selected target."""
        return self._scene.gizmo

    def draw(self, session: Session) -> None:
        if session.drag is not None:
            with self._server.atomic():
                for panel in self._panels:
                    if panel.pause == 0.0:
                        self._update(panel, session)
            hand_over(self._server)
        with self._server.atomic():
            self._guarded("the scene", self._scene.show, session)
            waits = [self._update(panel, session) for panel in self._panels]
        self._server.flush()
        for sentence in BROKEN.keys() - self._shown_broken:
            self._worker.submit(Tell(sentence, Severity.WARNING))
            self._shown_broken.add(sentence)
        self.is_behind = self._scene.is_behind or any(waits)
        if (is_mode := session.mode is not None) is not self._is_mode:
            self._is_mode = is_mode
            self._tabs.group.visible = not is_mode
            if not is_mode:  # a page may have forgotten which one was open
                self._tabs.open(session.page.tab or Tab.MEASURE)
        if session.page.opened > self._opened and session.page.tab is not None:
            self._tabs.open(session.page.tab)
        self._opened = session.page.opened

    def _update(self, panel: AbstractPanel, session: Session) -> bool:
        """Show a panel; one that raises is told of once, and the others are shown all the same."""
        return bool(self._guarded(f"the panel {type(panel).__name__}", panel.update, session))

    def _guarded(self, name: str, show: Callable[[Session], bool | None], session: Session) -> bool | None:
        try:
            return show(session)
        except Exception as error:
            if name not in self._failed:
                self._failed.add(name)
                warn_of_broken(name, error)
            return None


def _build_panels(
    server: viser.ViserServer, worker: Worker, card: StartCard, signals: PageSignals
) -> tuple[list[AbstractPanel], Tabs]:
    gui = server.gui
    server.on_client_connect(lambda client: signals.told(client, _fitter(server, client)))
    panels: list[AbstractPanel] = []

    def make(panel: AbstractPanel) -> None:
        panel.link = signals.pressed  # type: ignore[method-assign]
        panel.make(gui)
        panels.append(panel)

    def make_all(tab: Tab | None) -> None:
        for kind in sorted((p for p in all_panels() if p.tab is tab), key=lambda p: p.order):
            try:
                make(kind(worker))
            except Exception as error:  # whatever is wrong with somebody else's package
                warn_of_broken(f"the panel {kind.__name__}", error)

    with gui.add_folder("Next"):  # above the tabs; the style sheet keeps it in view
        make(Strip(worker))
    make_all(None)
    tabs = Tabs(server, first=worker.session.page.tab or FIRST)
    for tab in Tab:
        with tabs.group.add_tab(tab):
            if tab is Tab.ROBOT:
                card.build_reopen_button(gui)
            make_all(tab)
    make(Messages(worker))
    make(LegendPanel(worker))
    make(card)
    make(CaptionPanel(worker, card.ask))
    return panels, tabs


def _fitter(server: viser.ViserServer, client: viser.ClientHandle) -> Callable[[int, int, bool], None]:
    """What leaves the scene its part of a client's window [px], and shows it whole where that changes; and
    makes that page light or dark."""
    was_wide, was_dark = True, False

    def fit(window: int, height: int, is_dark: bool) -> None:
        nonlocal was_wide, was_dark
        if is_dark is not was_dark:
            paint(client.gui, is_dark=is_dark)
        is_wide, is_phone = window > NARROW, window <= PHONE
        width = max(PANEL_WIDTH, WIDE_SHARE * window) if is_wide else max(MIN_WIDTH, WINDOW_SHARE * window)
        client.gui.main_panel.set_width(width)
        if not (is_wide and was_wide):
            first = server.initial_camera  # a page that has just been opened may not look from there yet
            aspect = window / (0.01 * PHONE_SCENE * height) if is_phone else (window - width) / height
            aim(client, first.position, first.look_at, aspect=aspect)
        was_wide, was_dark = is_wide, is_dark

    return fit
