"""The strip above the tabs, with the state, the next step and running tasks; the last message; captions."""

import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numpy as np
import viser

from workbench.base.wording import capital
from workbench.session.commands.messages import Dismiss, OpenTab, SetCaption, Steer, SteerDemo
from workbench.session.commands.undo import Redo, Undo
from workbench.session.next_step import Action, NextStep, next_step
from workbench.session.page_state import PASSING, Message, RunningJob, Severity, Tab
from workbench.session.state import Session
from workbench.session.worker import Worker
from workbench.views.drawables.measured import error_scale
from workbench.views.drawables.scene_contents import title
from workbench.views.page.html import INKS, MUTED, block, text
from workbench.views.page.panels.form import Control
from workbench.views.page.panels.legend import colour_bar, cubes_scale, has_errors, things
from workbench.views.page.panels.panel import AbstractPanel
from workbench.views.page.style import CAPTION, MESSAGE

MOST_MORE = 6
"""Further buttons, as for readings of rows that fit alike."""
WITH_MY_ROBOT = "With my robot"
TINTS = {
    Severity.INFO: ("rgba(59,130,246,.12)", "#3b82f6"),
    Severity.WARNING: ("rgba(245,158,11,.14)", "#c2700a"),
    Severity.ERROR: ("rgba(239,68,68,.13)", "#dc2626"),
}
AWAY = 'style="float:right;margin-left:8px;color:inherit;text-decoration:none"'
CREEP = 0.08
"""How far a bar goes beyond what was reported, at most: a round of a search reports a tenth at once."""
PLAYING = "This is the demo; the first thing that you change ends it."
OVER = "The demo is over. Go on from here, or begin with your own robot."


class Strip(AbstractPanel):
    """The state of the session; in one row, so that the height stays, two buttons for the next step, or those
    of the demo or of long work under way, with its bar."""

    keeps_typed = True
    depends = (next_step, title, "history")

    _step = NextStep("")

    def build(self, gui: viser.GuiApi) -> None:
        links = [(kind.title, self.link(kind.title, partial(self.send, kind))) for kind in (Undo, Redo)]
        self.html(lambda s: _verdict(s, links))
        for k, hint in enumerate(("What to do next.", *["An alternative next step."] * (1 + MOST_MORE))):
            self._offer(k, hint)
        self.button(
            Steer.PAUSE,
            lambda: SteerDemo(Steer.ON if self._worker.session.page.is_paused else Steer.PAUSE),
            viser.Icon.PLAYER_PAUSE,
            "Pause the demo here, or continue.",
            visible=lambda s: s.page.caption and not s.page.is_over,
            label=lambda s: Steer.ON if s.page.is_paused else Steer.PAUSE,
        )
        end, hint = lambda: SetCaption(""), "End the demo here; so does the first thing that you change."
        label = lambda s: "Done" if s.page.is_over else "Stop the demo"  # noqa: E731
        is_there = lambda s: s.page.caption  # noqa: E731
        self.button("Stop the demo", end, viser.Icon.PLAYER_STOP, hint, visible=is_there, label=label)
        cancel, hint = (
            self._worker.cancel,
            "Stop the computation; of a search for a plate, the best so far is kept.",
        )
        works = lambda s: s.page.job is not None and not s.page.caption  # noqa: E731
        self.button("Cancel", cancel, viser.Icon.PLAYER_STOP, hint, visible=works)
        bar = gui.add_progress_bar(0.0, animated=True)
        self.add(Control(bar, visible=lambda s: s.page.job is not None, value=_progress))

    def _offer(self, k: int, hint: str) -> None:
        """A button that does what it says when it is pressed; the first is the one to press."""

        def find(step: NextStep) -> Action | None:
            return dict(enumerate((step.next, step.other, *step.more))).get(k)

        def label(session: Session) -> str:
            action = find(self._offered(session))
            return "" if action is None else action.label

        def do(event: viser.GuiEvent) -> None:
            if (action := find(self._step)) is None:
                return
            self._worker.submit(OpenTab(action.tab))
            for command in filter(None, (action.command, action.then)):
                self._worker.submit(command)
            if action.save is not None:
                self.save(event, action.save)

        is_dragged = lambda s: s.drag is not None  # noqa: E731
        self.press("Next", do, None, hint, main=k == 0, visible=label, label=label, disabled=is_dragged)

    def _offered(self, session: Session) -> NextStep:
        """In a drag those from before it, though none can be pressed: they keep the height."""
        return self._step if session.drag is not None else next_step(session)

    def show(self, session: Session) -> None:
        self._step = self._offered(session)
        self._gui.set_panel_label(title(session))


class Messages(AbstractPanel):
    """The last message, at the lower end of the panel, where it moves nothing else (`style.py`).

    What is no refusal is over with the tab on which it came.
    """

    depends = ("page.messages", "page.tab", next_step)

    def build(self, gui: viser.GuiApi) -> None:
        self._seen: tuple[Message | None, Tab | None] = None, None
        dismiss = self.link("dismiss", lambda: self._worker.submit(Dismiss()))
        self.html(lambda s: _message(self._newest_here(s), dismiss))

    def _newest_here(self, session: Session) -> Message | None:
        """The last message for the user; one that only informs is over as soon as another comes.

        None as well if the strip says the same; a refusal is shown all the same.
        """
        messages, tab = session.page.messages, session.page.tab
        last = messages[-1:] if messages and messages[-1].severity is Severity.INFO else ()
        newest = next(reversed((*(m for m in messages if m.severity not in PASSING), *last)), None)
        if newest is not self._seen[0] or self._seen[1] is None:
            self._seen = newest, tab
        if newest is None or newest.severity is Severity.ERROR:
            return newest
        is_repeated = next_step(session).sentence.rstrip(".").lower() in newest.text.lower()
        return None if is_repeated or tab is not self._seen[1] else newest


def _progress(session: Session) -> float:
    """How much of the long work is done, in percent; between two reports it creeps on as fast as so far."""
    if (job := session.page.job) is None:
        return 0.0
    pace = job.fraction / max(job.since - job.begun, 0.1)
    ahead = CREEP * (1.0 - np.exp(-pace * (time.monotonic() - job.since) / CREEP))
    return 100.0 * min(max(job.fraction + np.nan_to_num(ahead), 0.02), 1.0)


def _steps(session: Session, links: Sequence[tuple[str, str]]) -> Iterator[str]:
    """Links that take the last step back and make it again; each says which step that is."""
    is_free = session.drag is None and not session.page.caption
    for (what, address), steps in zip(links, (session.history.done, session.history.undone), strict=True):
        if address and steps and is_free:
            name = f"{what}: {steps[-1].by[:1].lower()}{steps[-1].by[1:]}"
            yield f'<a role="button" href="{text(address)}" style="color:inherit">{text(name)}</a>'


def _verdict(session: Session, links: Sequence[tuple[str, str]]) -> str:
    """The sentence of the next step, or of the work under way with its time left; what can be undone."""
    step = next_step(session)
    sentence = text(step.sentence)
    if session.page.caption:  # which a phone has no room for above the arm
        sentence = f'<span class="wide">{OVER if session.page.is_over else PLAYING}</span>'
        sentence += f'<span class="phone">{text(session.page.caption)}</span>'
    if (job := session.page.job) is not None:
        muted = " · ".join(filter(None, (job.text, _time(job))))
        sentence += f'<div data-testid="job" style="color:{MUTED}">{text(capital(muted))}</div>'
    sentence += f'<div style="color:{MUTED}">{" · ".join(_steps(session, links))}</div>'
    style = (
        f"margin:0 12px;padding:1px 10px;border-left:3px solid {INKS[step.tone]};font-size:var(--words, 13px)"
    )
    return block(sentence, testid="hint", style=style)


def _time(job: RunningJob) -> str:
    """How long it will still take, in steps of ten seconds, as it is a guess; or else how long it has."""
    now = time.monotonic()
    if not job.end > now:  # nothing is known, or it takes longer than it seemed
        return f"{now - job.begun:.0f} s so far" if now - job.begun >= 1.0 else ""
    left = job.end - now
    shown = f"{10 * max(round(left / 10.0), 1)} s" if left < 90.0 else f"{left / 60.0:.0f} min"
    return f"about {shown} left"


def _message(message: Message | None, dismiss: str) -> str:
    if message is None:
        return ""
    ground, ink = TINTS[message.severity]
    over = f'<a href="{text(dismiss)}" title="Dismiss this message" {AWAY}>✕</a>' if dismiss else ""
    end = "" if message.text.endswith((".", "?", "!")) else "."
    return (
        f"<div {MESSAGE}>"
        f'<div data-testid="message" data-severity="{message.severity}" data-number="{message.number}" '
        f'style="font-size:var(--words, 13px);line-height:1.45;background:{ground};'
        f"color:var(--mantine-color-text);border-left:3px solid {ink};"
        f'border-radius:4px;padding:4px 10px;overflow-wrap:anywhere;overflow-y:auto;max-height:45vh">'
        f"{over}{text(capital(message.text))}{end}</div></div>"
    )


class CaptionPanel(AbstractPanel):
    """Large words where one looks, and a link that does `leave`; the scene behind can be turned. On a phone,
    whose legend is at the end of all, also what colours mean."""

    keeps_typed = True
    depends = (next_step, "page.caption", things, "choices.overlay", "results.comparison")

    def __init__(self, worker: Worker, leave: Callable[[], None]):
        super().__init__(worker)
        self._leave = leave

    def build(self, gui: viser.GuiApi) -> None:
        address = text(self.link("with-my-robot", self._leave))
        way_out = address and f'<a href="{address}">{WITH_MY_ROBOT}</a>'

        def caption(session: Session) -> str:
            figure = text(next_step(session).figure)
            number = figure and f'<div data-testid="figure-now" class="figure">{figure}</div>'
            content = f'<div data-testid="caption">{text(session.page.caption)}</div>'
            times = f"errors × {session.choices.overlay.exaggeration:g}" * has_errors(session)
            rows = session.seen_rows
            scale = (
                colour_bar(error_scale(rows)) if rows is not None and rows.stages else cubes_scale(session)
            )
            key = f'<div class="phone">{things(session)}{times}{scale}</div>'
            said = f"{number}{content}{key}{way_out}" if session.page.caption else key
            return f"<div {CAPTION}>{said}</div>"

        self.html(caption)
