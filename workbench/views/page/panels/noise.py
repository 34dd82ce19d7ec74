"""The instrument's noise: for the predicted errors, and for virtual measurements."""

from typing import Any

import numpy as np
import viser

from workbench.session.commands.plate import SetNoise
from workbench.session.state import Session
from workbench.views.page.panels.panel import AbstractPanel, on_change, set_value


class NoisePanel(AbstractPanel):
    """Two numbers."""

    def build(self, server: viser.ViserServer) -> None:
        with server.gui.add_folder("Instrument"):
            self._position = server.gui.add_number(
                "Noise [mm]",
                0.1,
                min=0.001,
                max=10.0,
                step=0.001,
                hint="Standard deviation of each measured coordinate.",
            )
            self._rotation = server.gui.add_number(
                "Noise [°]",
                0.02,
                min=0.001,
                max=5.0,
                step=0.001,
                hint="Standard deviation of the measured rotation about each axis.",
            )
        for field in (self._position, self._rotation):
            on_change(field, self._set)

    def parts(self, session: Session) -> tuple[Any, ...]:
        return (session.noise,)

    def show(self, session: Session) -> None:
        set_value(self._position, round(1e3 * session.noise.position, 6))
        set_value(self._rotation, round(float(np.rad2deg(session.noise.rotation)), 6))

    def _set(self) -> None:
        self._worker.submit(
            SetNoise(1e-3 * float(self._position.value), float(np.deg2rad(self._rotation.value)))
        )
