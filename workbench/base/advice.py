"""What only describes a result (notes, tables, poses to measure next): if it fails, the result stays.

A warning then says what is missing; nothing that rests on it is called certain. What describes is asked for
by `ask`, or is marked `@beside`; warnings go to the innermost `failures()`, else into the log.
"""

import logging
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import wraps
from inspect import isgeneratorfunction
from typing import Any, ParamSpec, TypeVar

from workbench.base.errors import WorkbenchError
from workbench.base.progress import Cancelled

P = ParamSpec("P")
T = TypeVar("T")
U = TypeVar("U")
log = logging.getLogger(__name__)
_FAILED: ContextVar[list[str] | None] = ContextVar("failed", default=None)
is_strict = False
"""Whether a mistake of the program is raised all the same, as in its tests."""


@contextmanager
def failures() -> Iterator[list[str]]:
    """Collects a sentence about each part that fails meanwhile."""
    found = list[str]()
    token = _FAILED.set(found)
    try:
        yield found
    finally:
        _FAILED.reset(token)


def ask(what: str, adviser: Callable[[], T], otherwise: U) -> T | U:
    """What an adviser says; `otherwise` where it fails.

    Args:
        what: What it advises, as the subject of a sentence.
        adviser: Computes it.
        otherwise: What stands in its place.
    """
    try:
        return adviser()
    except (Cancelled, Warning):  # a request to stop; and Python's own, where they were made errors
        raise
    except Exception as error:
        why = f": {error}"  # of what the user gave
        if not isinstance(error, WorkbenchError):
            if is_strict:
                raise
            last = traceback.extract_tb(error.__traceback__)[-1]
            why = f" ({type(error).__name__} in {last.name}, line {last.lineno}: {error})"
        sentence, found = f"{what} could not be computed{why}; the result omits it", _FAILED.get()
        if found is None:
            log.warning(sentence)
        elif sentence not in found:
            found.append(sentence)
        return otherwise


def beside(what: str, otherwise: Any) -> Callable[[Callable[P, T]], Callable[P, T]]:
    """Marks a function that only describes a result: where it fails, `otherwise` stands in its place.

    Args:
        what: What it describes, as the subject of a sentence.
        otherwise: Of the kind that the function returns; for a generator what it yields, as a tuple.
    """

    def mark(function: Callable[P, T]) -> Callable[P, T]:
        whole: Any = list if isgeneratorfunction(function) else lambda found: found

        @wraps(function)
        def asked(*args: P.args, **kwargs: P.kwargs) -> Any:
            return ask(what, lambda: whole(function(*args, **kwargs)), otherwise)

        return asked

    return mark
