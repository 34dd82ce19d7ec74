"""Limit linear algebra to one thread during computations and sessions, and run large work in pieces on two.

Our matrices are small: with a second thread for each of them a fit takes 5 to 15 times as long. The limit
belongs to the process, so that calls in several threads share one: the first sets it, the last lifts it.
Newer versions of threadpoolctl obey the first thread that sets a limit, as long as it lives, and silently
ignore all others: a task after a fit in the main thread would have no limit, and vice versa. Therefore no
thread keeps that ownership.
"""

import sys
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from functools import lru_cache
from typing import TypeVar

from threadpoolctl import OpenBLASController, ThreadpoolController

Item = TypeVar("Item")
Result = TypeVar("Result")

PIECES_AT_ONCE = 2
"""Pieces that are worked on at once: nearly every machine has so many processors, and memory is spared."""


class _Limit:
    """The limit of this process, and how many calls want it now."""

    def __init__(self):
        self._lock, self._calls, self._limits = threading.Lock(), 0, None

    def count(self, more: int) -> None:
        """One call more, of which the first sets the limit, or one less, of which the last lifts it."""
        with self._lock:
            self._calls += more
            with _any_thread():
                if self._calls == 0 and self._limits is not None:
                    self._limits = self._limits.restore_original_limits()
                elif self._limits is None:
                    self._limits = _libraries(len(sys.modules)).limit(limits=1, user_api="blas")


@lru_cache(maxsize=1)
def _libraries(modules: int) -> ThreadpoolController:
    """The libraries of this process, looked for again after imports only: it takes as long as a small fit."""
    return ThreadpoolController()


@contextmanager
def _any_thread() -> Iterator[None]:
    """This thread may change the limit, and afterwards any other."""
    free = getattr(OpenBLASController, "clear_controlling_thread", lambda *, force: None)  # not in older
    free(force=True)
    try:
        yield
    finally:
        free(force=True)


_LIMIT = _Limit()
_POOL = ThreadPoolExecutor(PIECES_AT_ONCE, thread_name_prefix="piece of work")  # one for all calls


@contextmanager
def one_thread() -> Iterator[None]:
    """One thread of linear algebra inside the block; `@one_thread()` does the same to a function."""
    _LIMIT.count(1)
    try:
        yield
    finally:
        _LIMIT.count(-1)


def in_order(function: Callable[[Item], Result], pieces: Sequence[Item]) -> Iterator[Result]:
    """Results of a function for every piece, in their order; the next ones are made while one is used.

    Args:
        function: May run in another thread; worth it where it spends its time in numpy or compiled code.
        pieces: A single one, or those of a piece itself, are done at once, here.
    """
    if len(pieces) < 2 or threading.current_thread().name.startswith("piece of work"):
        yield from map(function, pieces)
        return
    under_way: deque[Future[Result]] = deque()
    for piece in pieces:
        under_way.append(_POOL.submit(function, piece))
        if len(under_way) > PIECES_AT_ONCE:
            yield under_way.popleft().result()
    while under_way:
        yield under_way.popleft().result()
