"""The region of interest: its size, its cubes, their colours, and the values of a clicked cube."""

from dataclasses import replace

import viser

from workbench.session.commands.drag import MoveTarget
from workbench.session.commands.region import SetRegion, ShowCubes
from workbench.session.cube_values import IN_MILLIMETRES, TITLES, CubeValues, shown_layer, values
from workbench.session.state import Field, Session, Tab
from workbench.views.page.html import block, note, number, pairs
from workbench.views.page.panels.coordinates import Coordinates, Measure
from workbench.views.page.panels.panel import AbstractPanel, set_value

FIELDS = {
    "Nothing": Field.NONE,
    "Reachability": Field.REACH,
    "Best index O": Field.INDEX,
    "Predicted error": Field.PREDICTED,
    "Measured error": Field.MEASURED,
    "Error of virtual arms": Field.YIELD,
}
MEANINGS = (
    "What colours the cubes of the region. Reachability: in how many of the targets' orientations the arm "
    "reaches the centre. Best index O: the highest of them. Predicted error: after a calibration with these "
    "targets. Measured error: mean of the measured poses, of the calibrated arm if there is one. Error of "
    "virtual arms: root mean square over those of the yield."
)
CUTS = {"all layers": None, "one layer of x": 0, "one layer of y": 1, "one layer of z": 2}


class RegionPanel(AbstractPanel):
    """Cuboid and cubes."""

    tab, order = Tab.PLATE, 70
    depends = (
        "cube_view",
        "plate.region",
        "page.units",
        "page.chore",
        "cubes",
        "results.comparison",
        "trial",
        "score",
    )

    def build(self, gui: viser.GuiApi) -> None:
        self._field = gui.add_dropdown("Cubes show", list(FIELDS), hint=MEANINGS)
        self._cut = gui.add_dropdown("Slice", list(CUTS), hint="Show all cubes, or one layer across an axis.")
        self._layer = self.slider("Layer", 1, (1, 2, 1), "Which layer is shown.")
        for control in (self._field, self._cut, self._layer):
            self.sends(control, self._view)
        self._picked = gui.add_html("")
        self._move = self.button(
            "Move the selected target there",
            self._move_there,
            viser.Icon.ARROW_MOVE_RIGHT,
            "Move the selected target to the centre of the clicked cube.",
            visible=False,
        )
        with gui.add_folder("Cuboid"):
            self._build_cuboid(gui)

    def show(self, session: Session) -> None:
        view, region = session.cube_view, session.plate.region
        numbers = values(session)
        set_value(self._field, next(name for name, field in FIELDS.items() if field is view.field))
        set_value(self._cut, next(name for name, cut in CUTS.items() if cut == view.cut))
        self._layer.visible = view.cut is not None
        if view.cut is not None:
            self._layer.max = max(region.shape[view.cut], 2)
            set_value(self._layer, shown_layer(session) + 1)
        self._cut.disabled = view.field is Field.NONE
        self._picked.content = picked(session, numbers)
        self._move.visible = view.picked is not None and view.field is not Field.NONE
        self._minimum.show(region.min, session.page.units)
        self._maximum.show(region.max, session.page.units)
        set_value(self._cube, round(1e3 * region.cube))
        set_value(self._corners, view.corners)

    def _build_cuboid(self, gui: viser.GuiApi) -> None:
        self._minimum = Coordinates(
            gui, "From", Measure.LENGTH, hint="Corner of the region with the smallest coordinates."
        )
        self._maximum = Coordinates(
            gui, "To", Measure.LENGTH, hint="Corner of the region with the largest coordinates."
        )
        self._cube = self.slider(
            "Cube [mm]", 50, (10, 200, 1), "Side L of the cubes that the region is divided into."
        )
        for control in (self._minimum.control, self._maximum.control, self._cube):
            self.sends(control, self._set)
        self._corners = gui.add_checkbox(
            "Corner handles", False, hint="Drag two corners of the region in the scene."
        )
        self.sends(self._corners, self._view)

    def _view(self) -> ShowCubes:
        view = replace(
            self._worker.session.cube_view,
            is_chosen=True,
            field=FIELDS[self._field.value],
            cut=CUTS[self._cut.value],
            layer=int(self._layer.value) - 1,
            corners=bool(self._corners.value),
        )
        return ShowCubes(view)

    def _set(self) -> SetRegion:
        return SetRegion(self._minimum.typed, self._maximum.typed, 1e-3 * float(self._cube.value))

    def _move_there(self) -> MoveTarget | None:
        session = self._worker.session
        picked = session.cube_view.picked
        if picked is None or picked >= session.plate.region.cubes:
            return None
        x, y, z = session.plate.region.centres[picked].tolist()
        roll, pitch, yaw = session.plate.targets[session.selected].rpy.tolist()
        return MoveTarget(session.selected, (x, y, z), (roll, pitch, yaw))


def picked(session: Session, numbers: CubeValues | None) -> str:
    view, region, cubes = session.cube_view, session.plate.region, session.cubes
    if view.field is Field.NONE:
        return ""
    if view.picked is None or view.picked >= region.cubes:
        return note("Click a cube to see its numbers.", "cube")
    i = view.picked
    items = [("Centre", ", ".join(f"{1e3 * v:.0f}" for v in region.centres[i]) + " mm")]
    if cubes is not None and cubes.region is region:
        items.append(("Reached in", f"{cubes.reached[i]} of {cubes.tried} orientations"))
        items.append(("Best index O", number(cubes.index[i])))
    if numbers is not None and view.field in IN_MILLIMETRES:
        items.append((TITLES[view.field], f"{number(1e3 * numbers.numbers[i])} mm"))
    return block(pairs(items), testid="cube", style="margin:4px 0")
