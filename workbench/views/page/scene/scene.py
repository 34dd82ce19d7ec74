"""The whole scene of one arm on one plate; made anew for another arm or plate."""

from collections.abc import Sequence

import viser

from workbench.session.state import Session
from workbench.session.worker import Worker
from workbench.views.page.camera import aim
from workbench.views.page.scene.bent_arm import BentArm
from workbench.views.page.scene.corners import Corners
from workbench.views.page.scene.cubes import CubesPart
from workbench.views.page.scene.ghosts import BranchGhosts
from workbench.views.page.scene.gizmo import Gizmo
from workbench.views.page.scene.ground import Ground, first_view
from workbench.views.page.scene.nominal_arm import NominalArm
from workbench.views.page.scene.overlay import OverlayPart
from workbench.views.page.scene.part import AbstractPart
from workbench.views.page.scene.plate import PlatePart
from workbench.views.page.scene.track import TrackPart


class Scene(AbstractPart):
    """All parts of the scene, drawn together."""

    def __init__(self, server: viser.ViserServer, worker: Worker, session: Session):
        self._server, self._worker = server, worker
        self._build(session)
        server.on_client_disconnect(lambda client: self.gizmo.left(client))

    def show(self, session: Session) -> None:
        if session.robot is not self._robot or session.first_plate is not self._plate:
            self._server.scene.reset()
            self._build(session)
            self._look(session)
        for part in self._parts:
            part.show(session)

    def _build(self, session: Session) -> None:
        server, worker = self._server, self._worker
        self._robot, self._plate = session.robot, session.first_plate
        self.gizmo = Gizmo(server, worker, session)
        nominal, bent = NominalArm(server, session), BentArm(server, session)
        self._parts: Sequence[AbstractPart] = (
            Ground(server, session),
            PlatePart(server, worker, session),
            TrackPart(server, worker, session, nominal.move, bent.move),  # stops before others move
            nominal,
            bent,
            BranchGhosts(server, session),
            CubesPart(server, worker, session),
            Corners(server, worker, session),
            OverlayPart(server, worker, session),
            self.gizmo,
        )

    def _look(self, session: Session) -> None:
        """Every page looks at the new arm."""
        position, look_at = first_view(session)
        for client in self._server.get_clients().values():
            aim(client, position, look_at)
