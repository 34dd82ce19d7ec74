"""Commands: frozen records that can be checked, executed, written to the journal, and replayed.

A class of this kind is a frozen dataclass, and known by its name, from its definition on: `kinds` lists them,
and no list is kept elsewhere; those of other packages stand in their records of parts. The
journal writes that name and the fields, so both stay as they are.
"""

import inspect
import operator
from abc import ABC, abstractmethod
from collections.abc import Callable, Hashable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar, Generic, TypeVar, dataclass_transform

from workbench.base.assets import assets
from workbench.parts import parts
from workbench.session.page_state import PASSING, Severity
from workbench.session.state import Session

Result = TypeVar("Result")
"""What a task computes."""


def computed(value: Callable[[Any], Hashable]) -> Any:
    """A `title` or `key` that depends on the command's fields."""
    return property(value)


@dataclass_transform(frozen_default=True, field_specifiers=(field,))
class AbstractCommand(ABC):
    """A user request, with plain values as fields."""

    __dataclass_fields__: ClassVar[dict[str, Any]]

    is_automatic: ClassVar[bool] = False
    """Whether the program sends it by itself: it does not show that somebody has read the messages."""
    is_kept: ClassVar[bool] = True
    """Whether the journal keeps it; what every page says anew as it connects is not kept."""

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        dataclass(frozen=True)(cls)

    @property
    @abstractmethod
    def title(self) -> str:
        """Description for the journal and for messages."""

    def done(self, before: Session, after: Session) -> Session:
        """The session after it: its step back has its name, and what was told of what is gone is over."""
        done = after.history.done
        if not all(step.by for step in done[-2:]):  # in a drag, that of the drag stands above
            done = tuple(step if step.by else replace(step, by=self.title) for step in done)
            after = after.updated("history", done=done)
        count = before.page.message_count
        if after.plate is not before.plate:  # a file that could not be made of it may be made now
            is_over = lambda m: m.number <= count and m.severity is Severity.ERROR and not m.refused  # noqa: E731
            after = after.without_messages(is_over)
        both = [(s.robot, s.measurements.loaded, s.results.run) for s in (before, after)]
        if all(map(operator.is_, *both)):
            return after
        return after.without_messages(lambda m: m.number <= count and m.severity is Severity.WARNING)

    @property
    def key(self) -> Hashable | None:
        """A newer command replaces one that waits in the queue under the same key; None: never."""
        return None

    def check(self, session: Session) -> None:  # noqa: B027
        """Raise a `WorkbenchError` if it makes no sense here; unless overridden, it always does."""

    def removes(self, session: Session) -> str:
        """What it takes away that a user should agree to first, as a sentence; raises as `compute` does."""
        return ""


class AbstractChange(AbstractCommand):
    """A quick command, carried out by the worker itself."""

    @abstractmethod
    def apply(self, session: Session) -> Session:
        """The session afterwards."""

    def done(self, before: Session, after: Session) -> Session:
        """As of any command; what informs was read by who goes on, and a former refusal is over."""
        after = super().done(before, after).without_messages(lambda m: m.refused == type(self).__name__)
        is_read = after.page.message_count == before.page.message_count and not self.is_automatic
        return after.without_messages(lambda m: m.severity in PASSING) if is_read else after

    def merged_with(self, previous: AbstractCommand, session: Session) -> "AbstractChange | None":
        """One change that does what the previous command and this one did; None if both are needed.

        Args:
            previous: The last command of the journal, which was carried out.
            session: The session between the two.
        """
        return None


class UnknownCommand(AbstractChange):
    """A command of a recording that no installed package takes as it was recorded: it is skipped.

    Args:
        name: Its name.
        recorded: Its title as it was recorded.
    """

    name: str
    recorded: str

    title = computed(lambda self: self.recorded)

    def apply(self, session: Session) -> Session:
        return session


class AbstractTask(AbstractCommand, Generic[Result]):
    """A long command, computed beside the worker from the session at its start.

    Other commands go on meanwhile; what was computed is put into the session as it is at the end.
    """

    is_filed: ClassVar[bool] = False
    """Whether the recording keeps the result as a file (`journal/records.py`); else it is computed again."""

    @abstractmethod
    def compute(self, session: Session) -> Result:
        """The long part, which reports its `progress`; once `cancelled` it may return anything, or raise."""

    @abstractmethod
    def finish(self, session: Session, result: Result) -> Session:
        """The present session with the result."""

    def stopped(self, result: Result) -> "AbstractTask[Result] | None":
        """The task that leads to what was found until it was cancelled; None: nothing of that is kept."""
        return None


class AbstractLoad(AbstractTask[Result]):
    """A task that reads a file as measurements, given its `name` and `content`."""

    endings: ClassVar[tuple[str, ...]]
    """Of the files' names, in lower case."""

    def removes(self, session: Session) -> str:
        return "" if session.results.is_empty else at_stake(session)

    @classmethod
    def packed(cls, folder: Path) -> tuple[str, bytes] | None:
        """Name and content of a file that holds a folder's measurements; None where folders are not read."""
        return None


def at_stake(session: Session) -> str:
    """What goes with the measurements, as a sentence; empty if there are none but those of the demo."""
    loaded, samples = session.measurements.loaded, (assets() / "samples").glob("*.csv")
    if loaded is None or (loaded.file and any(loaded.file.content == s.read_bytes() for s in samples)):
        return ""
    results = "" if session.results.is_empty else " and the results based on them"
    return f"The measurements ({loaded.name}){results} will be removed; Undo restores them."


class AbstractChore(AbstractTask[Result]):
    """A computation that the session itself requests, so that no change has to wait for it.

    Chores run beside tasks, one at a time, and are cancelled when the session no longer needs them.
    """

    is_redone: ClassVar[bool] = False
    """Whether a reopened session requests it again, so that reopening need not wait for it."""

    @classmethod
    @abstractmethod
    def needed(cls, session: Session) -> "AbstractChore[Any] | None":
        """The chore that this session needs; None if none. Equal chores compute the same."""


def kinds() -> dict[str, type[AbstractCommand]]:
    """All commands that are defined, by name; no other package's takes the place of one of ours."""
    parts("session_commands", AbstractCommand, classes=True)  # defines them
    found = sorted(_below(AbstractCommand), key=lambda kind: kind.__module__.startswith("workbench."))
    return {kind.__name__: kind for kind in found if kind is not UnknownCommand}


def _below(kind: Any) -> Iterator[type[AbstractCommand]]:
    for lower in kind.__subclasses__():
        if not inspect.isabstract(lower):
            yield lower
        yield from _below(lower)
