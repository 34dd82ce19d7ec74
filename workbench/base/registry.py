"""Extensible registries: parts by their names in files, in order.

A part from another package can be added without editing this one. Its module calls

    from workbench.arm.effects import EFFECTS

    @EFFECTS.register
    @dataclass(frozen=True)
    class GearSag(AbstractEffect): …

and is imported before it is used; or its package names it as an entry point, so that commands know it too:

    [project.entry-points."workbench.effects"]
    gear-sag = "my_package.gear_sag:GearSag"
"""

from collections.abc import Iterator, Mapping
from importlib.metadata import entry_points
from inspect import isabstract
from typing import Any, TypeVar, final

from workbench.base.errors import OptionError

Part = TypeVar("Part")
Added = TypeVar("Added")


@final
class Registry(Mapping[str, Part]):
    """Parts by name, classes or objects with a `name`; entries are added, never replaced.

    Args:
        what: What a part is called in messages.
        parts: Those that come with the package.
        group: Entry points to add when it is first read.
    """

    def __init__(self, what: str, *parts: Part, group: str):
        self._parts: dict[str, Part] = {}
        self._what = what
        self._group = group
        for part in parts:
            self.register(part)

    def register(self, part: Added) -> Added:
        """Add a part, and hand it back, so that this can decorate a class.

        Raises:
            OptionError: a part that lacks something, or whose name another one has.
        """
        kind: Any = part if isinstance(part, type) else type(part)
        if isabstract(kind):
            missing = ", ".join(sorted(kind.__abstractmethods__))
            raise OptionError(f"the {self._what} {kind.__name__} lacks {missing}")
        added: Any = part
        known: Any = self._parts.setdefault(str(added.name), added)
        if known is not part:
            raise OptionError(
                f"the name '{added.name}' is taken by another {self._what}; give {kind.__name__} another name"
            )
        return part

    def remove(self, name: str) -> None:
        """Forget a part that was registered."""
        del self._parts[name]

    def __getitem__(self, name: str) -> Part:
        return self._all()[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._all())

    def __len__(self) -> int:
        return len(self._all())

    def _all(self) -> dict[str, Part]:
        """With those of installed packages, which are looked for once."""
        group, self._group = self._group, ""
        for entry in entry_points(group=group) if group else ():
            self.register(entry.load())
        return self._parts
