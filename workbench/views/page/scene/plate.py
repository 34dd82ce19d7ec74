"""The fixture: its solid, and the numbered target blocks."""

import numpy as np
import viser

from workbench.plate.plate import Target
from workbench.session.commands.drag import SelectTarget
from workbench.session.state import Session
from workbench.session.worker import Worker
from workbench.views.appearance.colours import PLATE, REACHED, target_colour
from workbench.views.appearance.shapes import SIDE, box, target_block
from workbench.views.page.scene.nodes import add_solid, put, unsettle
from workbench.views.page.scene.part import AbstractPart


class PlatePart(AbstractPart):
    """Plate and blocks. A click on a block selects its target."""

    def __init__(self, server: viser.ViserServer, worker: Worker, session: Session):
        self._server, self._worker = server, worker
        plate = session.plate
        if plate.size is not None:
            solid = add_solid(server, "/plate", box(plate.size), PLATE, flat=True)
            unsettle(solid)
            put(solid, plate.pose)
        self._targets: list[Target] = []
        self._blocks: list[viser.MeshHandle] = []
        self._labels: list[viser.LabelHandle] = []
        self.show(session)

    def show(self, session: Session) -> None:
        targets = session.plate.targets
        while len(self._blocks) > len(targets):
            self._blocks.pop().remove()
            self._labels.pop().remove()
            self._targets.pop()
        for i in range(len(self._blocks), len(targets)):
            self._add(i, session)
        for i, (target, state) in enumerate(zip(targets, session.states, strict=True)):
            if target is not self._targets[i]:
                self._targets[i] = target
                self._blocks[i].vertices = target_block(target.pose, session.plate.pose).vertices
                self._labels[i].position = _label_place(target)
                self._labels[i].text = _label(i, target)
            self._blocks[i].color = target_colour(state, selected=i == session.selected)

    def _add(self, i: int, session: Session) -> None:
        target = session.plate.targets[i]
        solid = target_block(target.pose, session.plate.pose)
        block = add_solid(self._server, f"/targets/{i + 1}", solid, REACHED, flat=True)

        @block.on_click
        async def _(event: viser.SceneNodePointerEvent) -> None:
            self._worker.submit(SelectTarget(i))

        self._targets.append(target)
        self._blocks.append(block)
        self._labels.append(
            self._server.scene.add_label(
                f"/target_numbers/{i + 1}",
                _label(i, target),
                position=_label_place(target),
                anchor="bottom-center",
                font_screen_scale=0.85,
            )
        )


def _label(i: int, target: Target) -> str:
    return f"{i + 1} (locked)" if target.locked else f"{i + 1}"


def _label_place(target: Target) -> np.ndarray:
    return target.xyz + np.array([0.0, 0.0, 0.75 * SIDE])
