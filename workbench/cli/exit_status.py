"""How a command ends: its output, one sentence for any error, and a reliable exit status.

0: the result may be used. 2: there is a result that should not be used as it is. 1: no result. 64: wrong
usage. 130: Ctrl-C. With any but 0 comes a sentence on standard error that says why.

A reader that closes the pipe, such as `head`, is not an error: the command goes on and writes its files.
"""

import contextlib
import io
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from typing import Any, TypeVar

import typer
import typer.core

from workbench.base.errors import INTERRUPTED, STOPPED, OptionError, WorkbenchError
from workbench.base.files import STANDARD_OUTPUT, standard_output_last
from workbench.base.wording import brief, readable
from workbench.cli.option_records import as_called, made
from workbench.parts import offered, resolved, warn_of_broken

Command = TypeVar("Command", bound=Callable[..., Any])
PROGRAM = "workbench"
NO_RESULT, UNUSABLE, WRONG_USAGE = 1, 2, 64
UsageError: Any = typer.BadParameter.__base__
"""typer's usage errors: an unknown command or option, a missing or malformed value."""
SECTIONS = ("Start", "Calibrate", "Plates", "Paths", "Files")
"""Purposes of commands, in the order of the help."""


class Commands(typer.core.TyperGroup):
    """Commands grouped by purpose, each with its complete first sentence.

    Those of extras and other packages are added where an unknown one is called, or all are listed: finding
    them takes 20 ms. A name of two words belongs to the group of the first.
    """

    @cached_property
    def whole(self) -> "Commands":
        """The group with the commands of others."""
        own = "" if self.name == PROGRAM else self.name
        for name, part, origin in offered("commands"):
            group, _, short = name.rpartition(" ")
            try:
                if group == own and short in self.commands:
                    raise OptionError(f"'{name}' is known already")
                if not own and group and group not in self.commands:
                    raise OptionError(f"there is no group '{group}'")
                if group == own:
                    self.commands[short] = made(resolved(part), short)
            except (Exception, SystemExit) as error:  # whatever is wrong with somebody else's package
                warn_of_broken(f"the command '{name}' of {origin}", error)
        return self

    def list_commands(self, ctx: Any) -> list[str]:
        return list(self.whole.commands)

    def get_command(self, ctx: Any, name: str) -> Any:
        return self.commands.get(name) or self.whole.commands.get(name)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """One section for every `rich_help_panel`."""
        commands = [self.commands[name] for name in self.list_commands(ctx)]
        longest = max(len(str(command.name)) for command in commands)
        sections: dict[str, list[tuple[str, str]]] = {title: [] for title in SECTIONS}
        for command in commands:
            row = (f"{command.name:<{longest}}", command.get_short_help_str(limit=1000))
            sections.setdefault(getattr(command, "rich_help_panel", None) or "Commands", []).append(row)
        for title, rows in (entry for entry in sections.items() if entry[1]):
            with formatter.section(title):
                formatter.write_dl(rows)

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """The called command, with `--json` and the options that other packages add to it."""
        name, command, rest = super().resolve_command(ctx, args)
        if not isinstance(command, typer.core.TyperGroup):
            command = as_called(command, "" if ctx.parent is None else ctx.info_name)
        return name, command, rest


def group(name: str, help: str, *, section: str | None = None) -> typer.Typer:
    """A group of two-word commands; in another package with one of `SECTIONS`, where the help lists it."""
    own: dict[str, Any] = {"rich_help_panel": section, "rich_markup_mode": None}
    return typer.Typer(name=name, help=help, no_args_is_help=True, cls=Commands, **own)


def in_section(title: str) -> Callable[[Command], Command]:
    """Decorator for another package's command: the one of `SECTIONS` where the help lists it."""

    def mark(command: Command) -> Command:
        vars(command)["rich_help_panel"] = title
        return command

    return mark


class Unusable(Exception):
    """There is a result that should not be used as it is; the message says why."""


class _Output:
    """Standard output whose reader may go away, as `head` does: a command still writes all its files."""

    def __init__(self, stream: Any):
        self._stream = stream

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        with _unread():
            self._stream.write(text)
        return len(text)

    def flush(self) -> None:
        with _unread():
            self._stream.flush()


@contextlib.contextmanager
def _unread() -> Iterator[None]:
    """Discard output that nobody reads."""
    try:
        yield
    except BrokenPipeError:
        _discard_output()


def run(command: Callable[[Sequence[str]], int | None], arguments: Sequence[str]) -> int:
    """Run a command, print errors, and return its exit status.

    Args:
        command: Runs the arguments; may raise anything, or `SystemExit`.
        arguments: Arguments after the program's name.
    """
    for name in ("stdout", "stderr"):
        if (stream := getattr(sys, name)) is None:  # it was already closed
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115
        elif isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # a locale that can't encode our characters
    status, sentence = 0, ""
    given = {part for word in arguments for part in (word, word.partition("=")[2])}
    is_taken = bool(given & set(STANDARD_OUTPUT))  # by a result: messages go to standard error
    said = contextlib.redirect_stdout(sys.stderr) if is_taken else contextlib.nullcontext()
    with said, standard_output_last() as contents:
        try:
            with contextlib.redirect_stdout(_Output(sys.stdout)):  # type: ignore[type-var]
                ended = command(arguments)
                status = ended if isinstance(ended, int) else 0
                sys.stdout.flush()
            for write in contents:
                with _unread():
                    write()
        except SystemExit as ended:
            status = ended.code if isinstance(ended.code, int) else int(bool(ended.code))
        except (KeyboardInterrupt, Exception) as error:
            status, sentence = _status_and_sentence(error)
            if isinstance(error, OSError):
                _discard_output()
    if sentence:
        with contextlib.suppress(OSError):
            print(f"workbench: {readable(sentence)}", file=sys.stderr)
    return status


def _status_and_sentence(error: Any) -> tuple[int, str]:
    """Exit status and sentence for an exception; a bug is raised again."""
    if isinstance(error, typer.Abort):  # so typer calls what stopped it
        error = error.__cause__ or KeyboardInterrupt()
    if isinstance(error, UsageError):
        if "extra argument" in error.message and "data" in [p.name for p in error.ctx.command.params]:
            from workbench.data.readers.file_kind import ONE_TABLE

            error.message += f"; {ONE_TABLE}"
        error.show()
        return WRONG_USAGE, ""
    if isinstance(error, KeyboardInterrupt):
        return INTERRUPTED, STOPPED
    if isinstance(error, Unusable):
        return UNUSABLE, str(error)
    if isinstance(error, WorkbenchError):
        return WRONG_USAGE if isinstance(error, OptionError) else NO_RESULT, str(error)
    if isinstance(error, MemoryError):
        return NO_RESULT, "out of memory; give fewer rows, targets or poses"
    if isinstance(error, RecursionError):
        return NO_RESULT, "the input is nested too deeply; flatten it"
    if isinstance(error, OSError):
        where = f"{error.filename}: " if error.filename else ""
        return NO_RESULT, brief(f"{where}{error.strerror or error}; make room, or choose another place")
    raise error


def _discard_output() -> None:
    """Discard output that can't be written, so that Python doesn't try again at exit."""
    with contextlib.suppress(OSError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, 1)
        os.close(nowhere)
