"""What a plate is made from, and the instrument that its errors are predicted for."""

import numpy as np
import viser

from workbench.session.commands.plate import SetNoise
from workbench.session.export import fixture_zip
from workbench.session.state import Session, Tab
from workbench.views.page.panels.panel import AbstractPanel, set_value


class PlateFilesPanel(AbstractPanel):
    """A download."""

    tab, order = Tab.PLATE, 51

    def build(self, gui: viser.GuiApi) -> None:
        self.download("Plate to make (ZIP)", fixture_zip, "Solids, drawings and parts lists.")

    def show(self, session: Session) -> None:
        """Nothing of it changes."""


class NoisePanel(AbstractPanel):
    """Two numbers."""

    tab, order = Tab.PLATE, 90
    depends = ("noise",)

    def build(self, gui: viser.GuiApi) -> None:
        with gui.add_folder("Instrument", expand_by_default=False):
            self._position = self.number(
                "Noise [mm]", 0.1, (0.001, 10.0, 0.001), "Standard deviation of each measured coordinate."
            )
            self._rotation = self.number(
                "Noise [°]", 0.02, (0.001, 5.0, 0.001), "Standard deviation about each axis."
            )
        for field in (self._position, self._rotation):
            self.sends(field, self._noise)

    def show(self, session: Session) -> None:
        set_value(self._position, round(1e3 * session.noise.position, 6))
        set_value(self._rotation, round(float(np.rad2deg(session.noise.rotation)), 6))

    def _noise(self) -> SetNoise:
        return SetNoise(1e-3 * float(self._position.value), float(np.deg2rad(self._rotation.value)))
