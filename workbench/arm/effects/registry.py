"""The registry of effects: by their names in files, in the order in which a diagnosis tries them.

An effect from elsewhere needs nothing of ours to be edited. Its module calls

    from workbench.arm.effects import EFFECTS

    @EFFECTS.register
    @dataclass(frozen=True)
    class GearSag(AbstractEffect): …

and is imported before it is used; or its package names the class as an entry point, so that the commands know
it too:

    [project.entry-points."workbench.effects"]
    gear-sag = "my_package.gear_sag:GearSag"
"""

from collections.abc import Iterator, Mapping
from importlib.metadata import entry_points
from inspect import isabstract
from typing import TypeVar, final

from workbench.arm.effects.effect import AbstractEffect
from workbench.base.errors import OptionError

GROUP = "workbench.effects"
"""Entry points of installed packages that name effects."""
Kind = TypeVar("Kind", bound=type[AbstractEffect])


@final
class Registry(Mapping[str, type[AbstractEffect]]):
    """Effects by name; entries are added, never replaced.

    Args:
        kinds: Those that come with the package.
        group: Entry points to add when it is first read.
    """

    def __init__(self, *kinds: type[AbstractEffect], group: str = GROUP):
        self._kinds: dict[str, type[AbstractEffect]] = {}
        self._group = group
        for kind in kinds:
            self.register(kind)

    def register(self, kind: Kind) -> Kind:
        """Add an effect, and hand it back, so that this can decorate its class.

        Raises:
            OptionError: an effect that lacks something, or whose name another one has.
        """
        if isabstract(kind):
            missing = ", ".join(sorted(kind.__abstractmethods__))
            raise OptionError(f"the effect {kind.__name__} lacks {missing}; see AbstractEffect")
        name = str(kind.name)
        if self._kinds.setdefault(name, kind) is not kind:
            raise OptionError(f"there is an effect '{name}' already; give {kind.__name__} another name")
        return kind

    def remove(self, name: str) -> None:
        """Forget an effect that was registered."""
        del self._kinds[name]

    def __getitem__(self, name: str) -> type[AbstractEffect]:
        return self._all()[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._all())

    def __len__(self) -> int:
        return len(self._all())

    def _all(self) -> dict[str, type[AbstractEffect]]:
        """With those of installed packages, which are looked for once."""
        group, self._group = self._group, ""
        for entry in entry_points(group=group) if group else ():
            self.register(entry.load())
        return self._kinds
