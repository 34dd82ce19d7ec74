"""The journal on the disk: one line a command, written before the next one is taken.

Trouble with the disk is told once, the session goes on, and the lines wait; when there is room again they
follow, so that nothing is missing.
"""

import contextlib
import json
import logging
from datetime import UTC, datetime
from typing import Any

from workbench.base.errors import WorkbenchError
from workbench.session.journal import codec
from workbench.session.journal.appender import Appender
from workbench.session.journal.entry import Entry
from workbench.session.journal.numbers import changed_numbers
from workbench.session.state import Session, Severity
from workbench.session.view import AbstractKeeper, Tell

log = logging.getLogger(__name__)


class Logbook(AbstractKeeper):
    """Writes a session's journal.

    Args:
        file: Where to; None if there is no place, as `trouble` says.
        trouble: What has gone wrong so far.
    """

    def __init__(self, file: Appender | None, *, trouble: str = ""):
        self._file, self._trouble = file, trouble
        self._step = 0
        self._tell: Tell | None = None
        self._before: Session | None = None
        self._last: Session | None = None

    def begin(self, session: Session, *, step: int, at: float, tell: Tell) -> None:
        self._step, self._tell = step, tell
        self._before = self._last = session
        if self._trouble:
            tell(Severity.WARNING, self._trouble)

    def note(self, step: int, entry: Entry, session: Session) -> None:
        if self._file is None:
            return
        try:
            fields, files = codec.encode(entry.command)
            is_instead = step == self._step
            if not is_instead:
                self._before = self._last
            self._step, self._last = step, session
            line = json.dumps(
                _line(step, entry, fields, session, self._before), ensure_ascii=False, allow_nan=False
            )
            self._file.add(line, files, instead=is_instead)
        except (OSError, WorkbenchError) as error:
            self._fail(error)
        except Exception as error:
            log.exception("the journal could not be written")
            self.close()
            self._say(f"the journal of this session ends here ({type(error).__name__}: {error})")
        else:
            self._recover()

    def close(self) -> None:
        if self._file is not None:
            with contextlib.suppress(OSError, WorkbenchError):  # it was told when it began
                self._file.write_waiting()
            self._file.close()
            self._file = None

    def _fail(self, error: OSError | WorkbenchError) -> None:
        if not self._trouble:
            why = (error.strerror if isinstance(error, OSError) else None) or str(error)
            self._trouble = (
                f"the session can't be recorded at present ({why}); it goes on, and what is missing is "
                "written once there is room"
            )
            self._say(self._trouble)

    def _recover(self) -> None:
        if self._trouble:
            self._trouble = ""
            self._say("the session is recorded again, and nothing is missing", Severity.INFO)

    def _say(self, text: str, severity: Severity = Severity.WARNING) -> None:
        if self._tell is not None:
            self._tell(severity, text)


def _line(
    step: int, entry: Entry, fields: dict[str, Any], session: Session, before: Session | None
) -> dict[str, Any]:
    told = 0 if before is None else before.message_count
    return {
        "step": step,
        "at": round(entry.at, 6),
        "time": datetime.fromtimestamp(entry.time, UTC).isoformat(timespec="milliseconds"),
        "command": type(entry.command).__name__,
        "fields": fields,
        "title": entry.command.title,
        "ending": str(entry.ending),
        "basis": entry.basis,
        "seconds": round(entry.seconds, 6),
        "text": entry.text,
        "says": [message.text for message in session.messages if message.number > told],
        "numbers": changed_numbers(session, before),
    }
