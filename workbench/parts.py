"""What extras and other packages add to the program: one record of parts each.

An extra keeps its record, `PARTS`, in its folder. Another package names its own as an entry point,

    [project.entry-points."workbench.parts"]
    gears = "gears:PARTS"

and a notebook registers one: `wb.register(wb.Parts(effects=(GearSag,)))`. A part stands in a record, or as
"module:name", which is imported when such parts are first read. A broken one costs a warning.
"""

import sys
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from importlib.metadata import entry_points
from inspect import isabstract
from traceback import walk_tb
from typing import Any, TypeVar

EXTRAS = (
    *("camera", "controllers", "hobby", "katana", "live", "logs", "pendant", "poses"),
    *("production", "reproduce", "review", "service", "trajectories", "workshop"),
)
"""Folders of `workbench/extras/`, in the order of their parts."""
BROKEN: dict[str, None] = {}
"""Sentences on the broken parts that this process goes on without, in order; views show them."""
Part = TypeVar("Part")
_BY_HAND: list["Parts"] = []
_OURS = {*sys.stdlib_module_names, "workbench"}


@dataclass(frozen=True, kw_only=True, eq=False)
class Parts:
    """What a package adds; commands and names of the root by name. `workbench/README.md` says more."""

    commands: Mapping[str, Any] = field(default_factory=dict)
    root: Mapping[str, Any] = field(default_factory=dict)
    columns: Sequence[Any] = ()
    effects: Sequence[Any] = ()
    observations: Sequence[Any] = ()
    preparations: Sequence[Any] = ()
    layouts: Sequence[Any] = ()
    joins: Sequence[Any] = ()
    sources: Sequence[Any] = ()
    robot_checks: Sequence[Any] = ()
    exports: Sequence[Any] = ()
    plate_exports: Sequence[Any] = ()
    session_commands: Sequence[Any] = ()
    panels: Sequence[Any] = ()
    companions: Sequence[Any] = ()


def register(record: Parts) -> Callable[[], None]:
    """Add a record by hand, as in a notebook; what comes back takes it away again."""

    def forget() -> None:
        _BY_HAND.remove(record)
        parts.cache_clear()

    _BY_HAND.append(record)
    parts.cache_clear()
    return forget


@cache
def parts(name: str, kind: Any = None, *, classes: bool = False) -> tuple[Any, ...]:
    """The parts of one field of all records, each of a kind; functions if it is None.

    A part that is a class is made without arguments, unless `classes` are asked for.
    """
    found = []
    for key, part, origin in offered(name):
        try:
            made = resolved(part)
            own = made if isinstance(made, type) else type(made)
            if isabstract(own) or not (callable(made) if kind is None else issubclass(own, kind)):
                raise TypeError(f"it must be a whole {kind or 'function'}, got {made!r}")
            if check := getattr(own, "check_part", None):
                check()
            found.append(made() if made is own and not classes else made)
        except (Exception, SystemExit) as error:  # whatever is wrong with somebody else's package
            warn_of_broken(f"'{key}' of {origin}", error)
    return tuple(found)


def offered(name: str) -> Iterator[tuple[str, Any, str]]:
    """Name, part and origin of everything in one field, before anything of it is imported."""
    for origin, record in (*_installed(), *(("a record made by hand", record) for record in _BY_HAND)):
        for key in (held := getattr(record, name)):
            yield str(key), held[key] if isinstance(held, Mapping) else key, origin


def resolved(part: Any) -> Any:
    """A part, imported if it is the name of one."""
    module, _, attribute = part.partition(":") if isinstance(part, str) else ("", "", "")
    return getattr(import_module(module), attribute) if module else part


@cache
def _installed() -> list[tuple[str, Parts]]:
    """Records of the extras that are there, and of other packages, with where they come from."""
    places, records = {f"workbench.extras.{name}": f"workbench.extras.{name}:PARTS" for name in EXTRAS}, []
    for entry in entry_points(group="workbench.parts"):  # which takes 20 ms
        places[f"{entry.dist.name if entry.dist else 'a package'} ({entry.value})"] = entry.value
    for origin, place in places.items():
        try:
            if not isinstance(record := resolved(place), Parts):
                raise TypeError(f"it must be a record of Parts, got {record!r}")
            records.append((origin, record))
        except (Exception, SystemExit) as error:
            if not (isinstance(error, ModuleNotFoundError) and error.name in (origin, "workbench.extras")):
                warn_of_broken(f"all of {origin}", error)
    return records


def warn_of_broken(part: str, error: BaseException) -> None:
    """Warn of a part that is broken, by what raised and where in it; everything else goes on without it."""
    places = [(str(frame.f_globals["__name__"]), line) for frame, line in walk_tb(error.__traceback__)]
    theirs = [place for place in places if place[0].split(".")[0] not in _OURS or ".extras." in place[0]]
    where = "".join(f" ({module}, line {line})" for module, line in theirs[-1:])
    text = f"{part} is left out: {type(error).__name__}: {error}{where}"
    BROKEN[text] = None
    warnings.warn(text, RuntimeWarning, stacklevel=3)


class PartTable(Mapping[str, Part]):
    """Parts by name: built-in ones, whose names nobody takes, and those of one field of all records."""

    def __init__(self, field: str, kind: Any, *built_in: Any, classes: bool = False):
        self._read = lambda: parts(field, kind, classes=classes)
        self._added: tuple[Any, ...] = ()
        self._built_in = self._all = {_name(part): part for part in built_in}

    def _parts(self) -> dict[str, Any]:
        if (added := self._read()) is not self._added:
            self._all = self._built_in | {_name(part): part for part in added} | self._built_in
            self._added = added
            for name in filter(self._built_in.__contains__, map(_name, added)):
                warn_of_broken(f"a part called '{name}'", ValueError("that is the name of one of ours"))
        return self._all

    def __getitem__(self, name: str) -> Part:
        return self._parts()[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._parts())

    def __len__(self) -> int:
        return len(self._parts())


def _name(part: Any) -> str:
    return getattr(part, "name", None) or part.__name__
