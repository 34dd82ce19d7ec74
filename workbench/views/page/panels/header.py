"""The strip above the tabs: the current state with the next step, the last message, running tasks."""

from collections.abc import Callable

import numpy as np
import viser

from workbench.base.wording import capital
from workbench.report.chart import Bar, Bars
from workbench.session.commands.messages import Dismiss, OpenTab, SetCaption, Steer, SteerDemo
from workbench.session.commands.plate import AbstractPlateTrial
from workbench.session.next_step import Action, NextStep, next_step
from workbench.session.page_state import PASSING, Message, Severity
from workbench.session.state import Session
from workbench.session.worker import Worker
from workbench.views.appearance.colours import SELECTED, css
from workbench.views.drawables.viewpoint import title
from workbench.views.page.html import INKS, MUTED, block, heading, text
from workbench.views.page.panels.form import Control
from workbench.views.page.panels.index import try_plate
from workbench.views.page.panels.panel import AbstractPanel
from workbench.views.page.style import CAPTION

WITH_MY_ROBOT = "With my robot"
TINTS = {
    Severity.INFO: ("rgba(59,130,246,.12)", "#3b82f6"),
    Severity.WARNING: ("rgba(245,158,11,.14)", "#c2700a"),
    Severity.ERROR: ("rgba(239,68,68,.13)", "#dc2626"),
}
SUSPECTS = 4
"""Bars of a diagnosis under way."""
PLAYING = "The demo is playing; any input ends it."


class HeaderVerdict(AbstractPanel):
    """The state of the session, and two buttons for the next step."""

    keeps_typed = True
    depends = (next_step, "page.caption")

    _step = NextStep("")

    def build(self, gui: viser.GuiApi) -> None:
        self.html(_verdict)
        self._offer(lambda step: step.next, "What to do next.", main=True)
        self._offer(lambda step: step.other, "An alternative next step.", main=False)

    def _offer(self, find: Callable[[NextStep], Action | None], hint: str, *, main: bool) -> None:
        """A button that does what it says when it is pressed."""

        def label(session: Session) -> str:
            action = find(self._offered(session))
            return "" if action is None else action.label

        def do(event: viser.GuiEvent) -> None:
            self._do(event, find(self._step))

        self.press("Next", do, None, hint, main=main, visible=label, label=label, disabled=_is_dragged)

    def _offered(self, session: Session) -> NextStep:
        """In a drag those from before it, though none can be pressed: they keep the height."""
        return self._step if _is_dragged(session) else next_step(session)

    def show(self, session: Session) -> None:
        self._step = self._offered(session)

    def _do(self, event: viser.GuiEvent, action: Action | None) -> None:
        if action is None:
            return
        self._worker.submit(OpenTab(action.tab))
        if isinstance(action.command, AbstractPlateTrial):
            try_plate(event, self._worker, action.command)
        elif action.command is not None:
            self._worker.submit(action.command)
        if action.save is not None:
            self.save(event, action.save)


def _is_dragged(session: Session) -> bool:
    return session.drag is not None


class Header(AbstractPanel):
    """Below the verdict: the last message, and the long work under way."""

    depends = (title, "page.caption", "page.is_paused", "page.messages", "page.chore", "page.job", next_step)

    def build(self, gui: viser.GuiApi) -> None:
        self.button(
            Steer.PAUSE,
            lambda: SteerDemo(Steer.ON if self._worker.session.page.is_paused else Steer.PAUSE),
            viser.Icon.PLAYER_PAUSE,
            "Pause the demo here, or continue.",
            visible=lambda s: s.page.caption,
            label=lambda s: Steer.ON if s.page.is_paused else Steer.PAUSE,
        )
        end, hint = lambda: SetCaption(""), "End the demo here; any other input ends it too."
        self.button("Stop the demo", end, viser.Icon.PLAYER_STOP, hint, visible=lambda s: s.page.caption)
        self.html(lambda s: _message(_newest(s)))
        stays = lambda s: (last := _newest(s)) is not None and last.severity is not Severity.INFO  # noqa: E731
        self.button("Dismiss", Dismiss, viser.Icon.X, "Dismiss this message.", visible=stays)
        chore = {"testid": "chore", "style": f"color:{MUTED}"}
        self.html(lambda s: s.page.chore and block(f"{text(s.page.chore)} …", **chore))
        self.html(_job)
        bar = gui.add_progress_bar(0.0, animated=True)
        self.add(Control(bar, visible=lambda s: s.page.job is not None, value=_progress))
        cancel, hint = self._worker.cancel, "Stop the computation; nothing changes."
        self.button("Cancel", cancel, viser.Icon.PLAYER_STOP, hint, visible=lambda s: s.page.job is not None)

    def show(self, session: Session) -> None:
        self._gui.set_panel_label(title(session))


def _progress(session: Session) -> float:
    """How much of the long work is done, in percent, of which a little is always seen."""
    job = session.page.job
    return 0.0 if job is None else 100.0 * min(max(job.fraction, 0.02), 1.0)


def _verdict(session: Session) -> str:
    step = next_step(session)
    sentence = PLAYING if session.page.caption else step.sentence
    style = (
        f"margin:0 12px;padding:1px 10px;border-left:3px solid {INKS[step.tone]};font-size:var(--words, 13px)"
    )
    return block(text(sentence), testid="hint", style=style)


def _job(session: Session) -> str:
    """The computation under way: what it does, how long it will take, and what it suspects so far."""
    if (job := session.page.job) is None:
        return ""
    doing = f": {text(job.text)}" if job.text else " …"
    left = "" if np.isnan(job.left) else f'<span style="color:{MUTED}"> · about {_time(job.left)} left</span>'
    ranked = sorted(job.suspects.items(), key=lambda pair: -pair[1])[:SUSPECTS]
    drawn = [Bar(capital(name), gain, css(SELECTED)) for name, gain in ranked]
    suspects = heading("Suspects so far, by how much speaks for each") if drawn else ""
    suspects += Bars(drawn, unit="").svg()
    return block(f"{text(job.title)}{doing}{left}{suspects}", testid="job")


def _time(seconds: float) -> str:
    """In steps of ten seconds: it is a guess."""
    return f"{10 * max(round(seconds / 10.0), 1)} s" if seconds < 90.0 else f"{seconds / 60.0:.0f} min"


def _newest(session: Session) -> Message | None:
    """The last message for the user; one that only informs is over as soon as another comes.

    None as well if the strip says the same; a refusal is shown all the same.
    """
    messages = session.page.messages
    last = messages[-1:] if messages and messages[-1].severity is Severity.INFO else ()
    newest = next(reversed((*(m for m in messages if m.severity not in PASSING), *last)), None)
    advice = next_step(session).sentence.rstrip(".").lower()
    is_repeated = (
        newest is not None and newest.severity is not Severity.ERROR and advice in newest.text.lower()
    )
    return None if is_repeated else newest


def _message(message: Message | None) -> str:
    if message is None:
        return ""
    ground, ink = TINTS[message.severity]
    lines = 3 if message.severity is Severity.INFO else 6  # whole ones; the rest is scrolled
    return (
        '<div style="padding:0 12px">'
        f'<div data-testid="message" data-severity="{message.severity}" data-number="{message.number}" '
        f'style="font-size:var(--words, 13px);line-height:1.45;background:{ground};'
        f"color:var(--mantine-color-text);border-left:3px solid {ink};"
        f"border-radius:4px;padding:4px 10px;overflow-wrap:anywhere;overflow-y:auto;box-sizing:border-box;"
        f'max-height:calc({1.45 * lines:.2f}em + 8px)">'
        f"{text(_sentence(message.text))}</div></div>"
    )


def _sentence(message: str) -> str:
    first = message.split(maxsplit=1)[0] if message.strip() else ""
    is_name = "." in first or "/" in first  # a file's name stays as it is
    start = message[:1] if is_name else message[:1].upper()
    return start + message[1:] + ("" if message.endswith((".", "?", "!")) else ".")


class CaptionPanel(AbstractPanel):
    """Large words where one looks, and a link that does `leave`; the scene behind can be turned."""

    keeps_typed = True
    depends = (next_step, "page.caption")

    def __init__(self, worker: Worker, leave: Callable[[], None]):
        super().__init__(worker)
        self._leave = leave

    def build(self, gui: viser.GuiApi) -> None:
        address = self.link("with-my-robot", self._leave)
        self.html(lambda s: caption(s, address) if s.page.caption else "")


def caption(session: Session, address: str) -> str:
    """The overlay in HTML."""
    figure = next_step(session).figure
    number = f'<div data-testid="figure-now" class="figure">{text(figure)}</div>' if figure else ""
    way_out = f'<a href="{text(address)}">{WITH_MY_ROBOT}</a>' if address else ""
    content = f'<div data-testid="caption">{text(session.page.caption)}</div>'
    return f"<div {CAPTION}>{number}{content}{way_out}</div>"
