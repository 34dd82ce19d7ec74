"""Callbacks by which long computations report progress and check whether to stop."""

from collections.abc import Callable

Progress = Callable[[float], None]
"""Is called with the share of the work done, 0 to 1."""
Report = Callable[[float, str], None]
"""Is called with the share of the work done, and with what is being done."""
Cancel = Callable[[], bool]
"""Is asked whether to stop; the work then ends with the best that it has, or raises `Cancelled`."""


class Cancelled(Exception):
    """Work was stopped on request; not an error, so it need not be reported."""


def checkpoint(progress: Report | None, cancel: Cancel | None) -> Report:
    """Reports progress between the steps of some work, and raises `Cancelled` once that is asked for."""

    def step(part: float, text: str) -> None:
        if cancel is not None and cancel():
            raise Cancelled
        if progress is not None:
            progress(part, text)

    return step


def part_of(report: Report, begin: float, share: float) -> Report:
    """The progress of some work that is a share of the whole and begins at this share of it."""
    return lambda part, text: report(begin + share * part, text)


def never() -> bool:
    """The default cancel callback: never stop."""
    return False
