"""The region of interest: its size, its cubes, their colours, and the values of a clicked cube."""

from dataclasses import replace

import viser

from workbench.session.commands.drag import MoveTarget, plain
from workbench.session.commands.region import SetRegion, ShowCubes
from workbench.session.cube_fields import (
    BEST_INDEX,
    CUBE_FIELDS,
    REACHABILITY,
    cubes_of,
    field_of,
    inputs,
    shown_layer,
)
from workbench.session.page_state import Tab
from workbench.session.state import NO_FIELD, Session
from workbench.views.page.html import block, note, number, pairs
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
            self._build()

    def _build(self) -> None:
        fields = CUBE_FIELDS.values()
        names = {"Nothing": NO_FIELD} | {field.choice: field.name for field in fields}
        meanings = [f"{field.choice}: {field.meaning}." for field in fields]
        hint = " ".join(["What colours the cubes of the region.", *meanings])
        field = self.dropdown("Cubes show", names, hint, lambda s: s.region.view.field)
        cut = self.dropdown(
            "Slice",
            CUTS,
            "Show all cubes, or one layer across an axis.",
            lambda s: s.region.view.cut,
            disabled=lambda s: s.region.view.field == NO_FIELD,
        )
        layer = self.slider(
            "Layer",
            (1, 2, 1),
            "Which layer is shown.",
            lambda s: shown_layer(s) + 1,
            visible=lambda s: s.region.view.cut is not None,
            max=lambda s: max(s.plate.region.shape[s.region.view.cut], 2),
        )
        self.html(picked)
        self.button(
            "Move the selected target there",
            self._move_there,
            viser.Icon.ARROW_MOVE_RIGHT,
            "Move the selected target to the centre of the clicked cube.",
            visible=lambda s: s.region.view.picked is not None and s.region.view.field != NO_FIELD,
        )
        self.form(self._view, field, cut, layer)
        self._build_cuboid()

    def _build_cuboid(self) -> None:
        """The cuboid's own form."""
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

    def _view(self, field: str, cut: int | None, layer: int) -> ShowCubes:
        now, shape = self._worker.session.region.view, self._worker.session.plate.region.shape
        layer = layer - 1 if cut in (None, now.cut) else shape[cut] // 2
        return ShowCubes(replace(now, is_chosen=True, field=field, cut=cut, layer=layer))

    def _move_there(self) -> MoveTarget | None:
        session = self._worker.session
        picked = session.region.view.picked
        if picked is None or picked >= session.plate.region.cubes:
            return None
        place, rpy = session.plate.region.centres[picked], session.plate.targets[session.selected].rpy
        return MoveTarget(session.selected, plain(place), plain(rpy))


def picked(session: Session) -> str:
    """Numbers of the clicked cube."""
    field, cubes = field_of(session), cubes_of(session)
    view, region = session.region.view, session.plate.region
    if field is None:
        return ""
    if view.picked is None or view.picked >= region.cubes:
        return note("Click a cube to see its numbers.", "cube")
    i = view.picked
    items = [("Centre", ", ".join(f"{1e3 * v:.0f}" for v in region.centres[i]) + " mm")]
    if cubes is not None:
        items.append(("Reached in", f"{cubes.reached[i]} of {cubes.tried} orientations"))
        items.append(("Best index O", number(cubes.index[i])))
    if field not in (REACHABILITY, BEST_INDEX) and (numbers := field.values(session)) is not None:
        items.append((field.title, f"{number(field.factor * numbers.numbers[i])} {field.unit}"))
    return block(pairs(items), testid="cube", style="margin:4px 0")
