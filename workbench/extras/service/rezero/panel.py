"""Joint zeros after a collision: which moved, by how much, and the corrected arm."""

import viser

from workbench.base.wording import capital
from workbench.extras.service.rezero.result import RezeroVerdict
from workbench.extras.service.rezero.session import FindZeros, rezeroed_toml, zeros_of
from workbench.report.result_display import as_html
from workbench.session.page_state import Tab
from workbench.session.state import Session
from workbench.views.page.html import BAD, CAREFUL, GOOD, badge, block, note
from workbench.views.page.panels.panel import AbstractPanel, Door

COLOURS = {RezeroVerdict.MOVED: CAREFUL, RezeroVerdict.UNCHANGED: GOOD, RezeroVerdict.REFUSED: BAD}
READY = (
    "After a collision or a new motor: load the calibrated arm and 3 to 10 poses measured since, or touches "
    "of seats. The calibration is taken as known; only the joint zeros are identified."
)


class RezeroPanel(AbstractPanel):
    """A closed folder: start, verdict, each joint's shift."""

    tab, order = Tab.CALIBRATE, 50
    door = Door("An arm after a collision", viser.Icon.TOOL, begins=FindZeros)
    depends = (zeros_of, "measurements.loaded", "is_idle")

    def build(self, gui: viser.GuiApi) -> None:
        with gui.add_folder("Joint zeros after a collision", expand_by_default=False):
            self.button(
                "Find moved joints",
                FindZeros,
                viser.Icon.REFRESH_ALERT,
                "Find which joint's zero moved since the robot of this session was calibrated.",
                main=True,
                disabled=lambda s: s.measurements.loaded is None or s.page.job is not None,
            )
            gui.add_html(note(READY, "knocked"))
        self.html(_card)
        self.download(
            "Arm with these zeros (TOML)",
            rezeroed_toml,
            "The calibrated arm with the zeros found.",
            visible=lambda s: (found := zeros_of(s)) is not None and not found.doubts,
        )


def _card(session: Session) -> str:
    if (found := zeros_of(session)) is None:
        return ""
    mark = badge(capital(found.verdict), COLOURS[found.verdict])
    return block(mark + as_html(found.blocks()), testid="rezero", style="margin:4px 0 8px")
