"""The browser as a view of the session: the scene and the panels, drawn together."""

import contextlib
import zipfile
from collections.abc import Iterator
from types import SimpleNamespace
from unittest import mock

import viser
from viser import _icons

from workbench.session.state import Session
from workbench.session.view import AbstractView
from workbench.session.worker import Worker
from workbench.views.page.html import MUTED, block, text
from workbench.views.page.panels.arm import ArmPanel
from workbench.views.page.panels.arrange import ArrangePanel, TablePanel
from workbench.views.page.panels.bending import BendingPanel
from workbench.views.page.panels.choices import ChoicesPanel
from workbench.views.page.panels.compare import ComparePanel
from workbench.views.page.panels.data import DataPanel
from workbench.views.page.panels.diagnose import DiagnosePanel
from workbench.views.page.panels.files import FilesPanel
from workbench.views.page.panels.fit import FitPanel
from workbench.views.page.panels.guided import GuidedPanel
from workbench.views.page.panels.header import Header
from workbench.views.page.panels.history import HistoryPanel
from workbench.views.page.panels.index import IndexPanel
from workbench.views.page.panels.influence import InfluencePanel
from workbench.views.page.panels.jog import CapturedPanel, JogPanel, ToolPanel
from workbench.views.page.panels.look import LookPanel
from workbench.views.page.panels.panel import AbstractPanel
from workbench.views.page.panels.production import NoisePanel, ProductionPanel
from workbench.views.page.panels.region import RegionPanel
from workbench.views.page.panels.targets import TargetsPanel
from workbench.views.page.panels.track import TrackPanel
from workbench.views.page.scene.gizmo import Gizmo
from workbench.views.page.scene.scene import Scene

PANEL_WIDTH = 470
TABS: dict[str, tuple[type[AbstractPanel], ...]] = {
    "Plate": (
        TargetsPanel,
        IndexPanel,
        HistoryPanel,
        InfluencePanel,
        ArrangePanel,
        TablePanel,
        ProductionPanel,
        NoisePanel,
    ),
    "Region": (RegionPanel,),
    "Measure": (DataPanel, GuidedPanel),
    "Identify": (FitPanel, ChoicesPanel),
    "Diagnose": (DiagnosePanel,),
    "Compare": (ComparePanel, TrackPanel, BendingPanel),
    "More": (ArmPanel, JogPanel, ToolPanel, CapturedPanel, FilesPanel, LookPanel),
}
"""Every panel, by its tab."""


class BrowserView(AbstractView):
    """Draws every snapshot in one message window, so that no page shows half of it.

    Args:
        server: Where.
        worker: What takes the commands.
        link: Address of the page with this session; empty if it is not recorded.
    """

    def __init__(self, server: viser.ViserServer, worker: Worker, *, link: str = ""):
        self._server = server
        session = worker.session
        with server.atomic(), icons_at_once():
            self._scene = Scene(server, worker, session)
            self._panels = _build_panels(server, worker, link)
            for panel in self._panels:
                panel.update(session)

    @property
    def gizmo(self) -> Gizmo:
        """The handles of the selected target."""
        return self._scene.gizmo

    def draw(self, session: Session) -> None:
        with self._server.atomic():
            self._scene.show(session)
            for panel in self._panels:
                panel.update(session)

    def close(self) -> None:
        """The server is closed by its owner."""


def _build_panels(server: viser.ViserServer, worker: Worker, link: str) -> list[AbstractPanel]:
    gui = server.gui
    gui.main_panel.dock_right()
    gui.main_panel.set_width(PANEL_WIDTH)
    panels: list[AbstractPanel] = [Header(worker)]
    panels[0].build(server)
    tabs = gui.add_tab_group()
    for title, kinds in TABS.items():
        with tabs.add_tab(title):
            for kind in kinds:
                panels.append(kind(worker))
                panels[-1].build(server)
            if link and FilesPanel in kinds:
                gui.add_html(_link(link))
    return panels


def _link(address: str) -> str:
    words = f'Link to this session: <a href="{text(address)}">{text(address)}</a>'
    return block(words, testid="link", style=f"color:{MUTED};overflow-wrap:anywhere")


@contextlib.contextmanager
def icons_at_once() -> Iterator[None]:
    """Buttons made within this find the archive open; viser opens it anew for every icon, 25 ms each."""
    with zipfile.ZipFile(_icons.ICONS_DIR / "tabler-icons.zip") as archive:
        opened = SimpleNamespace(ZipFile=lambda path: contextlib.nullcontext(archive))
        with mock.patch.object(_icons, "zipfile", opened):
            yield
