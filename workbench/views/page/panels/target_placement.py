"""The search for a better plate."""

import viser

from workbench.session.commands.plate import ImprovePlate
from workbench.session.state import Tab
from workbench.views.page.panels.panel import AbstractPanel


class ImprovePanel(AbstractPanel):
    """The one button that makes the plate better."""

    tab, order = Tab.PLATE, 40
    depends = ("is_idle",)

    def build(self, gui: viser.GuiApi) -> None:
        self.button(
            ImprovePlate.title,
            lambda: ImprovePlate(seed=len(self._worker.session.history.scores)),
            viser.Icon.SPARKLES,
            "Optimise all unlocked targets, and the plate's place while it is not good enough, for the "
            "lowest predicted error in the region. Cancel stops it, Undo restores the old plate.",
            main=True,
            disabled=lambda s: s.page.job is not None,
        )
