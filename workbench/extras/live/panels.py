"""Guided measurement: the current target, the arm's deviation from it, and the rows stored so far."""

import numpy as np
import viser

from workbench.base.wording import capital
from workbench.data.simulation.simulate import LIKELY_ERRORS
from workbench.extras.live.acquisition import ALIGNED, MAX_ANGLE, MAX_DISTANCE, NEAR, Status
from workbench.extras.live.session import (
    USE,
    BeginMeasuring,
    DriveArm,
    EndMeasuring,
    FollowSource,
    MeasureLive,
    Measuring,
    NextWanted,
    Source,
    StoreRow,
    TakeAgain,
    UseRows,
)
from workbench.extras.live.standstill import ArmState
from workbench.session.page_state import Tab
from workbench.session.state import Session
from workbench.views.page.html import BAD, CAREFUL, GOOD, LINE, MUTED, badge, block, note, text
from workbench.views.page.panels.panel import AbstractPanel

LIGHTS = {ArmState.STILL: GOOD, ArmState.MOVING: CAREFUL, ArmState.UNKNOWN: BAD}
SPACE = "The space bar stores the row; the next target follows."
COMPLETE = "Use the rows, then identify the arm from them; or retake the last one."
STILL_MOVES = "moves"


class GuidedPanel(AbstractPanel):
    """A connected real arm or a virtual one moves from target to target; rows are stored by hand."""

    tab, order = Tab.MEASURE, 50
    depends = (lambda session: session.part(Measuring), lambda session: session.part(Source))

    def build(self, gui: viser.GuiApi) -> None:
        with gui.add_folder("Guided, target by target"):
            self.html(lambda s: _source(s.part(Source)))
            follow = self.checkbox(
                "Follow the arm",
                "Move the arm in the scene with the real one.",
                _is_followed,
                visible=lambda s: s.part(Source),
                value=True,
            )
            self.form(FollowSource, follow)
            self.button(
                "Measure the real arm",
                MeasureLive,
                viser.Icon.PLUG_CONNECTED,
                "Move the connected arm to each target, wait until it is still, store the row.",
                main=True,
                visible=lambda s: s.part(Source),
                disabled=lambda s: not s.part(Source).is_open,
            )
            self.button(
                "Begin measuring",
                lambda: BeginMeasuring(errors=LIKELY_ERRORS),
                viser.Icon.TARGET,
                "Measure a virtual arm target by target, like a real one.",
            )


class MeasuringPanel(AbstractPanel):
    """A mode of its own in place of the tabs: the target, how far the arm is from it, and Store."""

    tab = None
    depends = (lambda session: session.part(Measuring), lambda session: session.part(Source))
    _seen: int | None = None

    def build(self, gui: viser.GuiApi) -> None:
        """Buttons shown during a measurement."""
        self.html(_measuring)
        self._space: viser.CommandHandle | None = None
        button, icon = self.button, viser.Icon
        self._drive = button(
            "Drive the virtual arm there",
            DriveArm,
            icon.ROBOT,
            "With the accuracy of an operator.",
            main=True,
        )
        self._store = button(
            "Store", StoreRow, icon.CHECK, "Store joint readings and pose as this target's row.", main=True
        )
        self._store_as = button(
            "Store",
            lambda: StoreRow(target=self._seen),
            icon.TARGET_ARROW,
            "The arm is at that target, not at the current one: store its row and continue from there.",
            main=True,
        )
        self._store_anyway = button(
            "Store anyway",
            lambda: StoreRow(anywhere=True),
            icon.ALERT_TRIANGLE,
            "Store the row for the current target although the tool is not there.",
        )
        self._again = button(
            "Retake", TakeAgain, icon.ROTATE, "Discard this target's row, or the last one, and measure again."
        )
        self._next = button("Next target", NextWanted, icon.ARROW_RIGHT, "Skip this target for now.")
        self._use = button(USE, UseRows, icon.DATABASE, "End here; the rows become the measurements.")
        self._stop = button(
            EndMeasuring.title, EndMeasuring, icon.X, "Stop here and discard the stored rows."
        )

    def show(self, session: Session) -> None:
        measuring = session.part(Measuring)
        self._hear_space(measuring is not None)
        for button in (self._drive, self._store, self._again, self._next, self._use, self._stop):
            button.visible = measuring is not None
        for button in (self._store_as, self._store_anyway):
            button.visible = False
        if measuring is None:
            return
        self._drive.visible = measuring.virtual is not None
        acquisition = measuring.acquisition
        status = acquisition.status()
        self._store.disabled = not acquisition.copy().store().changed
        self._drive.color = None if self._store.disabled else "gray"
        if not status.place.is_known:
            self._offer(measuring, status)
        self._again.disabled = self._use.disabled = not acquisition.rows
        is_complete = all(status.stored)
        self._use.color = None if is_complete else "gray"
        if is_complete:
            for button in (self._drive, self._store, self._store_as, self._store_anyway, self._next):
                button.visible = False

    def _hear_space(self, is_heard: bool) -> None:
        """Only now: elsewhere the space bar presses the button that has the focus."""
        if is_heard and self._space is None:
            self._space = self._gui.add_command("Store the row", hotkey="space")
            self._space.on_trigger(lambda _: self._store_here())
        elif not is_heard and self._space is not None:
            self._space.remove()
            self._space = None

    def _store_here(self) -> None:
        """What the space bar does: store for the current target, or for the one where the tool is."""
        for button, command in ((self._store, StoreRow()), (self._store_as, StoreRow(target=self._seen))):
            if button.visible and not button.disabled:
                self._worker.submit(command)
                return

    def _offer(self, measuring: Measuring, status: Status) -> None:
        """Ask for which target a row is to be kept while the tool is not at the current one."""
        acquisition, index = measuring.acquisition, status.place.looks_like
        self._store_anyway.visible = True
        self._store_anyway.disabled = not acquisition.copy().store(anywhere=True).changed
        if index is not None:
            self._seen = measuring.numbers[index]
            self._store_as.visible = True
            self._store_as.label = f"Store as target {self._seen + 1}"
            self._store_as.disabled = not acquisition.copy().store_as(index).changed


def _is_followed(session: Session) -> bool:
    source = session.part(Source)
    return source is not None and source.is_followed


def _measuring(session: Session) -> str:
    measuring, source = session.part(Measuring), session.part(Source)
    if measuring is None:
        return ""
    where = "" if measuring.virtual is not None or source is None else _source(source)
    return where + _status(measuring.acquisition.status(), measuring)


def _source(source: Source | None) -> str:
    """Where the real arm's joints come from, and whether they still do."""
    if source is None:
        sentence = "To follow and measure a real arm, start with workbench serve --source HOST:PORT."
        return note(sentence, "source", margin="2px 0 6px")
    if not source.is_open:
        light = badge("Ended", BAD)
    elif source.silence:
        light = badge("Silent", CAREFUL)
    else:
        light = badge("Connected", GOOD)
    content = f"{light} · real arm at {text(source.name)}"
    return block(content, testid="source", style="margin:2px 0 6px")


def _status(status: Status, measuring: Measuring) -> str:
    count, stored = len(status.stored), sum(status.stored)
    share = 100.0 * stored / count
    bar = (
        f'<div style="height:8px;border-radius:4px;background:{LINE};margin:4px 0 12px">'
        f'<div style="height:8px;border-radius:4px;background:{GOOD};width:{share:.0f}%"></div></div>'
    )
    progress = f'<div data-testid="progress">{stored} of {count} rows stored</div>{bar}'
    large = "font-size:40px;font-weight:650;line-height:1.2"
    if stored == count:
        end = f'<div style="{large}">All targets are stored</div><div style="color:{MUTED}">{COMPLETE}</div>'
        return block(progress + end, testid="measuring", style="margin:10px 0")
    message = f'<div style="color:{MUTED};margin-top:10px">{text(capital(status.message))}</div>'
    return block(
        progress
        + f'<div style="{large}">Target {measuring.target + 1}</div>'
        + _place(status)
        + _deviation(status, measuring)
        + f'<div style="font-size:18px">{_light(status.arm_state)}</div>'
        + (message if status.message else "")
        + f'<div style="color:{MUTED};margin-top:10px">{SPACE}</div>',
        testid="measuring",
        style="margin:10px 0;min-height:36vh",
    )


def _place(status: Status) -> str:
    if status.target is None:
        return ""
    place = ", ".join(f"{1e3 * v:.1f}" for v in status.target[:3, 3])
    return f'<div style="color:{MUTED}">at {place} mm</div>'


def _deviation(status: Status, measuring: Measuring) -> str:
    """How far off, large and coloured; a dash before the first sample; and at which target it looks to be."""

    def part(testid: str, vector: np.ndarray | None, scale: float, unit: str, near: float, far: float) -> str:
        size = np.nan if vector is None else float(np.linalg.norm(vector))
        colour = GOOD if size < near else CAREFUL if size <= far else BAD if size > far else MUTED
        style = f"font-size:34px;font-weight:650;color:{colour}"
        shown = "–" if vector is None else f"{scale * size:.1f}"  # finer ones change with every sample
        return f'<span data-testid="{testid}" style="{style}">{shown}{unit}</span>'

    content = (
        f'<div style="display:flex;align-items:baseline;gap:16px;margin:10px 0" '
        'title="Measured pose and target pose compared."><span>Off by</span>'
        f"{part('off_mm', status.position, 1e3, ' mm', NEAR, MAX_DISTANCE)}"
        f"{part('off_deg', status.rotation, np.rad2deg(1.0), '°', ALIGNED, MAX_ANGLE)}</div>"
    )
    if status.place.is_known:
        return content
    index = status.place.looks_like
    sentence = (
        "The tool is not at a target."
        if index is None
        else f"This looks like target {measuring.numbers[index] + 1}."
    )
    return content + f'<div data-testid="place" style="color:{BAD};font-weight:600">{sentence}</div>'


def _light(arm_state: ArmState | None) -> str:
    if arm_state is None:
        return badge("No sample yet: move the arm", MUTED)
    standing = STILL_MOVES if arm_state is ArmState.MOVING else str(arm_state)
    return f'<span data-testid="standing">{badge(capital(standing), LIGHTS[arm_state])}</span>'
