"""Break one function of the package at a time, wherever it is held: a method, decorated, cached, imported."""

import gc
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from inspect import CO_GENERATOR
from pathlib import Path
from types import CodeType, FrameType, FunctionType
from typing import Any

import workbench

PACKAGE = Path(workbench.__file__).parent


def called(run: Callable[[], object], *places: str) -> dict[str, FunctionType]:
    """Functions of these files and folders of the package that a run calls, in its threads too, by name."""
    folders = tuple(str(PACKAGE / place) for place in places)
    seen: dict[CodeType, None] = {}

    def note(frame: FrameType, event: str, _: Any) -> None:
        code = frame.f_code
        if event == "call" and code.co_filename.startswith(folders) and "<" not in code.co_qualname:
            seen[code] = None

    threading.setprofile(note)
    sys.setprofile(note)
    try:
        run()
    finally:
        sys.setprofile(None)
        threading.setprofile(None)  # type: ignore[arg-type]  # as it was
    found = {}
    gc.unfreeze()  # what is frozen is not looked through
    for code in seen:
        for holder in gc.get_referrers(code):
            if isinstance(holder, FunctionType) and holder.__code__ is code and holder.__module__:
                found[f"{holder.__module__.removeprefix('workbench.')}.{holder.__qualname__}"] = holder
    return found


@contextmanager
def broken(function: FunctionType) -> Iterator[None]:
    """Its calls raise."""
    whole = function.__code__
    free, ends = whole.co_freevars, "; yield" if whole.co_flags & CO_GENERATOR else ""
    lines = [f"    {name} = 0" for name in free] + ["    def broken(*_, **__):"]
    lines += [f"        {', '.join(['', *free]).removeprefix(', ') or '0'}"]
    lines += [f"        raise ZeroDivisionError('broken on purpose'){ends}", "    return broken"]
    made: dict[str, Any] = {}
    exec("\n".join(["def outer():", *lines]), made)
    function.__code__ = made["outer"]().__code__
    try:
        yield
    finally:
        function.__code__ = whole
