"""Commands made of functions: records of options as their arguments, options that extras add to them, --json.

A record that takes more has a field `joined`; `joins` is the field of `Parts` whose classes are joined to it.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from contextlib import AbstractContextManager
from copy import copy
from dataclasses import is_dataclass, replace
from inspect import Parameter, Signature, signature
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from workbench.base.errors import FileError, OptionError
from workbench.cli.output_files import as_typed, result_at
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
JsonOption = Annotated[Path | None, typer.Option("--json", help="Write the result here, machine-readable.")]


def made(entry: Any, name: str) -> Any:
    """A function, or a group, as typer's command."""
    if isinstance(entry, typer.Typer):
        found: Any = typer.main.get_group(entry)
    else:
        alone = typer.Typer(rich_markup_mode=None, add_completion=False)
        alone.command(name)(flattened(entry))
        found = typer.main.get_command(alone)
    found.name, found.rich_help_panel = name, getattr(entry, "rich_help_panel", None)
    return found


def as_called(command: Any, group: str) -> Any:
    """A command as it is called, by its group's name: with options joined to its records, and with --json.

    Those joined take 20 ms to look up; --json has every command that has none of its own.
    """
    call = flattened(getattr(command.callback, "of", command.callback.__wrapped__), _joined)
    schema, names = f"workbench.{'-'.join(filter(None, (group, command.name)))}/1", dict[str, str]()

    def reported(json_file: JsonOption = None, **options: Any) -> None:
        try:
            with result_at(json_file, schema):
                call(**options)
        except OptionError as error:
            raise as_typed(error, names) from error

    own = signature(reported).parameters["json_file"].replace(kind=Parameter.KEYWORD_ONLY)
    vars(reported)["__signature__"] = Signature([*signature(call).parameters.values(), own])
    has_own = any("--json" in option.opts for option in command.params)
    alone, more = made(call if has_own else reported, command.name), copy(command)
    names |= {param.name: param.opts[0] for param in alone.params}
    more.callback, more.params = alone.callback, alone.params
    return more


def _joined(record: Any) -> tuple[Any, ...]:
    field = getattr(record, "joins", "")
    return parts(field, KINDS[field], classes=True) if field else ()


def flattened(
    command: Callable[..., None], joined: Callable[[Any], tuple[type, ...]] = lambda record: ()
) -> Callable[..., None]:
    """A command that has the options of its arguments that are records, and of those joined to each."""
    parameters = signature(command, eval_str=True).parameters
    kinds = {name: p.annotation for name, p in parameters.items() if is_dataclass(p.annotation)}
    records = {name: (kind, *joined(kind)) for name, kind in kinds.items()}

    def call(**options: Any) -> None:
        def filled(record: Any, *more: Any) -> Any:
            own = record(**{p.name: options.pop(p.name) for p in _options(record)})
            return replace(own, joined=tuple(map(filled, more))) if more else own

        given = {name: filled(*kinds) for name, kinds in records.items()}
        data, table = options.get("data"), Path(str(options.get("robot") or ""))
        if data and table.is_file() and table.suffix.lower() in (".csv", ".xlsx", ".json", ".yaml", ".yml"):
            new = f"workbench new {table} --poses {data} --out {table.with_suffix('.toml')}"
            known = f"a driver's file alters one: workbench new ROBOT --apply {table} --for ur-kinematics"
            raise FileError(f"is no robot; a joint table becomes one: {new}; {known}", path=str(table))
        command(**options, **given)

    shown: list[Parameter] = []
    for name, parameter in parameters.items():
        shown += [p for kind in records[name] for p in _options(kind)] if name in records else [parameter]
    shown = [p.replace(kind=Parameter.KEYWORD_ONLY) for p in shown]
    call.__name__, call.__doc__ = command.__name__, command.__doc__
    vars(call).update(of=command, __signature__=Signature(shown))
    return call


def _options(record: Any) -> list[Parameter]:
    """The options of a record."""
    return [p for p in signature(record).parameters.values() if p.name != "joined"]
