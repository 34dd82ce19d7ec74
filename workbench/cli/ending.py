"""How a command ends: one sentence on standard error, and an exit status that scripts can trust.

0 is success and 1 a mistake that a user can mend, or a disk that is full; 2 a result that is no good one,
or words that are no command; 130 Ctrl-C. A reader that closes the pipe, such as `head`, is no mistake.
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
"""What one wants from commands, in the order of the help."""


class Commands(typer.core.TyperGroup):
    """Commands under what one wants from them, each with its whole first sentence.

    What they raise comes out as it is, while typer would end some of it without a word.
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
        """Typer's, where the help is shown."""
        with _past_typer():
            return super().make_context(*words, **options)

    def invoke(self, ctx: Any) -> Any:
        """Typer's, where a command is carried out."""
        with _past_typer():
            return super().invoke(ctx)


def group(name: str, help: str) -> typer.Typer:
    """Commands that are called by two words."""
    return typer.Typer(name=name, help=help, no_args_is_help=True, cls=Commands)


@contextlib.contextmanager
def _past_typer() -> Iterator[None]:
    try:
        yield
    except (KeyboardInterrupt, OSError) as error:
        raise _Raised(error) from None


class _Raised(Exception):
    """Carries what was raised past typer."""

    def __init__(self, error: BaseException):
        self.error = error


def run(command: Callable[[Sequence[str]], None], words: Sequence[str]) -> int:
    """The exit status of a command for its words; what goes wrong is said.

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
    """Let what can't be written go, so that it is not tried again at the end."""
    with contextlib.suppress(OSError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, 1)
        os.close(nowhere)


def _messages_to_stderr(words: Sequence[str]) -> contextlib.AbstractContextManager:
    """Words go to standard error where a result goes to standard output."""
    given = {part for word in words for part in (word, word.partition("=")[2])}
    return (
        contextlib.redirect_stdout(sys.stderr) if given & set(STANDARD_OUTPUT) else contextlib.nullcontext()
    )
