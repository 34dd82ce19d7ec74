"""The plate's place and region, what is required there, the search for a better plate, and the instrument."""

from dataclasses import replace

import viser

from workbench.session.commands.edit import MovePlate
from workbench.session.commands.identify import SetWanted
from workbench.session.commands.plate import ImprovePlate, SetNoise
from workbench.session.commands.region import SetRegion, ShowCubes
from workbench.session.cube_fields import CUBE_FIELDS, inputs
from workbench.session.page_state import Tab
from workbench.session.state import NO_FIELD, Session
from workbench.views.page.panels.form import ANGLE, DEGREE, LENGTH, AbstractControls
from workbench.views.page.panels.panel import AbstractPanel

CUTS = {"all layers": None, "one layer of x": 0, "one layer of y": 1, "one layer of z": 2}


class RegionPanel(AbstractPanel):
    """Cuboid and cubes."""

    tab, order = Tab.PLATE, 30
    depends = ("region.view", "plate.region", "page.chore", "choices.wanted", inputs)

    def build(self, gui: viser.GuiApi) -> None:
        with gui.add_folder("Region and requirement", expand_by_default=False):
            build_wanted(self)
            fields = CUBE_FIELDS.values()
            names = {"Nothing": NO_FIELD} | {field.choice: field.name for field in fields}
            meanings = [f"{field.choice}: {field.meaning}." for field in fields]
            hint = " ".join(["What colours the cubes of the region.", *meanings])
            field = self.dropdown("Cubes show", names, hint, lambda s: s.region.view.field)
            cut = self.dropdown(
                "Slice",
                CUTS,
                "Show all cubes, or one layer across an axis; it can be dragged in the scene.",
                lambda s: s.region.view.cut,
                disabled=lambda s: s.region.view.field == NO_FIELD,
            )
            self.form(self._view, field, cut)
            hint = "Corner of the region with the smallest coordinates."
            low = self.coordinates("From", LENGTH, hint, lambda s: s.plate.region.min)
            hint = "Corner of the region with the largest coordinates."
            high = self.coordinates("To", LENGTH, hint, lambda s: s.plate.region.max)
            cube = self.slider(
                "Cube [mm]",
                (10, 200, 1),
                "Side L of the cubes that the region is divided into.",
                lambda s: s.plate.region.cube,
                unit=1e-3,
            )
            self.form(SetRegion, low, high, cube)

    def _view(self, field: str, cut: int | None) -> ShowCubes:
        now, shape = self._worker.session.region.view, self._worker.session.plate.region.shape
        layer = now.layer if cut in (None, now.cut) else shape[cut] // 2
        return ShowCubes(replace(now, is_chosen=True, field=field, cut=cut, layer=layer))


class PlacePanel(AbstractPanel):
    """Where the plate is, and the one button that makes it better."""

    tab, order = Tab.PLATE, 35
    depends = ("plate", "drag", "is_idle")

    def build(self, gui: viser.GuiApi) -> None:
        with gui.add_folder("Place of the plate", expand_by_default=False):
            hint = "Centre of the plate's top in the base frame; all targets go with it."
            xyz = self.coordinates("x, y, z", LENGTH, hint, lambda s: s.plate.xyz)
            hint = "Roll, pitch and yaw of the plate: turned about x, then y, then z of the base."
            rpy = self.coordinates("Angles", ANGLE, hint, lambda s: s.plate.rpy)
        self.form(MovePlate, xyz, rpy)
        self.button(
            ImprovePlate.title,
            lambda: ImprovePlate(seed=len(self._worker.session.history.past)),
            viser.Icon.SPARKLES,
            "Optimise all unlocked targets, and the plate's place while it is not good enough, for the "
            "lowest predicted error in the region. Cancel keeps the best so far, Undo the old one.",
            disabled=lambda s: s.page.job is not None,
        )


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
