"""Items and sinks: change detection, in one place for every view and subject."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from workbench.parts import warn_of_broken


@dataclass(frozen=True, eq=False)
class Item:
    """Something to draw, rebuilt only if its inputs have changed.

    Args:
        path: Its name among all that is drawn.
        make: Makes the drawable from the inputs, and from nothing else; None where there is nothing to see.
        inputs: Compared one by one, see `is_same`.
        shown: Whether it is shown now.
        can_wait: Whether an older picture will do for now, as in the middle of a drag.
    """

    path: str
    make: Callable[..., Any]
    inputs: tuple[Any, ...]
    shown: bool = True
    can_wait: bool = False


def is_same(a: Any, b: Any) -> bool:
    """Whether two inputs are one object, or equal arrays or plain values."""
    if a is b:
        return True
    if isinstance(a, np.ndarray):
        return isinstance(b, np.ndarray) and a.shape == b.shape and a.tobytes() == b.tobytes()
    return isinstance(a, str | int | float | tuple | frozenset) and a == b


def differences(old: Any, new: Any) -> set[str]:
    """Names of the fields in which two drawables of a kind differ."""
    return {f.name for f in fields(new) if not is_same(getattr(old, f.name), getattr(new, f.name))}


class AbstractSink(ABC):
    """Where items are drawn: keeps what is there, and sends what has changed."""

    def __init__(self) -> None:
        self._drawn: dict[str, tuple[Item, Any]] = {}
        self._hidden: set[str] = set()

    def draw(self, items: Iterable[Item]) -> None:
        """Draw these items and no others."""
        gone = self._drawn.keys() - {self._put(item) for item in items}
        for path in sorted(gone, reverse=True):  # what lies below a path goes before it
            if self._drawn.pop(path)[1] is not None:
                self.remove(path)
            self._hidden.discard(path)

    def update(self, items: Iterable[Item]) -> None:
        """Draw these items, and leave all others as they are."""
        for item in items:
            self._put(item)

    def _put(self, item: Item) -> str:
        before, old = self._drawn.get(item.path, (None, None))
        is_unchanged = before is not None and all(map(is_same, before.inputs, item.inputs))
        if is_unchanged or self.puts_off(item):
            if old is not None and item.shown is (item.path in self._hidden):
                self._hidden ^= {item.path}
                self.show(item.path, old, is_shown=item.shown)
            return item.path
        new = self._changed(item, old)
        if new is None and old is not None:
            self.remove(item.path)
        self._hidden.discard(item.path)
        self._drawn[item.path] = item, new
        return item.path

    def _changed(self, item: Item, old: Any) -> Any:
        """What is drawn at an item's path now; None if there is nothing to see, or if it can't be drawn."""
        try:
            if (new := item.make(*item.inputs)) is not None:
                self.change(item, old, new)
        except Exception as error:  # whatever is wrong with somebody else's package
            warn_of_broken(f"the drawable {item.path}", error)
            return None
        return new

    @abstractmethod
    def puts_off(self, item: Item) -> bool:
        """Whether drawing a changed item is deferred, keeping its older picture, if any."""

    @abstractmethod
    def show(self, path: str, drawn: Any, *, is_shown: bool) -> None:
        """Show or hide what is drawn already."""

    @abstractmethod
    def change(self, item: Item, old: Any, new: Any) -> None:
        """Draw an item over what is drawn there, if anything is, hidden or not."""

    @abstractmethod
    def remove(self, path: str) -> None:
        """Take away what is drawn at a path, if anything is."""
