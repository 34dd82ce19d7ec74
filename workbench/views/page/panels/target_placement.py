"""Arranging all targets: the search for a better plate, and patterns."""

import numpy as np
import viser

from workbench.plate.patterns import MAX_TARGETS, PATTERNS
from workbench.session.commands.plate import ImprovePlate
from workbench.session.commands.target_placement import ApplyPattern
from workbench.session.state import Session, Tab
from workbench.views.page.panels.panel import AbstractPanel

KINDS = {name.capitalize(): name for name in PATTERNS}


class ImprovePanel(AbstractPanel):
    """The one button that makes the plate better."""

    tab, order = Tab.PLATE, 40
    depends = ("is_idle",)

    def build(self, gui: viser.GuiApi) -> None:
        self._improve = self.button(
            ImprovePlate.title,
            lambda: ImprovePlate(seed=len(self._worker.session.history.scores)),
            viser.Icon.SPARKLES,
            "Optimise all unlocked targets for the lowest predicted error in the region, reachable and free "
            "of collisions. Cancel stops it, Undo restores the old plate.",
            main=True,
        )

    def show(self, session: Session) -> None:
        self._improve.disabled = session.page.job is not None


class PatternPanel(AbstractPanel):
    """A regular arrangement of all targets; folded."""

    tab, order = Tab.PLATE, 80
    keeps_typed = True

    def build(self, gui: viser.GuiApi) -> None:
        with gui.add_folder("Pattern", expand_by_default=False):
            self._build_pattern(gui)

    def show(self, session: Session) -> None:
        """Nothing here depends on the session."""

    def _build_pattern(self, gui: viser.GuiApi) -> None:
        self._pattern = gui.add_dropdown(
            "Pattern", list(KINDS), hint="Layout of the targets. The circle is the paper's Table 2."
        )
        self._count = self.number("Targets", 10, (1, MAX_TARGETS, 1), "Number of targets.")
        self._centre = gui.add_vector3(
            "Centre [mm]", (316.0, 354.0, 235.0), step=1.0, hint="Centre of the pattern in the base frame."
        )
        self._radius = self.number(
            "Half width [mm]", 250.0, (1.0, 5000.0, 1.0), "Radius of a circle, or half the side."
        )
        self._tilts = gui.add_vector2(
            "Tilts [°]", (-150.0, -160.0), step=1.0, hint="Roll angles, assigned to the targets in turn."
        )
        self.button(
            "Apply the pattern",
            self._lay_out,
            viser.Icon.GRID_DOTS,
            "Replace all unlocked targets by this pattern; Undo reverts this.",
            main=True,
        )

    def _lay_out(self) -> ApplyPattern:
        x, y, z = (1e-3 * float(v) for v in self._centre.value)
        tilts = tuple(float(np.deg2rad(v)) for v in self._tilts.value)
        radius = 1e-3 * float(self._radius.value)
        name = KINDS[self._pattern.value]
        return ApplyPattern(name, int(self._count.value), (x, y, z), radius, tilts)
