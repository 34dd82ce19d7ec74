"""What a plate is made from, and the instrument that its errors are predicted for."""

import viser

from workbench.session.commands.plate import SetNoise
from workbench.session.export import fixture_zip
from workbench.session.state import Tab
from workbench.views.page.panels.form import DEGREE
from workbench.views.page.panels.panel import AbstractPanel


class PlateFilesPanel(AbstractPanel):
    """A download."""

    tab, order = Tab.PLATE, 51

    def build(self, gui: viser.GuiApi) -> None:
        self.download("Plate to make (ZIP)", fixture_zip, "Solids, drawings and parts lists.")


class NoisePanel(AbstractPanel):
    """Two numbers."""

    tab, order = Tab.PLATE, 90
    depends = ("noise",)

    def build(self, gui: viser.GuiApi) -> None:
        with gui.add_folder("Instrument", expand_by_default=False):
            position = self.number(
                "Noise [mm]",
                (0.001, 10.0, 0.001),
                "Standard deviation of each measured coordinate.",
                lambda session: session.noise.position,
                unit=1e-3,
            )
            rotation = self.number(
                "Noise [°]",
                (0.001, 5.0, 0.001),
                "Standard deviation about each axis.",
                lambda session: session.noise.rotation,
                unit=DEGREE,
            )
        self.form(SetNoise, position, rotation)
