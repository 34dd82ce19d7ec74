"""Running a function in a child process with time and memory limits; it can be cancelled.

Readers of binary formats are written in C or decompress their input: a malicious file can crash them, or
expand from a few kilobytes to all available memory. In a child process this ends the child, never the
program.
"""

import contextlib
import os
import pickle
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
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
    job = pickle.dumps((function.__module__, function.__name__, arguments, needs, seconds, memory))
    command = [sys.executable, "-c", _COMMAND.format(path=[p or os.getcwd() for p in sys.path])]
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    with tempfile.TemporaryFile() as requested, tempfile.TemporaryFile() as answer:
        requested.write(job)
        requested.seek(0)
        with subprocess.Popen(
            command, stdin=requested, stdout=answer, stderr=subprocess.DEVNULL, env=environment
        ) as child:
            try:
                _wait(child, seconds * _PATIENCE)
            finally:
                child.kill()
        answer.seek(0)
        if child.returncode == 0:
            kind, value = pickle.load(answer)
            if kind == "result":
                return value
            raise ChildError(value)
    if -child.returncode in (signal.SIGPROF, signal.SIGKILL):
        raise ChildError(f"it takes more than {seconds:.3g} s")
    raise ChildError("its content crashes the reader")


def _wait(child: subprocess.Popen, longest: float) -> None:
    for _ in range(int(longest / _POLL)):
        with contextlib.suppress(subprocess.TimeoutExpired):
            child.wait(_POLL)
            return
        check_cancelled()


def _serve() -> None:
    """The child's side: read the job, set the bounds, write the answer."""
    module, name, arguments, needs, seconds, memory = pickle.load(sys.stdin.buffer)
    function = getattr(import_module(module), name)
    try:
        if needs:
            import_module(needs)
        _bound(seconds, memory)
        content = pickle.dumps(("result", function(*arguments)))
    except ChildError as error:
        content = pickle.dumps(("error", str(error)))
    except MemoryError:
        content = pickle.dumps(("error", f"it takes more than {memory // MEBIBYTE} MiB of memory"))
    except Exception as error:  # whatever a reader raises for a broken file
        content = pickle.dumps(("error", type(error).__name__))
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
