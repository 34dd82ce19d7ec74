"""Lines at the end of a file: each whole or not at all, and none lost while the disk is full.

A line is on the disk before the next command is taken, so neither the end of the process by whatever signal
nor a loss of power loses it. A line that stands for the one before it as well (the places of a drag) is
written over that one, by a single call and filled up with spaces: at any moment one of the two is there. The
operating system brings it onto the disk when it likes: a loss of power may take the drag in hand, but nothing
before it. What can't be written waits in memory and is tried again with the next line.
"""

import contextlib
import errno
import fcntl
import os
from collections import deque
from collections.abc import Mapping
from pathlib import Path

from workbench.base.errors import OptionError
from workbench.base.files import sync_folder, write_bytes

LOCK = ".lock"


class Appender:
    """Appends to one file of a folder, which nobody else appends to meanwhile.

    Args:
        path: The file.
        length: How much of it is kept [bytes]; what follows is cut off with the next line.

    Raises:
        OptionError: another process records in this folder.
        OSError: the folder can't be written.
    """

    def __init__(self, path: Path, *, length: int = 0):
        self._folder, self._length = path.parent, length
        self._waiting: deque[tuple[bytes, Mapping[str, bytes]]] = deque()
        self._last = b""
        self._lock = _lock(path.parent)
        try:
            self._file = os.open(path, os.O_WRONLY | os.O_CREAT, 0o666)
        except OSError:
            os.close(self._lock)
            raise
        for folder in (path.parent, path.parent.absolute().parent):
            sync_folder(folder)

    def add(self, line: str, files: Mapping[str, bytes] | None = None, *, instead: bool = False) -> None:
        """Write a line after the files that it speaks of, and what has been waiting before it.

        Args:
            line: Without its end.
            files: By their place in the folder.
            instead: Whether it takes the place of the line before it.

        Raises:
            OSError, FileError: it can't be written now; it waits.
        """
        content = line.encode() + b"\n"
        if instead and self._waiting:
            self._waiting.pop()
        elif instead:
            self._overwrite(content)
            return
        self._waiting.append((content, files or {}))
        self.write_waiting()

    def write_waiting(self) -> None:
        """Write what could not be written so far.

        Raises:
            OSError, FileError: it still can't be.
        """
        while self._waiting:
            content, needed = self._waiting[0]
            for name, data in needed.items():
                if not (self._folder / name).exists():
                    write_bytes(self._folder / name, data)
            self._write(content)
            self._waiting.popleft()

    def close(self) -> None:
        """Let others append."""
        os.close(self._file)
        os.close(self._lock)

    def _overwrite(self, content: bytes) -> None:
        """Put a line where the last one is; where it finds no room the last one goes, and it waits."""
        content = content[:-1].ljust(len(self._last) - 1) + b"\n"
        self._length -= len(self._last)
        written = 0
        with contextlib.suppress(OSError):
            written = os.pwrite(self._file, content, self._length)
        if written == len(content):
            self._length, self._last = self._length + written, content
            return
        self._last = b""
        self._waiting.append((content, {}))
        self.write_waiting()

    def _write(self, content: bytes) -> None:
        if os.fstat(self._file).st_size != self._length:
            os.ftruncate(self._file, self._length)
        if os.pwrite(self._file, content, self._length) != len(content):
            os.ftruncate(self._file, self._length)
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        getattr(os, "fdatasync", os.fsync)(self._file)  # macOS has the second alone
        self._length, self._last = self._length + len(content), content


def _lock(folder: Path) -> int:
    """Hold the folder's lock, which the operating system frees with the process."""
    lock = os.open(folder / LOCK, os.O_RDWR | os.O_CREAT, 0o666)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        owner = os.read(lock, 20).decode(errors="replace").strip()
        os.close(lock)
        raise OptionError(
            f"{folder} is being recorded by process {owner or 'unknown'}; stop that one, or branch off "
            "with --step"
        ) from None
    os.ftruncate(lock, 0)
    os.pwrite(lock, str(os.getpid()).encode(), 0)
    return lock
