"""The files that a command writes: none is an input too, and every command's result goes where `--json` says.

A command calls `write_result` with its fields; one that never does, such as another package's, gives what it
said in words. What is refused is called as it was typed: an argument's option is the one of its name.
"""

import os
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Any

from workbench.base.errors import OptionError
from workbench.base.wording import readable

_RESULT: ContextVar[Path | None] = ContextVar("where the running command's result is written", default=None)
_SAID: list[str] = []
"""What it has said before its result was written."""


def say(text: str) -> None:
    if _RESULT.get() is not None:
        _SAID.append(readable(text))
    print(readable(text), flush=True)


def check_writable(*files: Path | None, robot: Path | None = None, folder: Path | None = None) -> None:
    """Refuse an output that can't be written, or whose file is an input or another output as well, and a
    robot's whose ending is that of no robot file."""
    from workbench.arm.built_in_arms import check_robot_file
    from workbench.base.files import check_writable

    files = (*files, robot if robot is None else check_robot_file(robot))
    named = [path for path in (*files, _RESULT.get()) if path is not None]
    given, out = ([*map(os.path.realpath, each)] for each in (sys.argv[1:], named))
    for path in filter(None, files):
        check_writable(path)
        real = os.path.realpath(path)
        if (path.is_file() and given.count(real) > 1) or out.count(real) > 1:
            raise OptionError(f"{path} is named twice: what is written needs a file of its own")
        if not path.parent.exists():
            say(f"note: the folder {path.parent} does not exist and will be created")
    if folder is not None:
        check_writable(folder, folder=True)


def write_result(content: Mapping[str, Any] | Callable[[], Mapping[str, Any]]) -> None:
    """Write the command's result to the file given by `--json`, if any; a function is called only then."""
    from workbench.report.json import write_json

    if (path := _RESULT.get()) is not None:
        _RESULT.set(None)
        say(f"result: {write_json(path, dict(content() if callable(content) else content))}")


@contextmanager
def result_at(path: Path | None, schema: str) -> Iterator[None]:
    """Where a command's result is written, if anywhere: what it says, unless it writes another."""
    _RESULT.set(None)
    _SAID.clear()
    check_writable(path)
    _RESULT.set(path)
    yield
    write_result({"schema": schema, "said": [*_SAID]})


def as_typed(error: OptionError, names: Mapping[str, str]) -> OptionError:
    """A refusal that begins with the option that was typed for an argument, if there is one."""
    name, text = names.get(error.option, ""), str(error)
    if name.startswith("-") and name not in text:
        text = name + (f": {text}" if (rest := text.removeprefix(error.option)) == text else rest)
    return OptionError(text, option=error.option, found=error.found)
