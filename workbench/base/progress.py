"""Long work tells how far it is and asks now and then whether to stop."""

from collections.abc import Callable

Progress = Callable[[float], None]
"""Is called with the share of the work done, 0 to 1."""
Report = Callable[[float, str], None]
"""Is called with the share of the work done, and with what is being done."""
Cancel = Callable[[], bool]
"""Is asked whether to stop; the work then ends with the best that it has, or raises `Cancelled`."""


class Cancelled(Exception):
    """Work stopped because it was asked to; no error, so whoever asked need not be told."""


def never() -> bool:
    """The answer of work that nobody stops."""
    return False
