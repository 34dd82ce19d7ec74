"""The journal on the disk: one line a command, whole or not at all, written before the next one is taken.

Neither the end of the process by whatever signal nor a loss of power loses a line: lines are only appended.
One that stands for the one before it as well (the places of a drag) has the same step, and follows it; with
the next command the last of them is written over the first, and the others are cut off. The operating system
brings them onto the disk when it likes: a loss of power may take the drag in hand, but nothing before it.

Trouble with the disk is told once, the session goes on, and the lines wait; when there is room again they
follow, so that nothing is missing.
"""

import contextlib
import errno
import fcntl
import json
import logging
import os
from collections import deque
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path

from workbench.base.errors import OptionError, WorkbenchError
from workbench.base.files import open_regular, sync_folder, write_bytes
from workbench.session.journal import codec
from workbench.session.journal.numbers import changed_numbers
from workbench.session.page_state import Severity
from workbench.session.state import Session
from workbench.session.view import AbstractKeeper, Entry, Notify

LOCK = ".lock"
Line = tuple[str, Mapping[str, bytes], bool]
"""Without its end; the files that it speaks of by their place in the folder, which are written first; whether
it stands for the line before it as well."""


class Appender:
    """Appends to one file of a folder, which nobody else appends to meanwhile.

    Args:
        path: The file.
        length: How much of it is kept [bytes]; what follows is cut off with the next line.
    """

    def __init__(self, path: Path, *, length: int = 0):
        self._folder, self._length, self._first, self._last = path.parent, length, length, length
        self._waiting: deque[Line] = deque()
        self._lock = _lock(path.parent)
        try:
            self._file = open_regular(path, os.O_RDWR | os.O_CREAT)
        except OSError:
            os.close(self._lock)
            raise
        self._size = os.fstat(self._file).st_size
        for left in (path.parent / codec.INPUTS).glob(".*"):  # by a kill while it was written
            left.unlink()
        for folder in (path.parent, path.parent.absolute().parent):
            sync_folder(folder)

    def add(self, *lines: Line) -> None:
        """Write lines, after those that could not be written so far."""
        for *_, instead in lines:
            if instead and self._waiting:
                self._waiting.pop()
        self._waiting += lines
        while self._waiting:
            line, needed, instead = self._waiting[0]
            for name, data in needed.items():
                if not os.path.lexists(self._folder / name):
                    write_bytes(self._folder / name, data)
            self._append(line.encode() + b"\n", instead=instead)
            self._waiting.popleft()

    def close(self) -> None:
        """Write what waits, if there is room, and let others append."""
        with contextlib.suppress(OSError, WorkbenchError):  # it was told when it began
            self._keep_lock()
            self.add()
            self._settle()
        for file in (self._file, self._lock):
            os.close(file)

    def _keep_lock(self) -> None:
        """Take the lock again where its file was removed, unless another session has begun here meanwhile."""
        path = self._folder / LOCK
        if os.path.lexists(path) and os.path.samestat(os.lstat(path), os.fstat(self._lock)):
            return
        lock = _lock(self._folder)
        if os.fstat(self._file).st_size != self._size:
            os.close(lock)
            raise OptionError(f"another session was recorded in {self._folder}", option="folder")
        os.close(self._lock)
        self._lock = lock

    def _append(self, content: bytes, *, instead: bool) -> None:
        self._keep_lock()
        if not instead:
            self._settle()
        self._cut()
        try:
            self._write(content, self._length)
        except OSError:
            self._cut()
            raise
        self._last, self._first = self._length, self._first if instead else self._length
        self._size = self._length = self._length + len(content)
        if not instead and len(self._waiting) == 1:
            getattr(os, "fdatasync", os.fsync)(self._file)  # macOS has the second alone

    def _settle(self) -> None:
        """Have the last line of a step stand where its first one does; the last stays until that is whole."""
        end = self._first + self._length - self._last
        if end <= self._last:
            self._write(os.pread(self._file, end - self._first, self._last), self._first)
            self._last, self._length = self._first, end
            self._cut()

    def _write(self, content: bytes, at: int) -> None:
        if os.pwrite(self._file, content, at) != len(content):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    def _cut(self) -> None:
        """End the file where what is kept of it ends."""
        os.ftruncate(self._file, self._length)
        self._size = self._length


def _lock(folder: Path) -> int:
    """Hold the folder's lock, which the operating system frees with the process."""
    lock = open_regular(folder / LOCK, os.O_RDWR | os.O_CREAT)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        owner = os.read(lock, 20).decode(errors="replace").strip()
        os.close(lock)
        raise OptionError(
            f"{folder} is being recorded by process {owner or 'unknown'}; stop that one, or branch off "
            "with --step",
            option="folder",
            found=owner,
        ) from None
    os.ftruncate(lock, 0)
    os.pwrite(lock, str(os.getpid()).encode(), 0)
    return lock


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
        self._notify: Notify = lambda severity, text: None
        self._before: Session | None = None
        self._last: Session | None = None

    def begin(self, session: Session, *, step: int, at: float, notify: Notify) -> None:
        self._step, self._notify = step, notify
        self._before = self._last = session
        if self._trouble:
            notify(Severity.WARNING, self._trouble)

    def note(self, step: int, entry: Entry, session: Session) -> None:
        if self._file is None:
            return
        try:
            fields, files = codec.encode(entry.command)
            is_instead = step == self._step
            if not is_instead:
                self._before = self._last
            self._step, self._last = step, session
            result, more = codec.encode_result(entry.result, self._before or session)
            before = self._before
            earlier = 0 if before is None else before.page.message_count
            content = {
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
                **({} if result is None else {"result": result}),
                "says": [message.text for message in session.page.messages if message.number > earlier],
                "numbers": changed_numbers(session, before),
            }
            line = json.dumps(content, ensure_ascii=False, allow_nan=False)
            self._file.add((codec.sealed(line), files | more, is_instead))
        except (OSError, WorkbenchError) as error:
            if not self._trouble:
                why = (error.strerror if isinstance(error, OSError) else None) or str(error)
                self._trouble = (
                    f"the session can't be recorded at present ({why}); it continues, and the missing steps "
                    "are written as soon as there is space"
                )
                self._notify(Severity.WARNING, self._trouble)
        except Exception as error:
            log.exception("the journal could not be written")
            self.close()
            self._notify(
                Severity.WARNING, f"the journal of this session ends here ({type(error).__name__}: {error})"
            )
        else:
            if self._trouble:
                self._trouble = ""
                self._notify(Severity.INFO, "the session is recorded again, with no step missing")

    def close(self) -> None:
        if self._file is not None:
            self._file.close()
            self._file = None
