"""Input errors: one base class, final subclasses, data as attributes.

Every message is one sentence that says what, where, and what to do. Bad input raises; a fit that does
not converge or cannot see a parameter is an `Outcome` in the result, never an exception.
"""

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
        self.expected = expected
        self.found = found


class FileError(WorkbenchError):
    """A file can't be read as the expected kind; carries the position where reading stopped."""

    def __init__(self, message: str, *, path: str, line: int | None = None, column: str | None = None):
        where = path + (f", line {line}" if line is not None else "")
        where += f", column '{column}'" if column is not None else ""
        super().__init__(f"{where}: {message}")
        self.path = path
        self.line = line
        self.column = column


class UnitError(WorkbenchError):
    """A unit is missing, unknown, or of another quantity than the column needs."""

    def __init__(self, message: str, *, unit: str):
        super().__init__(message)
        self.unit = unit


class RobotError(WorkbenchError):
    """A robot description is incomplete or contradicts itself."""


class DataError(WorkbenchError):
    """Invalid or inconsistent measurements (too few rows, impossible values, wrong robot).

    Args:
        row: The row that it is about, counted from 0, if any.
    """

    def __init__(self, message: str, *, row: int | None = None):
        super().__init__(message)
        self.row = row


class OptionError(WorkbenchError):
    """An invalid option or argument; names the valid ones."""


class MissingExtraError(WorkbenchError):
    """An optional library is needed; carries the extra that installs it."""

    def __init__(self, what: str, *, extra: str):
        super().__init__(f"{what} needs an optional library: {install_command(extra)} in the checkout")
        self.extra = extra
