"""The worker: one thread that owns the session, takes commands in order, and has the views draw.

Callers only put commands into the queue. A waiting command that has a key (a drag) is replaced by a newer one
of the same key; a command without a key is a barrier, so that order never changes. A task is computed in a
second thread from the snapshot at its start, so dragging goes on meanwhile; there is one task at a time, and
it can be cancelled. Chores, which the session itself asks for, have a thread of their own; one that is no
longer needed is cancelled and forgotten. Whatever a command raises becomes a message; the session stays as it
was.
"""

import logging
import math
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from functools import partial
from operator import itemgetter
from typing import Any

from workbench.base.advice import failures
from workbench.base.errors import WorkbenchError
from workbench.base.progress import Cancelled, running
from workbench.base.remedy import speak_to_page
from workbench.base.threads import one_thread
from workbench.session.command import AbstractChange, AbstractChore, AbstractCommand, AbstractTask
from workbench.session.commands.messages import Tell
from workbench.session.journal import Ending, Entry
from workbench.session.page_state import RunningJob, Severity
from workbench.session.state import Session
from workbench.session.view import AbstractKeeper, AbstractView

PROGRESS_INTERVAL = 0.1
"""Minimum time between two progress messages that are drawn [s]."""
KNOWN_AFTER, TICK, LEAP = 3.0, 1.0, 0.05
"""Time after which it is said how long work will take, and how often [s]; not where so much came at once."""
MINOR = 0.1
"""What speaks for suspects that are not worth showing, as a share of what spoke for the strongest so far."""
QUIET = 0.25
"""Without a command for so long, views draw what they have put off [s]."""
log = logging.getLogger(__name__)


class Worker:
    """Owns a session. All methods may be called from any thread.

    From its start until it is closed, linear algebra has one thread in the whole process, callers' own too.

    Args:
        session: To begin with.
        views: What draws its snapshots.
        keepers: What follows its commands.
        journal: Commands before, if the session goes on from an older one.
        opening: Commands that come before any other.
    """

    def __init__(
        self,
        session: Session,
        *,
        views: Iterable[AbstractView] = (),
        keepers: Iterable[AbstractKeeper] = (),
        journal: Iterable[Entry] = (),
        opening: Iterable[AbstractCommand] = (),
    ):
        self._session = session
        self._views, self._keepers = list(views), list(keepers)
        self._broken: list[AbstractView] = []
        self._listeners: list[Callable[[AbstractCommand], None]] = []
        self._chores: tuple[type[AbstractChore], ...] = ()
        self._chore: AbstractChore | None = None
        self._failed: AbstractTask | None = None
        self._chore_cancel = threading.Event()
        self._journal: list[Entry] = list(journal)
        self._kept = len(self._journal)
        before = self._journal[-1].at if self._journal else 0.0
        self._origin = time.monotonic() - before
        self._queue: deque[AbstractCommand | Callable[[], object]] = deque(opening)
        self._changed = threading.Condition()
        self._cancel = threading.Event()
        self._task: AbstractTask | None = None
        self._waiting: Callable[[], None] | None = None
        self._busy = self._closing = False
        notify = lambda severity, text: self.submit(Tell(text, severity))  # noqa: E731
        for keeper in self._keepers:
            keeper.begin(session, step=len(self._journal), at=before, notify=notify)
        self._thread = threading.Thread(target=self._run, name="workbench-session", daemon=True)
        self._thread.start()

    @property
    def session(self) -> Session:
        return self._session

    @property
    def journal(self) -> tuple[Entry, ...]:
        """Every command so far; those that were merged (the places of a drag) as one."""
        return tuple(self._journal)

    def submit(self, command: AbstractCommand) -> None:
        """Ask for a command; returns at once."""
        for listener in self._listeners:
            listener(command)
        with self._changed:
            for waiting in reversed(self._queue) if command.key is not None else ():
                if not isinstance(waiting, AbstractCommand) or waiting.key is None:
                    break
                if waiting.key == command.key:
                    self._queue.remove(waiting)
                    break
            self._queue.append(command)
            self._changed.notify_all()

    def listen(self, listener: Callable[[AbstractCommand], None]) -> None:
        """Tell this function of every command that is asked for, in the caller's thread."""
        self._listeners.append(listener)

    def cancel(self) -> None:
        """Ask the running task to stop; nothing happens if there is none."""
        self._cancel.set()

    def add_view(self, view: AbstractView) -> None:
        """Draw here as well, beginning with the present snapshot."""
        self._put(lambda: (self._views.append(view), self._draw([view])))  # type: ignore[func-returns-value]

    def begin_chores(self, chores: Iterable[type[AbstractChore]]) -> None:
        """Let the session ask for these from now on, as once a page has been drawn."""
        self._put(partial(setattr, self, "_chores", tuple(chores)))

    def wait(self, timeout: float = 60.0) -> bool:
        """Block until nothing runs, or waits but for the end of a drag; False after the timeout [s]."""
        with self._changed:
            return self._changed.wait_for(
                lambda: not (self._queue or self._busy or self._chore or (self._task and not self._waiting)),
                timeout,
            )

    def close(self) -> None:
        self._cancel.set()
        self._chore_cancel.set()
        with self._changed:
            self._closing = True
            self._changed.notify_all()
        self._thread.join(5.0)
        closings: list[Callable[[], None]] = [view.close for view in self._views]
        closings += [keeper.close for keeper in self._keepers]
        for close in closings:
            try:
                close()
            except Exception:  # the others are closed all the same
                log.exception("%s could not be closed", close.__qualname__.partition(".")[0])

    @one_thread()
    def _run(self) -> None:
        speak_to_page()
        while True:
            with self._changed:
                self._busy = False
                self._changed.notify_all()
                behind = [view for view in self._views if view.is_behind]
                pause = QUIET if behind else TICK if self._task else None
                came = self._changed.wait_for(lambda: self._queue or self._closing, pause)
                if self._closing:
                    return
                item, self._busy = self._queue.popleft() if came else self._show_job, True
            before = self._session
            if isinstance(item, AbstractCommand):
                self._carry_out(item)
            else:
                item()
            if self._waiting is not None and (self._session.drag is None or self._cancel.is_set()):
                end, self._waiting = self._waiting, None
                end()
            self._look_for_chores()
            if self._session is not before:
                self._show(revision=before.page.revision + 1)
                self._draw(self._views)
            elif not came:
                self._draw(behind)

    def _carry_out(self, command: AbstractCommand) -> None:
        begin, basis = time.monotonic(), len(self._journal)
        if (why := self._session.page.only_shown) and command.is_kept:
            self._say(Severity.WARNING, why)
            return
        try:
            command.check(self._session)
            if isinstance(command, AbstractTask):
                self._begin(command, basis)
                return
            assert isinstance(command, AbstractChange)
            before = self._session
            self._session = command.done(before, command.apply(before))
            if command.is_kept:
                last = self._journal[-1:] if len(self._journal) > self._kept else []
                done = (entry.command for entry in last if entry.ending is Ending.DONE)
                both = next((command.merged_with(one, before) for one in done), None)
                if both is not None:  # it stands for the last entry, too
                    self._journal.pop()
                self._note(both or command, Ending.DONE, basis, time.monotonic() - begin)
        except Exception as error:
            self._fail(command, error, basis, time.monotonic() - begin)

    def _begin(self, task: AbstractTask, basis: int) -> None:
        if self._task is not None:
            text = f"{self._task.title} is still running; wait for it or cancel it first"
            self._say(Severity.WARNING, text)
            self._note(task, Ending.REFUSED, basis, 0.0, text)
            return
        self._task = task
        self._cancel.clear()
        # other work begins: older errors would come back behind its news
        is_older = lambda m: m.severity is Severity.ERROR or m.refused == type(task).__name__  # noqa: E731
        self._session = self._session.without_messages(is_older)
        self._show(job=RunningJob(task.title, time.monotonic()))
        self._start(task, basis, self._cancel)

    def _look_for_chores(self) -> None:
        """Begin the first chore that the session needs, and cancel the running one if it no longer does."""
        chores = () if self._session.page.only_shown else self._chores
        needed = next((c for kind in chores if (c := kind.needed(self._session)) is not None), None)
        if self._chore is not None:
            if all(kind.needed(self._session) != self._chore for kind in self._chores):
                self._chore_cancel.set()
        elif needed is not None and needed != self._failed:
            self._chore, self._chore_cancel = needed, threading.Event()
            self._show(chore=needed.title)
            self._start(needed, len(self._journal), self._chore_cancel)

    def _start(self, task: AbstractTask, basis: int, cancel: threading.Event) -> None:
        self._kept = basis  # what a computation began from stays in the journal
        arguments = (task, self._session, basis, cancel)
        threading.Thread(target=self._compute, args=arguments, name="workbench-task", daemon=True).start()

    def _compute(self, task: AbstractTask, session: Session, basis: int, cancel: threading.Event) -> None:
        speak_to_page()
        begin, last, done, said, strongest = time.monotonic(), 0.0, 0.0, "", 0.0
        is_chore = isinstance(task, AbstractChore)

        def progress(fraction: float, text: str) -> None:
            nonlocal last, done, said
            if is_chore or (now := time.monotonic()) - last <= PROGRESS_INTERVAL:
                return
            is_even = now - begin > KNOWN_AFTER and 0.0 <= fraction - done < min(LEAP, fraction)
            end = begin + (now - begin) / fraction if is_even else math.nan
            last, (done, said) = now, max((fraction, text), (done, said), key=itemgetter(0))  # never back
            self._put(partial(self._show_job, fraction=done, since=now, text=said, end=end))

        def suspect(sizes: Mapping[str, float]) -> None:
            nonlocal strongest
            strongest = max(strongest, now := max(sizes.values(), default=0.0))
            if now > MINOR * strongest:
                self._put(partial(self._show_job, suspects=dict(sizes)))

        result, failure = None, None
        try:
            with running(progress, cancel.is_set, hear=suspect):
                result = task.compute(session)
        except Exception as error:
            failure = error
        self._put(partial(self._end, task, basis, time.monotonic() - begin, result, failure))

    def _put(self, work: Callable[[], object]) -> None:
        """Have the worker's thread do this, after what was asked for before."""
        with self._changed:
            self._queue.append(work)
            self._changed.notify_all()

    def _show(self, **page: Any) -> None:
        self._session = self._session.updated("page", **page)

    def _show_job(self, **news: Any) -> None:
        if (job := self._session.page.job) is not None:
            self._show(job=replace(job, **news))

    def _end(
        self, task: AbstractTask, basis: int, seconds: float, result: Any, failure: Exception | None
    ) -> None:
        """A chore that was cancelled leaves nothing; one that failed is not tried again in the same place.
        What a task found comes once nobody drags: it may put other targets under the hand.
        """
        is_chore = isinstance(task, AbstractChore)
        if not is_chore and failure is None:
            if self._cancel.is_set():
                kept = task.stopped(result)
                task, failure = (task, Cancelled()) if kept is None else (kept, None)
            if failure is None and self._session.drag is not None:
                self._waiting = partial(self._end, task, basis, seconds, result, failure)
                return
        if is_chore:
            self._chore, self._failed = None, None
            self._show(chore="")
        else:
            self._task = None
            self._show(job=None)
        try:
            if failure is not None:
                raise failure
            with failures() as failed:
                after = task.done(self._session, task.finish(self._session, result))
            for sentence in failed:
                after = after.with_message(Severity.WARNING, sentence)
            self._session = after
            self._note(task, Ending.DONE, basis, seconds, result=result if task.is_filed else None)
        except Exception as error:
            if is_chore and isinstance(error, Cancelled):
                return
            self._failed = task if is_chore else self._failed
            self._fail(task, error, basis, seconds)

    def _fail(self, command: AbstractCommand, error: Exception, basis: int, seconds: float) -> None:
        if isinstance(error, Cancelled):
            ending, severity, text = Ending.CANCELLED, Severity.INFO, f"{command.title}: cancelled"
        elif isinstance(error, WorkbenchError):
            ending, severity, text = Ending.REFUSED, Severity.ERROR, str(error)
        else:
            ending, severity = Ending.FAILED, Severity.ERROR
            text = f"{command.title} failed ({type(error).__name__}: {error}); the session is unchanged"
            log.error("%s failed", command.title, exc_info=error)
        self._say(severity, text, refused=type(command).__name__)
        self._note(command, ending, basis, seconds, text)

    def _say(self, severity: Severity, text: str, *, refused: str = "") -> None:
        """Once, however often: every place of a drag may be refused."""
        others = self._session.without_messages(lambda m: m.text == text)
        self._session = others.with_message(severity, text, refused=refused)

    def _note(
        self,
        command: AbstractCommand,
        ending: Ending,
        basis: int,
        seconds: float,
        text: str = "",
        *,
        result: Any = None,
    ) -> None:
        at = time.monotonic() - self._origin
        entry = Entry(command, ending, basis, time.time(), seconds, text, at, result)
        self._journal.append(replace(entry, result=None))  # a recording keeps it, memory need not
        for keeper in self._keepers:
            try:
                keeper.note(len(self._journal), entry, self._session)
            except Exception:
                log.exception("a recorder could not follow the session")

    def _draw(self, views: Iterable[AbstractView]) -> None:
        for view in views:
            try:
                view.draw(self._session)
            except Exception:
                if view not in self._broken:  # it would fail at every step
                    self._broken.append(view)
                    log.exception("%s could not draw the session", type(view).__name__)
