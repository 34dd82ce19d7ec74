"""Choices for a fit, for identification and diagnosis: rows, frames, free constants, noise."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import wraps
from inspect import Parameter, signature
from typing import TypeVar

from workbench.base.errors import OptionError
from workbench.data.dataset import Dataset
from workbench.identification.frames import Sessions
from workbench.identification.problem import Noise
from workbench.plate.region import Region

Result = TypeVar("Result")


@dataclass(frozen=True, eq=False, kw_only=True)
class FitChoices:
    """Which rows are fitted, what is free, and how the rows weigh.

    Args:
        held_out: Share of rows to hold out, rows of another file, or names of sessions; they choose nothing.
        frames: Whether sessions share base and tool, have their own, or the data decide.
        free: Constants to identify; the robot's default ones if None.
        exclude: Rows to keep out, with the reason.
        region: Keep only rows whose nominal tool position lies in this cuboid of the robot's base frame.
        noise: Standard deviations [m], [rad]; from repeats or the fit if None.
        known: Known places of anchors or contacts [m], such as `anchor[A].x`.
        seed: Chooses the held-out rows (and the folds of a diagnosis).
    """

    held_out: float | Dataset | tuple[str, ...] = 0.2
    frames: Sessions | str = Sessions.AUTO
    free: Sequence[str] | None = None
    exclude: Mapping[int, str] = field(default_factory=dict)
    region: Region | None = None
    noise: Noise | None = None
    known: Mapping[str, float] = field(default_factory=dict)
    seed: int = 0

    def __post_init__(self):
        object.__setattr__(self, "frames", option(Sessions, self.frames, "frames"))
        object.__setattr__(self, "exclude", dict(self.exclude or {}))
        object.__setattr__(self, "known", dict(self.known or {}))


def with_choices(verb: Callable[..., Result]) -> Callable[..., Result]:
    """A verb of robot, data and `FitChoices` that takes the fields of these as keywords as well."""
    names = {f.name for f in fields(FitChoices)}

    @wraps(verb)
    def call(robot, data, choices: FitChoices | None = None, **options):
        given = {name: options.pop(name) for name in names & set(options)}
        choices = FitChoices(**given) if choices is None else replace(choices, **given)
        return verb(robot, data, choices, **options)

    own = signature(verb)
    robot, data, choices, *rest = own.parameters.values()
    flat = [p.replace(kind=Parameter.KEYWORD_ONLY) for p in signature(FitChoices).parameters.values()]
    shown = [robot, data, choices.replace(default=None), *flat, *rest]
    call.__signature__ = own.replace(parameters=shown)  # type: ignore[attr-defined]
    return call


def option(kind, value, what: str):
    """A member of an enumeration by its word."""
    try:
        return kind(value)
    except ValueError:
        raise OptionError(f"{what} must be one of {', '.join(kind)}, got '{value}'") from None
