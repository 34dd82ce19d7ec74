"""Records of options as arguments of commands, and options that other packages add to them.

An extensible record has a field `joined`, and `joins` gives the type of what may be added.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from dataclasses import is_dataclass, replace
from inspect import Parameter, Signature, signature
from pathlib import Path
from typing import TYPE_CHECKING, Any

from workbench.base.errors import OptionError
from workbench.base.registry import Registry, warn_of_broken

if TYPE_CHECKING:
    from workbench.arm.robot import Robot
    from workbench.data.dataset import Dataset
    from workbench.session.view import AbstractView
    from workbench.session.worker import Worker


class AbstractSource(ABC):
    """Options by which another package reads measurements: a frozen dataclass, added to `FileOptions`."""

    @abstractmethod
    def read(self, path: Path, arm: "Robot", joints: Path | None) -> "Dataset | None":
        """Measurements with as many joints as the arm has; None if these options were not given."""


class AbstractCompanion(ABC):
    """Options by which another package adds a view beside the page: the same for `PageOptions`."""

    @abstractmethod
    def opened(self) -> "AbstractContextManager[Callable[[Worker], AbstractView | None]]":
        """What makes the view, for as long as the page is served; it may only see to something else."""


OPTIONS: Registry[Any] = Registry(
    "set of options", (AbstractSource, AbstractCompanion), group="workbench.options", classes=True
)
"""Options that other packages add to ours."""


def flattened(command: Callable[..., None]) -> Callable[..., None]:
    """A command whose option-record arguments are expanded into their options.

    Those of other packages are looked up when it is called, as that takes 20 ms: `whole` is the command with
    them.
    """
    call = _expanded(command, {})
    extensible = [r for r in _records(command).values() if hasattr(r, "joins")]
    if extensible:
        vars(call)["whole"] = lambda: _expanded(
            command,
            {
                r: [o for o in OPTIONS.values() if issubclass(o, r.joins) and _fits(o, command)]
                for r in extensible
            },
        )
    return call


def _fits(added: Any, command: Callable[..., None]) -> bool:
    """Whether a set of options can be added to a command; a warning says why not."""
    own = {p.name for record in _records(command).values() for p in _options(record)}
    own |= signature(command).parameters.keys()
    required = next((p.name for p in _options(added) if p.default is Parameter.empty), None)
    taken = next((p.name for p in _options(added) if p.name in own), None)
    if required is None and taken is None:
        return True
    why = f"'{required}' has no default" if required else f"the command has an option '{taken}' already"
    warn_of_broken(f"the set of options {added.__name__}", OptionError(why, option=required or taken or ""))
    return False


def _records(command: Callable[..., None]) -> dict[str, Any]:
    """Arguments that are records of options."""
    found = {name: p.annotation for name, p in signature(command).parameters.items()}
    return {name: kind for name, kind in found.items() if is_dataclass(kind)}


def _expanded(command: Callable[..., None], joined: Mapping[Any, list[Any]]) -> Callable[..., None]:
    own, records = signature(command), _records(command)

    def call(**options: Any) -> None:
        def made(record: Any) -> Any:
            return record(**{p.name: options.pop(p.name) for p in _options(record)})

        whole = {
            name: replace(made(r), joined=tuple(map(made, joined[r]))) if joined.get(r) else made(r)
            for name, r in records.items()
        }
        command(**options, **whole)

    shown: list[Parameter] = []
    for name, parameter in own.parameters.items():
        if (record := records.get(name)) is None:
            shown.append(parameter)
        else:
            shown += [p for kind in (record, *joined.get(record, ())) for p in _options(kind)]
    shown = [p.replace(kind=Parameter.KEYWORD_ONLY) for p in shown]
    call.__name__, call.__doc__ = command.__name__, command.__doc__
    call.__annotations__ = {p.name: p.annotation for p in shown}
    call.__signature__ = Signature(shown)  # type: ignore[attr-defined]
    return call


def _options(record: Any) -> list[Parameter]:
    """The options of a record."""
    return [p for p in signature(record).parameters.values() if p.name != "joined"]
