"""How a command ends: one sentence on standard error, and a reliable exit status for scripts.

0 is success, 1 an error that the user can fix or a full disk, 2 an unreliable result or an invalid command
line, 130 Ctrl-C. A reader that closes the pipe, such as `head`, is not an error.
"""

import contextlib
import io
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import typer
import typer.core

from workbench.base.errors import INTERRUPTED, STOPPED, WorkbenchError
from workbench.base.files import STANDARD_OUTPUT
from workbench.base.wording import brief

SECTIONS = ("Start", "Calibrate", "Plates", "Paths", "Files")
"""Purposes of commands, in the order of the help."""


class Commands(typer.core.TyperGroup):
    """Commands grouped by purpose, each with its complete first sentence.

    Exceptions propagate unchanged, while typer would swallow some of them silently.
    """

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """One section for every `rich_help_panel`."""
        commands = [command for name in self.list_commands(ctx) if (command := self.get_command(ctx, name))]
        longest = max(len(str(command.name)) for command in commands)
        sections: dict[str, list[tuple[str, str]]] = {title: [] for title in SECTIONS}
        for command in commands:
            row = (f"{command.name:<{longest}}", command.get_short_help_str(limit=1000))
            sections.setdefault(getattr(command, "rich_help_panel", None) or "Commands", []).append(row)
        for title, rows in (entry for entry in sections.items() if entry[1]):
            with formatter.section(title):
                formatter.write_dl(rows)

    def make_context(self, *words: Any, **options: Any) -> Any:
        """Typer's context, created where the help is shown."""
        with _past_typer():
            return super().make_context(*words, **options)

    def invoke(self, ctx: Any) -> Any:
        """Typer's invocation of a command."""
        with _past_typer():
            return super().invoke(ctx)


def group(name: str, help: str) -> typer.Typer:
    """A group of two-word commands."""
    return typer.Typer(name=name, help=help, no_args_is_help=True, cls=Commands)


@contextlib.contextmanager
def _past_typer() -> Iterator[None]:
    try:
        yield
    except (KeyboardInterrupt, OSError) as error:
        raise _Raised(error) from None


class _Raised(Exception):
    """Carries an exception past typer."""

    def __init__(self, error: BaseException):
        self.error = error


def run(command: Callable[[Sequence[str]], None], words: Sequence[str]) -> int:
    """Run a command, print what goes wrong, and return its exit status.

    Args:
        command: Carries the words out; may raise anything, or `SystemExit`.
        words: Those after the program's name.
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # a locale that lacks our letters
    try:
        with _messages_to_stderr(words):
            try:
                command(words)
            except _Raised as raised:
                raise raised.error from None
            sys.stdout.flush()
    except SystemExit as ended:
        return _flush(ended.code if isinstance(ended.code, int) else int(bool(ended.code)))
    except BrokenPipeError:
        _discard_output()
        return 0
    except (KeyboardInterrupt, Exception) as error:
        status, sentence = _status_and_sentence(error)
        return _flush(status, sentence)
    return 0


def _status_and_sentence(error: BaseException) -> tuple[int, str]:
    """Exit status and sentence of what was raised; a bug is raised again."""
    if isinstance(error, KeyboardInterrupt):
        return INTERRUPTED, STOPPED
    if isinstance(error, WorkbenchError):
        return 1, str(error)
    if isinstance(error, MemoryError):
        return 1, "there is not enough memory for this; give fewer rows, targets or poses"
    if isinstance(error, RecursionError):
        return 1, "the input has too many levels within each other; make it flatter"
    if isinstance(error, OSError):
        where = f"{error.filename}: " if error.filename else ""
        return 1, brief(f"{where}{error.strerror or error}; make room, or choose another place")
    raise error


def _flush(status: int, sentence: str = "") -> int:
    """The status, once all output is out; 1 if that fails."""
    try:
        if sentence:
            print(f"workbench: {sentence}", file=sys.stderr)
        sys.stdout.flush()
    except BrokenPipeError:
        _discard_output()
    except OSError as error:
        _discard_output()
        with contextlib.suppress(OSError):
            print(f"workbench: the output can't be written ({error.strerror})", file=sys.stderr)
        return status or 1
    return status


def _discard_output() -> None:
    """Discard output that can't be written, so that it is not tried again at exit."""
    with contextlib.suppress(OSError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, 1)
        os.close(nowhere)


def _messages_to_stderr(words: Sequence[str]) -> contextlib.AbstractContextManager:
    """Send messages to standard error if a result goes to standard output."""
    given = {part for word in words for part in (word, word.partition("=")[2])}
    return (
        contextlib.redirect_stdout(sys.stderr) if given & set(STANDARD_OUTPUT) else contextlib.nullcontext()
    )
