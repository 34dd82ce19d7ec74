"""Extensible registries: parts by their names in files, in order.

A part from another package is added without editing this one. Its module calls

    from workbench.arm.effects import EFFECTS

    @EFFECTS.register
    @dataclass(frozen=True)
    class GearSag(AbstractEffect): …

and is imported before it is used; or its package names it as an entry point, so that commands know it too:

    [project.entry-points."workbench.effects"]
    gear-sag = "my_package.gear_sag:GearSag"

A class can be registered everywhere: a registry of objects makes one of it, without arguments. A part that is
registered again (a notebook cell that runs twice) replaces itself; another one can't have its name.
"""

import warnings
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from inspect import isabstract
from threading import RLock
from typing import Any, TypeVar, final

from workbench.base.errors import OptionError
from workbench.base.part_checks import attribute_mistake, place_of, stops

BUILT_IN, BY_HAND = "built in", "by hand"
Part = TypeVar("Part")
Added = TypeVar("Added")


@cache
def _entry_points() -> Any:
    return entry_points()


def installed(group: str) -> list[EntryPoint]:
    """Entry points of a group, those of our extras first: the first of a name is used.

    To look through those of all packages takes 20 ms, once.
    """
    return sorted(_entry_points().select(group=group), key=lambda e: not e.value.startswith("workbench."))


BROKEN_PARTS: dict[str, None] = {}
"""Sentences on the broken parts that this process goes on without, in order; views show them."""


def warn_of_broken(part: str, error: BaseException) -> None:
    """Warn of a part that is broken, by what raised and where; everything else goes on without it."""
    text = f"{part} is left out: {type(error).__name__}: {error}{place_of(error)}"
    BROKEN_PARTS[text] = None
    warnings.warn(text, RuntimeWarning, stacklevel=3)


def plugins(
    group: str, what: str, add: Callable[[Any, str], None] = lambda part, origin: None
) -> Iterator[tuple[str, Any]]:
    """Names and parts of one group of entry points; one that is broken costs a warning, and nothing else.

    Args:
        what: What a part is called in the warning.
        add: Takes a part and where it comes from, and may refuse it.
    """
    for entry in installed(group):
        try:
            part = entry.load()
            add(part, entry.value)
        except BaseException as error:  # whatever is wrong with somebody else's package, `sys.exit` too
            if stops(error):
                raise
            package = entry.dist.name if entry.dist is not None else "a package"
            warn_of_broken(f"the {what} '{entry.name}' of {package} ({entry.value})", error)
        else:
            yield entry.name, part


@final
class Registry(Mapping[str, Part]):
    """Parts by name: objects of a kind, its subclasses, or functions.

    Args:
        what: What a part is called in messages.
        kind: What every part is, or derives from; a function if None.
        parts: Those that come with the package.
        group: Entry points to add when it is first read.
        classes: Whether the parts are the classes themselves.
    """

    def __init__(
        self, what: str, kind: type | tuple[type, ...] | None, *parts: Any, group: str, classes: bool = False
    ):
        self._parts: dict[str, Part] = {}
        self._origins: dict[str, str] = {}
        self._what = what
        self._group: str | None = group
        self._is_read = False
        self._kind, self._classes = kind, classes
        self._lock = RLock()
        for part in parts:
            self._add(part, BUILT_IN)

    def register(self, part: Added) -> Added:
        """Add a part, and hand it back, so that this can decorate a class."""
        self._add(part, BY_HAND)
        return part

    def _add(self, part: Any, origin: str) -> None:
        """Keep a part; of two with one name the later stays if both are the same code, run again."""
        added = self._checked(part)
        name = _name(added)
        if origin != BUILT_IN and (mistake := self._mistake(added)):
            raise OptionError(f"the {self._what} '{name}' {mistake}", option=self._what, found=part)
        if name in self._parts and self._parts[name] is not added:
            home, known = _home(added), self._origins[name]
            others = {origin, known} if home[0].startswith("workbench.") else {origin, known} - {BY_HAND}
            if home != _home(self._parts[name]) or known == BUILT_IN or len(others) > 1:
                raise OptionError(
                    f"the name '{name}' is taken by another {self._what} ({self._origins[name]}); give "
                    f"{home[1]} another name",
                    option=self._what,
                    found=name,
                )
        self._parts[name], self._origins[name] = added, origin

    def _mistake(self, part: Any) -> str:
        """What is wrong with somebody else's part, as the end of a sentence; empty if nothing is."""
        if not isinstance(getattr(part, "name", ""), str | property):
            return f"has a name that is no text: {part.name!r}"
        kinds = self._kind if isinstance(self._kind, tuple) else (self._kind,)
        found = attribute_mistake(part, [k for k in kinds if k is not None and issubclass(_type(part), k)])
        own = getattr(part, "mistake_of_part", None)
        return found or (own() if callable(own) else "")

    def remove(self, name: str) -> None:
        """Forget a part that was registered."""
        del self._parts[name], self._origins[name]

    def __getitem__(self, name: str) -> Part:
        return self._all()[name]

    def __iter__(self) -> Iterator[str]:
        return iter(tuple(self._all()))

    def __len__(self) -> int:
        return len(self._all())

    def _checked(self, part: Any) -> Any:
        if self._kind is None:
            if not callable(part) or isinstance(part, type):
                raise OptionError(
                    f"{_article(self._what)} is a function; got {_type(part).__name__}",
                    option=self._what,
                    found=part,
                )
            return part
        kind = _type(part)
        if not issubclass(kind, self._kind):
            kinds = self._kind if isinstance(self._kind, tuple) else (self._kind,)
            wanted = " or ".join(k.__name__ for k in kinds)
            raise OptionError(f"the {self._what} {kind.__name__} must derive from {wanted}")
        if isabstract(kind):
            missing = ", ".join(sorted(kind.__abstractmethods__))
            raise OptionError(
                f"the {self._what} {kind.__name__} lacks {missing}", option=self._what, found=part
            )
        if self._classes:
            if not isinstance(part, type):
                raise OptionError(
                    f"{_article(self._what)} is a class: register {kind.__name__}, no object of it"
                )
        elif isinstance(part, type):
            try:
                part = part()
            except TypeError as error:
                raise OptionError(
                    f"register an object as {self._what}: {kind.__name__} needs arguments ({error})"
                ) from None
        if not self._classes and not isinstance(getattr(part, "name", None), str):
            raise OptionError(f"the {self._what} {kind.__name__} lacks name")
        return part

    def _all(self) -> dict[str, Part]:
        """With those of installed packages, which are looked for once."""
        if not self._is_read:
            with self._lock:
                if (group := self._group) is not None:  # else a plug-in reads it while it is loaded
                    self._group = None
                    try:
                        for _ in plugins(group, self._what, add=self._add):
                            pass
                    except BaseException:  # a warning made an error, or Ctrl-C: the next reading begins again
                        self._group = group
                        raise
                    self._is_read = True
        return self._parts


def _type(part: Any) -> Any:
    return part if isinstance(part, type) else type(part)


def _name(part: Any) -> str:
    return part.name if isinstance(getattr(part, "name", None), str) else part.__name__


def _home(part: Any) -> tuple[str, str]:
    """Where a part is written: two with the same home are one, registered again."""
    written = part if isinstance(part, type) or hasattr(part, "__qualname__") else type(part)
    return written.__module__, written.__qualname__


def _article(what: str) -> str:
    return f"{'an' if what[0] in 'aeiou' else 'a'} {what}"
