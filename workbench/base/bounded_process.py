"""Running a function in a child process with time and memory limits; it can be cancelled.

Readers of binary formats are written in C or decompress their input: a malicious file can crash them, or
expand from a few kilobytes to all available memory. In a child process this ends the child, never the
program.
"""

import os
import pickle
import signal
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from subprocess import DEVNULL, PIPE, Popen, TimeoutExpired
from tempfile import TemporaryFile
from typing import Any

from workbench.base.errors import WorkbenchError
from workbench.base.progress import check_cancelled

MEBIBYTE = 2**20
_POLL = 0.05
"""Time between two questions whether to stop [s]."""
_PATIENCE = 10.0
"""Time on the clock for each second of the processor's: the machine may have other work."""
_COMMAND = "import sys; sys.path[:] = {path!r}; from workbench.base.bounded_process import _serve; _serve()"


class ChildError(WorkbenchError):
    """The function ended without a result; the message says why, in a few words.

    The function itself may raise it.
    """


def in_child(
    function: Callable[..., Any],
    *arguments: Any,
    needs: str = "",
    seconds: float = 10.0,
    memory: int = 500 * MEBIBYTE,
) -> Any:
    """The result of a function, computed in a child process.

    Args:
        function: Found by its module and name; its module should import little.
        arguments: What pickle can carry, like the result.
        needs: A module that it imports, which no bound counts.
        seconds: Time of the processor that it may take beyond its imports.
        memory: Memory that it may take beyond its imports [bytes].
    """
    command = [sys.executable, "-c", _COMMAND.format(path=[p or os.getcwd() for p in sys.path])]
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    with TemporaryFile() as job:  # a pipe holds little, and what is asked with patience sends no more
        pickle.dump((function, arguments, needs, seconds, memory), job)
        job.seek(0)
        with Popen(command, stdin=job, stdout=PIPE, stderr=DEVNULL, env=environment) as child:
            try:
                answer = _answer(child, seconds * _PATIENCE)
            finally:
                child.kill()
    if -child.returncode in (signal.SIGPROF, signal.SIGKILL):
        raise ChildError(f"it takes more than {seconds:.3g} s")
    found = pickle.loads(answer) if child.returncode == 0 else ChildError("its content crashes the reader")
    if isinstance(found, ChildError):
        raise found
    return found


def _answer(child: Popen[bytes], longest: float) -> bytes:
    """What a child answers; nothing if that takes too long."""
    for _ in range(int(longest / _POLL)):
        try:
            return child.communicate(timeout=_POLL)[0]
        except TimeoutExpired:
            check_cancelled()
    return b""


def _serve() -> None:
    """The child's side: read the job, set the bounds, write the answer."""
    function, arguments, needs, seconds, memory = pickle.load(sys.stdin.buffer)
    try:
        if needs:
            import_module(needs)
        _bound(seconds, memory)
        content = pickle.dumps(function(*arguments))
    except ChildError as error:
        content = pickle.dumps(error)
    except MemoryError:
        content = pickle.dumps(ChildError(f"it takes more than {memory // MEBIBYTE} MiB of memory"))
    except Exception as error:  # whatever a reader raises for a broken file
        content = pickle.dumps(ChildError(type(error).__name__))
    sys.stdout.buffer.write(content)
    sys.stdout.buffer.flush()
    os._exit(0)  # libraries that were broken by a file are not asked to tidy up


def _bound(seconds: float, memory: int) -> None:
    import resource

    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        pages = int(Path("/proc/self/statm").read_text().split()[0])
    except OSError:  # systems that don't tell, and don't keep the bound either
        return
    maximum = pages * resource.getpagesize() + memory
    resource.setrlimit(resource.RLIMIT_AS, (maximum, maximum))
