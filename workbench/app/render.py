"""The browser as a view of the session: scene parts and panels, drawn together."""

from collections.abc import Sequence

import viser

from workbench.app.panels.compare import ComparePanel
from workbench.app.panels.data import DataPanel
from workbench.app.panels.fit import FitPanel
from workbench.app.panels.header import Header
from workbench.app.panels.index import IndexPanel
from workbench.app.panels.noise import NoisePanel
from workbench.app.panels.panel import AbstractPanel
from workbench.app.panels.targets import TargetsPanel
from workbench.app.scene.gizmo import Gizmo
from workbench.app.scene.ground import add_ground
from workbench.app.scene.nominal_arm import NominalArm
from workbench.app.scene.overlay import OverlayPart
from workbench.app.scene.part import AbstractPart
from workbench.app.scene.plate import PlatePart
from workbench.session.state import Session
from workbench.session.view import AbstractView
from workbench.session.worker import Worker

PANEL_WIDTH = 390
BRAND = (37, 99, 235)


class BrowserView(AbstractView):
    """Draws every snapshot in one message window, so that no page shows half of it."""

    def __init__(self, server: viser.ViserServer, worker: Worker):
        self._server = server
        session = worker.session
        with server.atomic():
            server.gui.set_panel_label(f"{session.robot.name} · {session.plate.name}")
            add_ground(server, session)
            self._parts: Sequence[AbstractPart] = (
                PlatePart(server, worker, session),
                NominalArm(server, session),
                OverlayPart(server, session),
                gizmo := Gizmo(server, worker, session),
            )
            self.gizmo = gizmo
            self._panels = _build_panels(server, worker)
            for panel in self._panels:
                panel.show(session)

    def draw(self, session: Session) -> None:
        """Show a snapshot."""
        with self._server.atomic():
            for part in self._parts:
                part.show(session)
            for panel in self._panels:
                panel.show(session)

    def close(self) -> None:
        """The server is closed by its owner."""


def _build_panels(server: viser.ViserServer, worker: Worker) -> Sequence[AbstractPanel]:
    gui = server.gui
    gui.configure_theme(show_logo=False, show_share_button=False, brand_color=BRAND)
    gui.main_panel.dock_right()
    gui.main_panel.set_width(PANEL_WIDTH)
    header = Header(worker)
    header.build(server)
    panels: list[AbstractPanel] = [header]
    tabs = gui.add_tab_group()
    for title, icon, contents in (
        ("Plate", viser.Icon.TARGET, (TargetsPanel(worker), IndexPanel(), NoisePanel(worker))),
        ("Measure", viser.Icon.RULER_MEASURE, (DataPanel(worker),)),
        ("Identify", viser.Icon.MATH_FUNCTION, (FitPanel(worker),)),
        ("Compare", viser.Icon.STACK_2, (ComparePanel(worker),)),
    ):
        with tabs.add_tab(title, icon):
            for panel in contents:
                panel.build(server)
                panels.append(panel)
    return panels
