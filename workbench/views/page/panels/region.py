"""The region of interest: its size, its cubes, their colours."""

from dataclasses import replace

import viser

from workbench.session.commands.region import SetRegion, ShowCubes
from workbench.session.cube_fields import CUBE_FIELDS, inputs
from workbench.session.page_state import Tab
from workbench.session.state import NO_FIELD
from workbench.views.page.panels.form import LENGTH
from workbench.views.page.panels.panel import AbstractPanel
from workbench.views.page.panels.plate import build_wanted

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
