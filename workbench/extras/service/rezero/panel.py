"""Joint zeros after a knock: which moved, by how much, what can't be determined, and the corrected arm."""

import viser

from workbench.base.errors import OptionError
from workbench.base.wording import capital
from workbench.extras.service.rezero.result import Rezero, RezeroVerdict, readable
from workbench.extras.service.rezero.session import FindZeros, rezeroed_toml, zeros_of
from workbench.report.chart import BarWithEnds, intervals
from workbench.session.page_state import Tab
from workbench.session.state import Session
from workbench.views.appearance.colours import OUT_OF_REACH, css
from workbench.views.page.html import (
    CAREFUL,
    GOOD,
    MUTED,
    badge,
    block,
    bullets,
    folded,
    heading,
    note,
    table,
    text,
)
from workbench.views.page.panels.panel import AbstractPanel, Door

HEADLINES = {
    RezeroVerdict.MOVED: "Moved",
    RezeroVerdict.UNCHANGED: "Unchanged",
    RezeroVerdict.REFUSED: "Not the zeros alone",
}
READY = (
    "After a collision or a new motor: load the calibrated arm and 3 to 10 poses measured since. "
    "The calibration is taken as known; only the joint zeros are identified."
)


class RezeroPanel(AbstractPanel):
    """A closed folder: start, verdict, a bar for every joint."""

    tab, order = Tab.CALIBRATE, 50
    door = Door("An arm after a collision", viser.Icon.TOOL, begins=FindZeros)
    depends = (zeros_of, "measurements.loaded", "is_idle")

    def build(self, gui: viser.GuiApi) -> None:
        with gui.add_folder("Joint zeros after a collision", expand_by_default=False):
            replaced = self.line(
                "Replaced joints", "Such as 3, or 3, 4: the links next to them may differ too."
            )
            self.button(
                "Find moved joints",
                lambda: _find(replaced.typed),
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


def _find(typed: str) -> FindZeros:
    try:
        return FindZeros(tuple(int(part) for part in typed.split(",") if part.strip()))
    except ValueError:
        raise OptionError(f"replaced joints must be numbers such as 3, 4, got '{typed}'") from None


def _card(session: Session) -> str:
    if (found := zeros_of(session)) is None:
        return ""
    colours = {
        RezeroVerdict.MOVED: CAREFUL,
        RezeroVerdict.UNCHANGED: GOOD,
        RezeroVerdict.REFUSED: css(OUT_OF_REACH),
    }
    mark = badge(HEADLINES[found.verdict], colours[found.verdict])
    error = f"<div style='color:{MUTED}'>{text(repr(found.error).capitalize())}</div>"
    open_pairs = (
        heading("Can't be distinguished") + bullets(map(text, found.ambiguous)) if found.ambiguous else ""
    )
    renewed = folded("Geometry next to replaced joints", _geometry(found)) if found.renewed else ""
    more = folded("Notes", bullets(map(text, found.notes)))
    sentence = found.sentence.removeprefix(f"{HEADLINES[found.verdict].lower()}: ")
    content = f"{mark}<div>{text(capital(sentence))}.</div>{error}{_bars(found)}{open_pairs}{renewed}{more}"
    return block(content, testid="rezero", style="margin:4px 0 8px")


def _bars(found: Rezero) -> str:
    """Every joint's shift with its 95 % interval about the calibrated zero."""
    rows = []
    for k, shift in enumerate(found.shifts, 1):
        _, moved, half, verdict = shift.cells
        is_moved = shift.moved and not found.doubts
        colour = CAREFUL if is_moved else "currentColor" if shift.determined and not found.doubts else MUTED
        value, label = (shift.shift, f"{moved} {half}") if shift.determined else (None, verdict)
        rows.append(BarWithEnds(f"joint {k}", value, shift.half, shift.unit, colour, label))
    title = found.heading if found.doubts else "Shift of every zero"
    return heading(f"{title}, with 95 % intervals") + intervals(rows, testid="zeros")


def _geometry(found: Rezero) -> str:
    rows, chain = [], found.calibrated.chain
    for name, change, std in found.renewed:
        factor, unit = readable(chain.elements[chain.index[name]].unit)
        shown = f"{factor * change:+.3f}{unit}".replace("-", "−")
        rows.append((text(name), shown, f"±{2.0 * factor * std:.3f}{unit}"))
    return table(("constant", "changed by", "95 %"), rows)
