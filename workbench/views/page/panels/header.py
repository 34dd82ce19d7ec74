"""Above the tabs: what to do next, the last message, and the long work under way."""

from typing import Any

import viser

from workbench.session.commands.messages import Dismiss, SetCaption
from workbench.session.state import Focus, Message, Session, Severity
from workbench.views.page.html import LINE, MUTED, block, text
from workbench.views.page.panels.panel import AbstractPanel, on_press, set_value

TINTS = {
    Severity.INFO: ("rgba(59,130,246,.12)", "#3b82f6"),
    Severity.WARNING: ("rgba(245,158,11,.14)", "#c2700a"),
    Severity.ERROR: ("rgba(239,68,68,.13)", "#dc2626"),
}


class Header(AbstractPanel):
    """Always visible."""

    def build(self, server: viser.ViserServer) -> None:
        gui = self._gui = server.gui
        self._hint = gui.add_html("")
        self._stop = gui.add_button(
            "Stop the demo",
            color="gray",
            visible=False,
            icon=viser.Icon.PLAYER_STOP,
            hint="End the demo here; any other input ends it too.",
        )
        on_press(self._stop, lambda: self._worker.submit(SetCaption("")))
        self._message = gui.add_html("", visible=False)
        self._dismiss = gui.add_button(
            "Dismiss", color="gray", visible=False, icon=viser.Icon.X, hint="Dismiss this message."
        )
        on_press(self._dismiss, lambda: self._worker.submit(Dismiss()))
        self._chore = gui.add_html("", visible=False)
        self._work = gui.add_html("", visible=False)
        self._bar = gui.add_progress_bar(0.0, visible=False, animated=True)
        self._cancel = gui.add_button(
            "Cancel",
            color="gray",
            visible=False,
            icon=viser.Icon.PLAYER_STOP,
            hint="Stop the computation; nothing is changed.",
        )
        on_press(self._cancel, self._worker.cancel)

    def parts(self, session: Session) -> tuple[Any, ...]:
        return _label(session), next_step(session), session.messages, session.chore, session.job

    def show(self, session: Session) -> None:
        self._gui.set_panel_label(_label(session))
        self._hint.content = _hint(session)
        self._stop.visible = bool(session.caption)
        newest = session.messages[-1] if session.messages else None
        self._message.content = "" if newest is None else _message(newest)
        self._message.visible = newest is not None
        self._dismiss.visible = newest is not None and newest.severity is not Severity.INFO
        self._chore.content = block(f"{text(session.chore)} …", testid="chore", style=f"color:{MUTED}")
        self._chore.visible = bool(session.chore)
        job = session.job
        for part in (self._work, self._bar, self._cancel):
            part.visible = job is not None
        if job is not None:
            words = text(job.title) + (f": {text(job.text)}" if job.text else " …")
            self._work.content = block(words, testid="job", style="margin-top:4px")
            set_value(self._bar, 100.0 * min(max(job.fraction, 0.02), 1.0))


def _label(session: Session) -> str:
    return f"{session.robot.name} · {session.plate.name}"


def next_step(session: Session) -> str:
    """What a newcomer could do now, in HTML."""
    if session.caption:
        return f'<span data-testid="caption" style="font-size:15px">{text(session.caption)}</span>'
    if session.job is not None:
        return "You can keep working in the meantime."
    if session.drag is not None:
        return "Watch the arm and the numbers. Release to keep this position; <b>Undo</b> reverts it."
    if session.measuring is not None:
        return "<b>Measure</b>: drive the arm to the current target, wait until it is still, store the row."
    if session.source is not None and session.source.is_followed and session.focus is Focus.JOG:
        return (
            "The arm follows the real one. In <b>Measure</b>, store its rows target by target, or "
            "untick <b>Follow the arm</b> to return to the plate."
        )
    if session.focus is Focus.TRACK:
        return (
            "The solid arm moves as commanded, the amber one as the calibrated arm does. <b>Play</b> and "
            "<b>Pause</b> are in <b>Compare</b>."
        )
    if session.identification is not None and session.focus is Focus.ROW:
        return (
            "In <b>Compare</b>, step through the measured poses: the solid arm is nominal, the amber one "
            "calibrated. <b>Identify</b> has the numbers and saves the result."
        )
    if session.loaded is not None and session.identification is None:
        return "The measurements are loaded. Next: open <b>Identify</b> and press Identify."
    if session.done:
        return (
            "Happy with the plate? In <b>Measure</b>, measure a virtual arm on it, or load real measurements."
        )
    return (
        "<b>Drag an arrow</b> to move the blue target, <b>a ring</b> to turn it; the arm follows. "
        "Click another block to choose it."
    )


def _hint(session: Session) -> str:
    return block(
        next_step(session),
        testid="hint",
        style=f"color:{MUTED};padding-bottom:8px;border-bottom:1px solid {LINE};margin:2px 0 6px",
    )


def _message(message: Message) -> str:
    ground, ink = TINTS[message.severity]
    return (
        '<div style="padding:0 12px;margin:6px 0 10px">'
        f'<div data-testid="message" data-severity="{message.severity}" data-number="{message.number}" '
        f'style="font-size:13px;line-height:1.45;background:{ground};'
        f"color:var(--mantine-color-text);border-left:3px solid {ink};"
        'border-radius:4px;padding:6px 10px;overflow-wrap:anywhere">'
        f"{text(_sentence(message.text))}</div></div>"
    )


def _sentence(words: str) -> str:
    first = words.split(maxsplit=1)[0] if words.strip() else ""
    is_name = "." in first or "/" in first  # a file's name stays as it is
    start = words[:1] if is_name else words[:1].upper()
    return start + words[1:] + ("" if words.endswith((".", "?", "!")) else ".")
