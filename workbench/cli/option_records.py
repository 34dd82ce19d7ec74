"""Records of options as arguments of commands, and options that extras add to them.

A record that takes more has a field `joined`; `joins` is the field of `Parts` whose classes are joined to it.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import is_dataclass, replace
from inspect import Parameter, Signature, signature
from pathlib import Path
from typing import TYPE_CHECKING, Any

from workbench.base.errors import FileError
from workbench.parts import parts

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


KINDS: dict[str, type] = {"sources": AbstractSource, "companions": AbstractCompanion}


def flattened(command: Callable[..., None]) -> Callable[..., None]:
    """A command whose option-record arguments are expanded into their options.

    Those that are joined to them are looked up when it is called, which takes 20 ms: `whole` is the command
    with them.
    """
    call = _expanded(command, lambda record: ())
    if any(hasattr(record, "joins") for record in _records(command).values()):
        vars(call)["whole"] = lambda: _expanded(command, _joined)
    return call


def _joined(record: Any) -> tuple[Any, ...]:
    field = getattr(record, "joins", "")
    return parts(field, KINDS[field], classes=True) if field else ()


def _records(command: Callable[..., None]) -> dict[str, Any]:
    """Arguments that are records of options."""
    found = {name: p.annotation for name, p in signature(command).parameters.items()}
    return {name: kind for name, kind in found.items() if is_dataclass(kind)}


def _expanded(command: Callable[..., None], joined: Callable[[Any], tuple[Any, ...]]) -> Callable[..., None]:
    records = {name: (record, *joined(record)) for name, record in _records(command).items()}

    def call(**options: Any) -> None:
        def made(record: Any, *more: Any) -> Any:
            own = record(**{p.name: options.pop(p.name) for p in _options(record)})
            return replace(own, joined=tuple(map(made, more))) if more else own

        whole = {name: made(*kinds) for name, kinds in records.items()}
        data, table = options.get("data"), Path(options.get("robot") or "")
        if data and table.is_file() and table.suffix.lower() in (".csv", ".xlsx", ".json", ".yaml", ".yml"):
            new = f"workbench new {table} --poses {data} --out {table.with_suffix('.toml')}"
            known = f"workbench new ROBOT --apply {table} --for ur-kinematics"
            text = f"is no robot; of a joint table these rows make one: {new}; a driver's file alters one: {known}"
            raise FileError(text, path=str(table))
        command(**options, **whole)

    shown: list[Parameter] = []
    for name, parameter in signature(command).parameters.items():
        shown += [p for kind in records[name] for p in _options(kind)] if name in records else [parameter]
    shown = [p.replace(kind=Parameter.KEYWORD_ONLY) for p in shown]
    call.__name__, call.__doc__ = command.__name__, command.__doc__
    call.__annotations__ = {p.name: p.annotation for p in shown}
    call.__signature__ = Signature(shown)  # type: ignore[attr-defined]
    return call


def _options(record: Any) -> list[Parameter]:
    """The options of a record."""
    return [p for p in signature(record).parameters.values() if p.name != "joined"]
