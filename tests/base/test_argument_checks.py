"""Arguments of users: read where their meaning is plain, refused in one sentence elsewhere."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from inspect import cleandoc, signature
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pytest
from refusals import refuses

import workbench as wb
from workbench.base.argument_checks import Reading, accept, admit, checked_arguments, share_of
from workbench.base.errors import OptionError
from workbench.base.types import Vector3

Share = Annotated[
    float, Reading("a number", lambda value, given: share_of(value) if isinstance(value, str) else value)
]


class Colour(StrEnum):
    RED = "red"
    BLUE = "blue"


@dataclass(frozen=True)
class Grams:
    value: float


@dataclass(frozen=True, kw_only=True)
class Extras:
    share: Share = 0.2
    names: Sequence[str] = ()
    table: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self):
        admit(self)


accept(
    Grams, "grams", lambda value, given: Grams(given["scale"] * value) if isinstance(value, int) else value
)


@checked_arguments(Extras)
def verb(
    scale: float,
    mass: Grams | None = None,
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
    ("given", "name", "read"),
    [
        ({"scale": np.float32(0.5)}, "scale", 0.5),
        ({"mass": 3}, "mass", Grams(6.0)),
        ({"count": np.int64(4)}, "count", 4),
        ({"count": 4.0}, "count", 4),
        ({"colour": "blue"}, "colour", Colour.BLUE),
        ({"pair": [1, 2]}, "pair", (1.0, 2.0)),
        ({"path": "a/b"}, "path", Path("a/b")),
        ({"flag": np.True_}, "flag", True),
        ({"share": "0.3"}, "share", 0.3),
        ({"names": "a"}, "names", ("a",)),
        ({"names": "a, b"}, "names", ("a", "b")),
        ({"names": np.array(["a", "b"])}, "names", ("a", "b")),
        ({"place": (1, 2, 3)}, "place", np.array([1.0, 2.0, 3.0])),
        ({"table": {"a": 1}}, "table", {"a": 1.0}),
    ],
)
def test_what_is_plain_is_read(given, name, read):
    found = verb(**{"scale": 2.0, **given})[name]
    assert np.all(found == read)
    assert isinstance(found, type(read))


@pytest.mark.parametrize(
    "given",
    [
        {"scale": "much"},
        {"scale": "0.5"},
        {"scale": "50%"},
        {"place": 3.0},
        {"place": (1.0, 2.0)},
        {"place": "here"},
        {"place": [[1.0], [2.0, 3.0], 4.0]},
        {"scale": True},
        {"scale": None},
        {"mass": "3"},
        {"count": 4.5},
        {"count": "4"},
        {"colour": "green"},
        {"pair": (1.0,)},
        {"pair": 1.0},
        {"path": 3},
        {"flag": 1},
        {"call": 3},
        {"names": (3,)},
        {"names": {"a": 1}},
        {"table": ["a"]},
        {"table": {"a": "b"}},
    ],
)
def test_what_is_not_is_refused_by_name(given):
    (name,) = given
    with refuses(OptionError, option=name) as refused:
        verb(**{"scale": 2.0, **given})
    assert "\n" not in str(refused.value)
    assert len(str(refused.value)) < 120


def test_a_record_reads_its_fields():
    assert Extras(share="10%", names="a") == Extras(share=0.1, names=("a",))
    with refuses(OptionError, option="share", found="x"):
        Extras(share="x")


def test_help_describes_every_choice_of_a_fit():
    for function in (wb.identify, wb.diagnose):
        described = set(re.findall(r"^    (\w+): ", cleandoc(function.__doc__), re.MULTILINE))
        assert described >= set(signature(function).parameters)
        assert function.__doc__.index("held_out: ") < function.__doc__.index("Raises:")


def test_the_signature_shows_every_field_with_its_default():
    shown = signature(verb).parameters
    assert [*shown][-3:] == ["share", "names", "table"]
    assert [shown[name].default for name in Extras.__annotations__] == [0.2, (), {}]
    with refuses(TypeError, "verb()", "'shares'"):
        verb(1.0, shares=0.1)
