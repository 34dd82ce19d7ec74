"""Outputs of a recording: a file, an open viewer, or both.

Two timelines and no others: `step` (commands of the session), and `session_time` (seconds of a clock that
never jumps).

rerun's own file sink waits for ever once the disk is full. It writes into a pipe instead, and a thread moves
the bytes into the file: what finds no room waits in memory, and after too much of it the rest is dropped.
"""

import contextlib
import os
import socket
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

os.environ.setdefault("RERUN_ANALYTICS_ENABLED", "false")
import rerun as rr
import rerun.blueprint as rrb

from workbench.base.errors import OptionError
from workbench.session.comparison import ModelStage

STEP, TIME = "step", "session_time"
EYE = "world/eye"
"""The camera that looks at the scene."""
PATHS = {stage: stage.name.lower() for stage in ModelStage}
OPEN_FILES = "/proc/self/fd" if os.path.isdir("/proc/self/fd") else "/dev/fd"
"""Where the files that this process has open stand by their numbers: on Linux; on macOS."""
PORT = 9876
"""Port of a rerun viewer that was started without options."""
MAX_WAITING = 32 * 2**20
"""Bytes that wait for room on the disk before the rest of the recording is dropped."""
CHUNK = 2**18
TICK = 1.0
"""Time after which a viewer gets what was drawn [s]."""
FILE_TICK = 20.0
"""Time after which it goes to a file [s], unless it is a mebibyte earlier: large batches need a fifth of the
room on the disk, but 0.1 MB of memory for every place of a drag that waits in one. What a killed program had
not handed on is drawn from the journal."""
PATIENCE = 5.0
"""How long the end of a recording, or a viewer's answer, may take [s]."""

Notify = Callable[[str], None]


class AbstractOutlet(ABC):
    """Takes one recording."""

    stream: rr.RecordingStream

    def __init__(self, recording: str, *, tick: float):
        batches = rr.ChunkBatcherConfig(flush_tick=tick)
        name = f"workbench {recording}"  # the viewer keeps one layout for all recordings of an application
        self.stream = rr.RecordingStream(name, recording_id=recording, batcher_config=batches)
        self.stream.set_log_time_enabled(False)
        self.stream.set_log_tick_enabled(False)

    @abstractmethod
    def close(self) -> None:
        """Finish the recording; a file gets its index."""
        self.stream.disconnect()


class FileOutlet(AbstractOutlet):
    """Writes a file, over an older one.

    Args:
        path: The file.
        recording: Identity of the recording; parts of one session share it.
        notify: Told once of trouble with the disk, which `trouble` then says.
    """

    def __init__(self, path: Path, recording: str, *, notify: Notify = lambda text: None):
        self._path, self._notify = path, notify
        self.trouble = ""
        self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o666)
        self._end, inlet = os.pipe()
        self._pump = threading.Thread(target=self._move, name="workbench-recording", daemon=True)
        self._pump.start()
        super().__init__(recording, tick=FILE_TICK)
        self.stream.set_sinks(rr.FileSink(f"{OPEN_FILES}/{inlet}"))
        os.close(inlet)  # the sink has its own handle; the pipe ends when it lets go

    def close(self) -> None:
        super().close()
        self._pump.join(PATIENCE)

    def _move(self) -> None:
        """Bytes from the pipe into the file; the pipe is always emptied."""
        waiting, dropped = bytearray(), False
        while chunk := os.read(self._end, CHUNK):
            if dropped:
                continue
            waiting += chunk
            try:
                while waiting:
                    del waiting[: os.write(self._file, waiting)]
            except OSError as error:
                if not self.trouble:
                    self.trouble = f"{self._path.name} can't be written ({error.strerror})"
                    self._notify(
                        f"{self.trouble}, so pictures are missing from here on; the session continues, and "
                        "'workbench review' draws them from its journal"
                    )
                dropped = len(waiting) > MAX_WAITING
        os.close(self._end)
        os.close(self._file)


class ViewerOutlet(AbstractOutlet):
    """Streams to a viewer that is open at `HOST`, `HOST:PORT`, or the viewer's own URL."""

    def __init__(self, address: str, recording: str):
        super().__init__(recording, tick=TICK)
        self.stream.connect_grpc(url_of(address))

    def close(self) -> None:
        with contextlib.suppress(Exception):  # a viewer that was closed
            self.stream.flush(timeout_sec=PATIENCE)
        super().close()


def url_of(address: str) -> str:
    """The viewer's URL from an address, if it answers."""
    place = address.removeprefix("rerun+http://").removesuffix("/proxy")
    host, _, port = place.rpartition(":") if ":" in place else (place, "", str(PORT))
    try:
        with socket.create_connection((host, int(port)), PATIENCE):
            return f"rerun+http://{host}:{int(port)}/proxy"
    except (OSError, ValueError, OverflowError):
        raise OptionError(
            f"no rerun viewer listens at '{address}'; start one with 'rerun', or give its HOST:PORT"
        ) from None


class Canvas:
    """Draws into every outlet alike."""

    def __init__(self, outlets: Sequence[AbstractOutlet]):
        self._outlets = tuple(outlets)

    def at(self, step: int, seconds: float) -> None:
        """What follows belongs to this step."""
        for outlet in self._outlets:
            outlet.stream.set_time(STEP, sequence=step)
            outlet.stream.set_time(TIME, duration=seconds)

    def arrange(self, layout: rrb.Blueprint) -> None:
        """Lay out the viewer."""
        for outlet in self._outlets:
            outlet.stream.send_blueprint(layout)

    def log(self, path: str, *what: Any, static: bool = False) -> None:
        for outlet in self._outlets:
            outlet.stream.log(path, *what, static=static, strict=True)

    def clear(self, path: str) -> None:
        self.log(path, rr.Clear(recursive=True))

    def flush(self) -> None:
        for outlet in self._outlets:
            outlet.stream.flush()

    def close(self) -> None:
        for outlet in self._outlets:
            outlet.close()
