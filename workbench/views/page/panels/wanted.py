"""The error that the user wants the calibrated arm to keep: two numbers by which plate and arm are judged."""

from typing import Any

import numpy as np
import viser

from workbench.session.commands.identify import SetWanted
from workbench.session.state import Session
from workbench.views.page.panels.panel import AbstractPanel, on_change, set_value

FIELDS = (
    ("Wanted [mm]", "Greatest position error that you want the calibrated arm to have; 0: not judged."),
    ("Wanted [°]", "Greatest orientation error that you want it to have; 0: not judged."),
)


class WantedPanel(AbstractPanel):
    """Wherever something is judged by it."""

    def build(self, server: viser.ViserServer) -> None:
        self._fields = [
            server.gui.add_number(label, 0.0, min=0.0, step=0.01, hint=hint) for label, hint in FIELDS
        ]
        for field in self._fields:
            on_change(field, self._want)

    def parts(self, session: Session) -> tuple[Any, ...]:
        return (session.wanted,)

    def show(self, session: Session) -> None:
        wanted = session.wanted
        set_value(self._fields[0], 0.0 if wanted is None else 1e3 * wanted.position)
        angle = 0.0 if wanted is None or wanted.rotation is None else wanted.rotation
        set_value(self._fields[1], round(float(np.rad2deg(angle)), 3))

    def _want(self) -> None:
        position, rotation = (float(field.value) for field in self._fields)
        before = self._worker.session.wanted
        self._worker.submit(
            SetWanted(
                1e-3 * position if position > 0.0 else None,
                float(np.deg2rad(rotation)) if rotation > 0.0 else None,
                before is not None and before.per_axis,
            )
        )
