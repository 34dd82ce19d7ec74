"""The search for a better plate, its place, what is required of it, and the instrument of its errors."""

import viser

from workbench.session.commands.edit import MovePlate
from workbench.session.commands.identify import SetWanted
from workbench.session.commands.plate import ImprovePlate, SetNoise
from workbench.session.page_state import Tab
from workbench.session.state import Session
from workbench.views.page.panels.form import ANGLE, DEGREE, LENGTH, AbstractControls
from workbench.views.page.panels.panel import AbstractPanel


class ImprovePanel(AbstractPanel):
    """The one button that makes the plate better."""

    tab, order = Tab.PLATE, 40
    depends = ("is_idle",)

    def build(self, gui: viser.GuiApi) -> None:
        self.button(
            ImprovePlate.title,
            lambda: ImprovePlate(seed=len(self._worker.session.history.past)),
            viser.Icon.SPARKLES,
            "Optimise all unlocked targets, and the plate's place while it is not good enough, for the "
            "lowest predicted error in the region. Cancel keeps the best so far, Undo the old one.",
            disabled=lambda s: s.page.job is not None,
        )


class PlacePanel(AbstractPanel):
    """Where the plate is."""

    tab, order = Tab.PLATE, 35
    depends = ("plate", "drag")

    def build(self, gui: viser.GuiApi) -> None:
        with gui.add_folder("Place of the plate", expand_by_default=False):
            hint = "Centre of the plate's top in the base frame; all targets go with it."
            xyz = self.coordinates("x, y, z", LENGTH, hint, lambda s: s.plate.xyz)
            hint = "Roll, pitch and yaw of the plate: turned about x, then y, then z of the base."
            rpy = self.coordinates("Angles", ANGLE, hint, lambda s: s.plate.rpy)
        self.form(MovePlate, xyz, rpy)


class NoisePanel(AbstractPanel):
    """Two numbers."""

    tab, order = Tab.PLATE, 90
    depends = ("noise",)

    def build(self, gui: viser.GuiApi) -> None:
        with gui.add_folder("Instrument", expand_by_default=False):
            limits, hint = (0.001, 10.0, 0.001), "Standard deviation of each measured coordinate."
            position = self.number("Noise [mm]", limits, hint, lambda s: s.noise.position, unit=1e-3)
            limits, hint = (0.001, 5.0, 0.001), "Standard deviation about each axis."
            rotation = self.number("Noise [°]", limits, hint, lambda s: s.noise.rotation, unit=DEGREE)
        self.form(SetNoise, position, rotation)


def build_wanted(panel: AbstractControls) -> None:
    """Fields for the required error, in every panel that uses it."""

    def wanted(position: float, rotation: float) -> SetWanted:
        before = panel.session.choices.wanted
        return SetWanted(position or None, rotation or None, before is not None and before.per_axis)

    limits, hint = (0.0, 1000.0, 0.01), "Maximum position error of the calibrated arm; 0: no requirement."
    length = panel.number("Required [mm]", limits, hint, lambda s: _wanted(s)[0], unit=1e-3, digits=3)
    hint = "Maximum orientation error allowed; 0: no requirement."
    angle = panel.number("Required [°]", limits, hint, lambda s: _wanted(s)[1], unit=DEGREE, digits=3)
    panel.form(wanted, length, angle)


def _wanted(session: Session) -> tuple[float, float]:
    """The required errors [m, rad]; 0 for none."""
    wanted = session.choices.wanted
    return (0.0, 0.0) if wanted is None else (wanted.position, wanted.rotation or 0.0)
