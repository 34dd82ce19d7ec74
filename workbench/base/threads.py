"""One thread of linear algebra while we compute.

Our matrices are small: with a second thread for each of them a fit takes 5 to 15 times as long. The limit
belongs to the process, so that calls in several threads share one: the first sets it, the last lifts it.
"""

import threading
from collections.abc import Iterator
from contextlib import contextmanager

from threadpoolctl import threadpool_limits


class _Limit:
    """The limit of this process, and how many calls want it now."""

    def __init__(self):
        self._lock = threading.Lock()
        self._calls = 0
        self._limits = None

    def enter(self) -> None:
        with self._lock:
            if self._calls == 0:
                self._limits = threadpool_limits(1, user_api="blas")
            self._calls += 1

    def leave(self) -> None:
        with self._lock:
            self._calls -= 1
            if self._calls == 0 and self._limits is not None:
                self._limits.restore_original_limits()
                self._limits = None


_LIMIT = _Limit()


@contextmanager
def one_thread() -> Iterator[None]:
    """One thread of linear algebra inside the block; `@one_thread()` does the same to a function."""
    _LIMIT.enter()
    try:
        yield
    finally:
        _LIMIT.leave()
