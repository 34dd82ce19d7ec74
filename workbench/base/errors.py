"""Input errors: one base class, final subclasses, data as attributes.

Every message is one sentence that says what, where, and what to do. Bad input raises; a fit that does
not converge or cannot see a parameter is an `Outcome` in the result, never an exception.
"""

import csv
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from workbench.base.installed_package import install_command
from workbench.base.wording import brief

INTERRUPTED, STOPPED = 130, "stopped"
"""Exit status after Ctrl-C, and what is said then."""


class WorkbenchError(Exception):
    """Base of all errors that a user can cause and fix; long quotations from files are shortened."""

    def __init__(self, message: str):
        super().__init__(brief(message))


class ShapeError(WorkbenchError):
    """An array's shape does not match the robot or the other arrays."""

    def __init__(self, message: str, *, expected: int, found: int):
        super().__init__(message)
        self.expected, self.found = expected, found


class FileError(WorkbenchError):
    """A file can't be read as the expected kind; carries the position where reading stopped."""

    def __init__(self, message: str, *, path: str, line: int | None = None, column: str | None = None):
        where = path + (f", line {line}" if line is not None else "")
        where += f", column '{column}'" if column is not None else ""
        super().__init__(f"{where}: {message}")
        self.path, self.line, self.column = path, line, column


class UnitError(WorkbenchError):
    """A unit is missing, unknown, or of another quantity than the column needs."""

    def __init__(self, message: str, *, unit: str):
        super().__init__(message)
        self.unit = unit


class RobotError(WorkbenchError):
    """A robot description is incomplete or contradicts itself.

    Args:
        found: What is wrong in it, such as the name of a joint, an effect or a constant.
    """

    def __init__(self, message: str, *, found: Any = None):
        super().__init__(message)
        self.found = found


class DataError(WorkbenchError):
    """Invalid or inconsistent measurements (too few rows, impossible values, wrong robot).

    Args:
        row: The row that it is about, counted from 0, if any.
        joint: The joint, counted from 0, if any.
        target: The target of a plate, counted from 0, if any.
        column: The column or key; empty if it is about none.
        found: What was found there, or how many.
    """

    def __init__(
        self,
        message: str,
        *,
        row: int | None = None,
        joint: int | None = None,
        target: int | None = None,
        column: str = "",
        found: Any = None,
    ):
        super().__init__(message)
        self.row, self.joint, self.target = row, joint, target
        self.column, self.found = column, found


class OptionError(WorkbenchError):
    """An invalid option or argument; names the valid ones.

    Args:
        option: Its name, of an argument or of a command's option; empty where several conflict.
        found: What was given.
    """

    def __init__(self, message: str, *, option: str = "", found: Any = None):
        super().__init__(message)
        self.option, self.found = option, found


MALFORMED = (ValueError, LookupError, TypeError, AttributeError, ArithmeticError, RecursionError, csv.Error)
"""What a reader may stumble over in a damaged file, however it reads it."""


@contextmanager
def understood(what: str, path: str) -> Iterator[None]:
    """Whatever a reader stumbles over in a stranger's file is one sentence.

    Args:
        what: What it was to be, such as `a joint table`.
    """
    try:
        yield
    except MALFORMED as error:
        raise FileError(f"can't be read as {what} ({type(error).__name__}: {error})", path=path) from error


class MissingExtraError(WorkbenchError):
    """An optional library is needed; carries the extra that installs it."""

    def __init__(self, what: str, *, extra: str):
        super().__init__(f"{what} needs an optional library: {install_command(extra)} in the checkout")
        self.extra = extra
