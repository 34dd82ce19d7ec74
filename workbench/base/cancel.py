"""Work that can be stopped asks `cancel` now and then; where it says so, the work raises `Cancelled`."""

from collections.abc import Callable

Cancel = Callable[[], bool]


class Cancelled(Exception):
    """Work stopped because it was asked to; no error, so whoever asked need not be told."""


def never() -> bool:
    """The answer of work that nobody stops."""
    return False
