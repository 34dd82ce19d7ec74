"""What a long computation reports, and whether it is asked to stop: known to everything that runs within it.

    with running(show, stop.is_set):
        identify(arm, data)

The code in between calls `progress`, `cancelled` and `check_cancelled`; outside of `running` they do nothing.
Other threads and processes don't inherit it: work that is handed to them is asked about between its pieces.
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from typing import NamedTuple

Report = Callable[[float, str], None]
"""Is called with the share of the work done, 0 to 1, and with what is being done."""
Hear = Callable[[Mapping[str, float]], None]
Cancel = Callable[[], bool]
"""Is asked whether to stop; the work then ends with the best that it has, or raises `Cancelled`."""


class Cancelled(Exception):
    """Work was stopped on request; not an error, so it need not be reported."""


class _Running(NamedTuple):
    show: Report
    cancel: Cancel
    hear: Hear = lambda sizes: None


_UNSEEN = _Running(lambda share, text: None, lambda: False)
_RUN = ContextVar[_Running]("_RUN")


@contextmanager
def running(
    show: Report | None = None, cancel: Cancel | None = None, *, hear: Hear | None = None
) -> Iterator[None]:
    """Show the progress of the work within, and end it on request.

    Args:
        show: Called with the share of the work done and with what is being done; by default nothing
            is shown, whatever the work around it shows.
        cancel: Asked often; once it says True, the work ends with what it has or raises `Cancelled`.
        hear: Told what the work suspects long before its end; who hears the work around it if None.
    """
    token = _RUN.set(_Running(show or _UNSEEN.show, cancel or _UNSEEN.cancel, hear or _RUN.get(_UNSEEN).hear))
    try:
        yield
    finally:
        _RUN.reset(token)


@contextmanager
def part_of(begin: float, share: float, text: str = "") -> Iterator[None]:
    """Work that is a share of the whole and begins at a share of it; its text stands in place of the own."""
    outer = _RUN.get(_UNSEEN)
    with running(lambda done, own: outer.show(begin + share * done, text or own), outer.cancel):
        yield


@contextmanager
def whole_or_nothing() -> Iterator[None]:
    """Work that has nothing to give before its end: once it is asked to stop, its next report raises."""
    outer = _RUN.get(_UNSEEN)

    def show(share: float, text: str) -> None:
        check_cancelled()
        outer.show(share, text)

    with running(show, outer.cancel):
        yield


def progress(share: float, text: str) -> None:
    """Report the share of the work done, and what is being done."""
    _RUN.get(_UNSEEN).show(share, text)


def suspected(sizes: Mapping[str, float]) -> None:
    """Report what may be found, by name, and how much speaks for each."""
    _RUN.get(_UNSEEN).hear(sizes)


def cancelled() -> bool:
    """Whether the work is asked to stop."""
    return _RUN.get(_UNSEEN).cancel()


def check_cancelled() -> None:
    """Raise `Cancelled` once the work is asked to stop."""
    if cancelled():
        raise Cancelled
