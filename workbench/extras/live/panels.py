"""Guided measurement: the current target, the arm's deviation from it, and the rows stored so far."""

import numpy as np
import viser

from workbench.base.errors import WorkbenchError
from workbench.base.wording import capital
from workbench.extras.live.acquisition import MAX_ANGLE, MAX_DISTANCE, Acquisition, name_of
from workbench.extras.live.session import (
    USE,
    EndMeasuring,
    MeasureLive,
    Measuring,
    NextWanted,
    Source,
    StoreRow,
    TakeAgain,
    UseRows,
    measuring,
)
from workbench.extras.live.standstill import ArmState
from workbench.session.page_state import Tab
from workbench.session.state import Session
from workbench.views.page.html import BAD, CAREFUL, GOOD, LINE, MUTED, badge, block, note, text
from workbench.views.page.panels.panel import AbstractPanel

NEAR, ALIGNED = 5e-3, float(np.deg2rad(1.0))
"""A tool nearer to its target than this is shown in green [m], [rad]."""
LIGHTS = {ArmState.STILL: GOOD, ArmState.MOVING: CAREFUL, ArmState.UNKNOWN: BAD}
SPACE = "The space bar stores the row; the next target follows."
COMPLETE = "Use the rows, then identify the arm from them; or retake the last one."
NO_SOURCE = "To follow and measure a real arm, start with workbench serve --source HOST:PORT."
LARGE = "font-size:40px;font-weight:650;line-height:1.2"
SMALL = f"color:{MUTED};margin-top:10px"
DEPENDS = (lambda session: session.part(Measuring), lambda session: session.part(Source))


class GuidedPanel(AbstractPanel):
    """A connected arm is followed, and moved from target to target; rows are stored by hand."""

    tab, order, depends = Tab.MEASURE, 50, DEPENDS

    def build(self, gui: viser.GuiApi) -> None:
        with gui.add_folder("Guided, target by target"):
            self.html(lambda s: _source(s.part(Source)))
            self.button(
                "Measure the real arm",
                MeasureLive,
                viser.Icon.PLUG_CONNECTED,
                "Move the connected arm to each target, wait until it is still, store the row.",
                main=True,
                visible=lambda s: s.part(Source),
                disabled=lambda s: not s.part(Source).is_open,
            )


class MeasuringPanel(AbstractPanel):
    """A mode of its own in place of the tabs: the target, how far the arm is from it, and Store."""

    tab, depends = None, DEPENDS

    def build(self, gui: viser.GuiApi) -> None:
        """Buttons shown during a measurement."""
        self.html(lambda s: _source(s.part(Source)) + status(measuring(s)) if _is_on(s) else "")
        self._space: viser.CommandHandle | None = None
        button, icon = self.button, viser.Icon
        button(
            "Store",
            StoreRow,
            icon.CHECK,
            "Store joint readings and pose as this target's row.",
            main=True,
            visible=_goes_on,
            disabled=_is_refused,
        )
        hint = "Discard this target's row, or the last one, and measure again."
        button("Retake", TakeAgain, icon.ROTATE, hint, visible=_is_on, disabled=_has_no_row)
        button("Next target", NextWanted, icon.ARROW_RIGHT, "Skip this target for now.", visible=_goes_on)
        hint = "End here; the rows become the measurements."
        button(USE, UseRows, icon.DATABASE, hint, visible=_is_on, disabled=_has_no_row)
        hint = "Stop here and discard the stored rows."
        button(EndMeasuring.title, EndMeasuring, icon.X, hint, visible=_is_on)

    def show(self, session: Session) -> None:
        """The space bar stores now alone: elsewhere it presses the button that has the focus."""
        if _is_on(session) and self._space is None:
            self._space = self._gui.add_command("Store the row", hotkey="space")
            self._space.on_trigger(lambda _: self._worker.submit(StoreRow()))
        elif not _is_on(session) and self._space is not None:
            self._space.remove()
            self._space = None


def _is_on(session: Session) -> bool:
    return session.part(Measuring) is not None


def _goes_on(session: Session) -> bool:
    return _is_on(session) and not measuring(session).is_done


def _has_no_row(session: Session) -> bool:
    return not measuring(session).rows


def _is_refused(session: Session) -> bool:
    try:
        StoreRow().check(session)
    except WorkbenchError:
        return True
    return False


def _source(source: Source | None) -> str:
    """Where the real arm's joints come from, and whether they still do."""
    if source is None:
        return note(NO_SOURCE, "source")
    light = badge("Silent", CAREFUL) if source.silence else badge("Connected", GOOD)
    light = light if source.is_open else badge("Ended", BAD)
    return block(f"{light} · real arm at {text(source.name)}", testid="source", style="margin:2px 0 6px")


def status(now: Acquisition) -> str:
    """The rows stored, the current target, and how far the arm is from it."""
    share = 100.0 * len(now.rows) / len(now.plate)
    rows = (
        f'<div data-testid="progress">{len(now.rows)} of {len(now.plate)} rows stored</div>'
        f'<div style="height:8px;border-radius:4px;background:{LINE};margin:4px 0 12px">'
        f'<div style="height:8px;border-radius:4px;background:{GOOD};width:{share:.0f}%"></div></div>'
    )
    if now.is_done:
        end = f'<div style="{LARGE}">All targets are stored</div><div style="color:{MUTED}">{COMPLETE}</div>'
        return block(rows + end, testid="measuring", style="margin:10px 0")
    message = f'<div style="{SMALL}">{text(capital(now.message))}</div>' if now.message else ""
    return block(
        f'{rows}<div style="{LARGE}">{capital(name_of(now.current))}</div>'
        f"{_deviation(now)}"
        f'<div style="font-size:18px">{_light(now)}</div>{message}<div style="{SMALL}">{SPACE}</div>',
        testid="measuring",
        style="margin:10px 0;min-height:36vh",
    )


def _deviation(now: Acquisition) -> str:
    """How far off, large and coloured; a dash before the first sample; and at which target it looks to be."""

    def part(testid: str, vector: np.ndarray | None, scale: float, unit: str, near: float, far: float) -> str:
        size = np.nan if vector is None else float(np.linalg.norm(vector))
        colour = GOOD if size < near else CAREFUL if size <= far else BAD if size > far else MUTED
        style = f"font-size:34px;font-weight:650;color:{colour}"
        shown = "–" if vector is None else f"{scale * size:.1f}"  # finer ones change with every sample
        return f'<span data-testid="{testid}" style="{style}">{shown}{unit}</span>'

    (position, rotation), place = now.deviation(), now.place()
    content = (
        f'<div style="display:flex;align-items:baseline;gap:16px;margin:10px 0" '
        'title="Measured pose and target pose compared."><span>Off by</span>'
        f"{part('off_mm', position, 1e3, ' mm', NEAR, MAX_DISTANCE)}"
        f"{part('off_deg', rotation, np.rad2deg(1.0), '°', ALIGNED, MAX_ANGLE)}</div>"
    )
    if place.is_known:
        return content
    return content + f'<div data-testid="place" style="color:{BAD};font-weight:600">{place.advice}</div>'


def _light(now: Acquisition) -> str:
    if now.latest is None:
        return badge("No sample yet: move the arm", MUTED)
    standing = "moves" if now.arm_state is ArmState.MOVING else str(now.arm_state)
    return f'<span data-testid="standing">{badge(capital(standing), LIGHTS[now.arm_state])}</span>'
