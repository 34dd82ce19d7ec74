"""The files that a command writes: none is an input too, and every command's result goes where `--json` says.

A command calls `write_result` with its fields; one that never does, such as another package's, gives what it
said in words. What is refused is called as it was typed: an argument's option is the one of its name.
"""

import os
import sys
from collections.abc import Callable, Mapping
from contextvars import ContextVar
from copy import copy
from pathlib import Path
from typing import Annotated, Any

import typer

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


def with_json(command: Any, group: str) -> Any:
    """A command with the option that every command has, unless it has its own; by its group's name."""
    if any("--json" in option.opts for option in command.params):
        return command

    def whole(**options: Any) -> None:
        try:
            command.callback(**options)
        except OptionError as error:
            raise _as_typed(error, {param.name: param.opts[0] for param in command.params}) from error
        if _RESULT.get() is not None:
            name = "-".join(filter(None, (group, command.name)))
            write_result({"schema": f"workbench.{name}/1", "said": [*_SAID]})

    alone, more = typer.Typer(add_completion=False), copy(command)
    alone.command()(_options_of_all)
    more.callback, more.params = whole, [*command.params, *typer.main.get_command(alone).params]
    return more


def _as_typed(error: OptionError, names: Mapping[str, str]) -> OptionError:
    """A refusal that begins with the option that was typed for an argument, if there is one."""
    name, text = names.get(error.option, ""), str(error)
    if name.startswith("-") and name not in text:
        text = name + (f": {text}" if (rest := text.removeprefix(error.option)) == text else rest)
    return OptionError(text, option=error.option, found=error.found)


def _ask(path: Path | None) -> None:
    _RESULT.set(None)
    _SAID.clear()
    check_writable(path)
    _RESULT.set(path)


def _options_of_all(
    json: Annotated[
        Path | None,
        typer.Option(
            "--json", help="Write the result here, machine-readable.", callback=_ask, expose_value=False
        ),
    ] = None,
) -> None: ...
