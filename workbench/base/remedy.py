"""Remedies in the words of the entrance: an option of the command line, or a place on the page.

Where a fault is found nobody knows who will read of it. So whoever lets users in says by which entrance they
come, for all that is computed for them in its thread; Python has the words of the command line.
"""

from contextvars import ContextVar

_IS_PAGE: ContextVar[bool] = ContextVar("is_page", default=False)


def speak_to_page() -> None:
    """All that this thread computes from here on is read on the page."""
    _IS_PAGE.set(True)


def remedy(command: str, *, page: str) -> str:
    """What helps, as it is called where the user is."""
    return page if _IS_PAGE.get() else command
