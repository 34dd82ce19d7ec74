"""Arguments of users: read where their meaning is plain, refused in one sentence elsewhere."""

import typing
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from enum import StrEnum
from inspect import signature
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pytest
from refusals import refuses

import workbench as wb
from workbench.base.arguments import Length, Reads, admit, checked_arguments, with_fields
from workbench.base.errors import OptionError
from workbench.base.types import Vector3
from workbench.identification.fit_choices import ChoiceFields, FitChoices


class Colour(StrEnum):
    RED = "red"
    BLUE = "blue"


@dataclass(frozen=True)
class Grams:
    value: float


@dataclass(frozen=True, kw_only=True)
class Extras:
    length: Length = 0.2
    names: Sequence[str] = ()
    table: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self):
        admit(self)


GRAMS = Reads("grams", lambda value, given: Grams(given["scale"] * value) if type(value) is int else value)


@checked_arguments(Extras)
def verb(
    scale: float,
    mass: Annotated[Grams, GRAMS] | None = None,
    *,
    count: int = 1,
    colour: Colour | str = Colour.RED,
    pair: tuple[float, float] = (0.0, 0.0),
    path: Path | None = None,
    flag: bool = False,
    place: Vector3 | None = None,
    call: Callable[[], int] | None = None,
    **fields: Any,
) -> dict[str, Any]:
    """What comes through."""
    return {**locals(), **vars(Extras(**fields))}


@pytest.mark.parametrize(
    ("name", "given", "read"),
    [
        ("scale", np.float32(0.5), 0.5),
        ("mass", 3, Grams(6.0)),
        ("count", np.int64(4), 4),
        ("colour", "blue", Colour.BLUE),
        ("pair", [1, 2], (1.0, 2.0)),
        ("path", "a/b", Path("a/b")),
        ("flag", np.True_, True),
        ("place", (1, 2, 3), np.array([1.0, 2.0, 3.0])),
        ("length", "5mm", 0.005),
        ("names", "a", ("a",)),
        ("names", "a, b", ("a", "b")),
        ("table", {"a": 1}, {"a": 1.0}),
    ],
)
def test_what_is_plain_is_read(name, given, read):
    found = verb(**{"scale": 2.0, name: given})[name]
    assert np.all(found == read)
    assert isinstance(found, type(read))


WRONG = {
    "scale": ["much", "0.5", True, None],
    "mass": ["3"],
    "count": [4.5, "4"],
    "colour": ["green"],
    "pair": [(1.0,), 1.0],
    "path": [3],
    "flag": [1, "yes"],
    "place": [3.0, (1.0, 2.0), "here", [[1.0], [2.0, 3.0], 4.0]],
    "call": [3],
    "length": ["0.5", "0.5 deg", -0.1, 1e99, np.nan, np.inf],
    "names": [(3,), {"a": 1}],
    "table": [["a"], {"a": "b"}],
}


@pytest.mark.parametrize(("name", "given"), [(name, value) for name in WRONG for value in WRONG[name]])
def test_what_is_not_is_refused_by_name(name, given):
    with refuses(OptionError, option=name) as refused:
        verb(**{"scale": 2.0, name: given})
    assert "\n" not in str(refused.value)
    assert len(str(refused.value)) < 120


def test_the_signature_shows_every_field_with_its_default():
    shown = signature(verb).parameters
    assert [shown[name].default for name in ("length", "names", "table")] == [0.2, (), {}]
    with refuses(TypeError, "verb()", "'shares'"):
        verb(1.0, shares=0.1)
    assert "held_out: " in wb.identify.__doc__.partition("Raises:")[0]


def test_type_checkers_know_the_fields_that_there_are():
    assert set(typing.get_type_hints(ChoiceFields)) == {f.name for f in fields(FitChoices)}


def test_a_field_given_twice_must_have_one_value():
    choices = with_fields(FitChoices, FitChoices(seed=40), {"frames": "shared"})
    assert (choices.frames, choices.seed) == ("shared", 40)
    assert with_fields(FitChoices, choices, {"frames": "shared"}).seed == 40
    with refuses(OptionError, option="frames"):
        with_fields(FitChoices, choices, {"frames": "per-session"})
