"""Checks of arguments where users call: arguments of verbs and fields of records as their annotations say.

Inside, types are trusted. Here a value of another type is read where its meaning is plain (a path
for measurements, "20%" for a number, one name for several), and refused in one sentence elsewhere.
"""

from collections.abc import Callable, Iterable, Mapping, Sized
from dataclasses import fields, is_dataclass, replace
from enum import Enum
from functools import cache, reduce, wraps
from inspect import Parameter, Signature, cleandoc, signature
from math import isfinite, isnan
from numbers import Integral, Real
from operator import or_
from pathlib import Path
from types import GenericAlias, NoneType, UnionType
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    NamedTuple,
    ParamSpec,
    TypeVar,
    Union,
    get_args,
    get_origin,
    get_type_hints,
)

import numpy as np
from jaxtyping import AbstractArray
from numpy.typing import ArrayLike

from workbench.base.errors import OptionError, UnitError
from workbench.base.units import Quantity, parse_quantity

P = ParamSpec("P")
Result = TypeVar("Result")
Given = Mapping[str, Any]
"""Arguments before the one that is read, by name: what a path means may depend on the robot."""
Read = Callable[[Any, Given], Any]

Kind = TypeVar("Kind")
if TYPE_CHECKING:
    Like = Union[Kind, Any]  # noqa: UP007 an alias with a parameter
    """What may be given where a checked verb takes a kind: one, or what stands for one, such as its file."""
else:

    class Like:
        """The kind itself: the decorator reads what stands for it."""

        def __class_getitem__(cls, kind):
            return kind


_REFUSED = object()
_SEVERAL = Parameter.VAR_POSITIONAL, Parameter.VAR_KEYWORD
MAX_SHOWN = 12
"""Numbers of an array that a message quotes."""


class Reading(NamedTuple):
    """What may be given for a type, for messages and help, and what reads it; stands in `Annotated`, too."""

    text: str
    read: Read

    def __repr__(self) -> str:
        return repr(self.text)


_READINGS: dict[type, Reading] = {}
_PLAIN = {bool: "True or False", int: "a whole number", float: "a number", str: "text", Path: "a path"}


def _seed(value: Any, given: Given) -> Any:
    if isinstance(value, Integral) and not isinstance(value, bool) and value < 0:
        raise OptionError(f"seed must be at least 0, got {value}", option="seed", found=value)
    return value


Seed = Annotated[int, Reading("a whole number", _seed)]
"""Where random numbers begin."""


def _finite(value: Any) -> Any:
    return value if _is_finite(value) else _REFUSED


def _size_of(quantity: Quantity) -> Read:
    def read(value: Any, given: Given) -> Any:
        try:
            size = parse_quantity(value, quantity) if isinstance(value, str) else value
        except UnitError:
            return _REFUSED
        return _finite(size)

    return read


Length = Annotated[float, Reading('a length in m, or text such as "0.5mm"', _size_of(Quantity.LENGTH))]
Angle = Annotated[float, Reading('an angle in rad, or text such as "0.02deg"', _size_of(Quantity.ANGLE))]


def pair_of(value: Any) -> tuple[float, ...] | None:
    """A length, or a length and an angle: in SI, or as text such as `0.05mm,0.01deg`; None for the rest."""
    if isinstance(value, str):
        parts = value.split(",")
        kinds = (Quantity.LENGTH, Quantity.ANGLE)
        try:
            value = tuple(parse_quantity(text, kind) for text, kind in zip(parts, kinds, strict=False))
        except UnitError:
            return None
        return value if len(parts) == len(value) else None
    if not isinstance(value, tuple | list):
        value = [value]
    is_pair = len(value) in (1, 2) and all(isinstance(v, Real) and not isinstance(v, bool) for v in value)
    return tuple(float(v) for v in value) if is_pair else None


LengthAndAngle = Annotated[
    tuple[float, float],
    Reading(
        'a length in m and an angle in rad, such as (1e-4, 3e-4), or text such as "0.1mm,0.02deg"',
        lambda value, given: _finite(pair_of(value) or value),
    ),
]


def _padded(value: Any, given: Given) -> Any:
    pair = pair_of(value)
    return _finite(value if pair is None else (*pair, None)[:2])


LengthAndOptionalAngle = Annotated[
    tuple[float, float | None],
    Reading(
        "a length in m and an angle in rad, or the length alone where no rotation is read, such as "
        '(1e-4, 3e-4), or text such as "0.1mm,0.02deg"',
        _padded,
    ),
]


def accept(kind: type, text: str, read: Read) -> None:
    """Let other values stand for a type in arguments.

    Args:
        kind: The type.
        text: What may be given, for messages.
        read: Makes one of a value that may mean one, and refuses one that can't be; anything else comes back
            as it is.
    """
    _READINGS[kind] = Reading(text, read)


def checked_arguments(record: type | None = None) -> Callable[[Callable[P, Result]], Callable[P, Result]]:
    """Decorator of a verb: its arguments are checked, or read, by their annotations.

    Args:
        record: A dataclass whose fields the verb takes as `**fields`; help shows them one by one.
    """

    def decorate(verb: Callable[P, Result]) -> Callable[P, Result]:
        shown = _expanded(signature(verb), record)

        @wraps(verb)
        def call(*args: P.args, **options: P.kwargs) -> Result:
            try:
                given = shown.bind(*args, **options)
            except TypeError as error:
                raise TypeError(f"{verb.__name__}() {error}") from None
            hints = {**(_hints(record) if record else {}), **_hints(verb)}
            several = {p.name for p in shown.parameters.values() if p.kind in _SEVERAL}
            values = {name: value for name, value in given.arguments.items() if name not in several}
            given.arguments.update(admitted(hints, values))
            return verb(*given.args, **given.kwargs)

        call.__signature__ = shown  # type: ignore[attr-defined]
        call.__doc__ = _documented(verb.__doc__, record)
        return call

    return decorate


def shown_plainly(record: type) -> type:
    """A record whose help shows the types of its fields alone."""
    init: Any = vars(record).get("__init__")
    if is_dataclass(record) and init is not None:
        init.__signature__ = _expanded(signature(init), None)
    return record


def admit(record: Any) -> None:
    """The fields of a frozen dataclass by their annotations, numbers finite; for its `__post_init__`."""
    values = {f.name: getattr(record, f.name) for f in fields(record)}
    kind: Callable[..., Any] = type(record)
    for name, value in admitted(_hints(kind), values).items():
        if not _is_finite(value):
            raise OptionError(f"{name} must be finite, got {_shown(value)}", option=name, found=value)
        object.__setattr__(record, name, value)


def with_fields(kind: type[Kind], record: Kind | None, given: Mapping[str, Any]) -> Kind:
    """A record with fields that are given beside it; the usual record if None.

    Raises:
        OptionError: a field that the record sets as well, to another value.
    """
    if record is None:
        return kind(**given)
    usual, both = kind(), replace(record, **given)  # type: ignore[type-var]
    for name in given:
        own, new = getattr(record, name), getattr(both, name)
        if own not in (getattr(usual, name), new):
            raise OptionError(
                f"{name} is {_shown(new)} in the call and {_shown(own)} in its {kind.__name__}: give it once",
                option=name,
                found=new,
            )
    return both


def admitted(hints: Mapping[str, Any], values: Mapping[str, Any]) -> dict[str, Any]:
    """Values by name, each of the type that its annotation says."""
    found: dict[str, Any] = {}
    for name, value in values.items():
        found[name] = _read(value, hints.get(name, Any), found)
        if found[name] is _REFUSED:
            raise OptionError(
                f"{name} must be {_text(hints[name])}, got {_shown(value)}", option=name, found=value
            )
    return found


def _documented(text: str | None, record: type | None) -> str | None:
    """A verb's docstring with the fields of a record among its arguments."""
    if record is None or not text or not record.__doc__:
        return text
    lines = cleandoc(record.__doc__).partition("Args:\n")[2].splitlines()
    own, raises, rest = text.partition("\n    Raises:")
    return "\n".join([own.rstrip(), *(f"    {line}" for line in lines), raises + rest])


def _expanded(own: Signature, record: type | None) -> Signature:
    """A signature for people, with the fields of a record in place of `**fields`."""
    kept = [p.replace(annotation=_bare(p.annotation)) for p in own.parameters.values()]
    if record is None:
        return own.replace(parameters=kept)
    made = {f.name: getattr(record(), f.name) for f in fields(record)}
    flat = [
        Parameter(name, Parameter.KEYWORD_ONLY, default=made[name], annotation=_bare(hint))
        for name, hint in _hints(record).items()
        if name in made
    ]
    return own.replace(parameters=[p for p in kept if p.kind is not Parameter.VAR_KEYWORD] + flat)


@cache
def _hints(of: Callable[..., Any]) -> dict[str, Any]:
    """Annotations; one that is there for type checkers alone lets everything in."""
    try:
        return get_type_hints(of, include_extras=True)
    except NameError:
        own = signature(of).parameters.values()
        known = {p.name: p.annotation for p in own if not isinstance(p.annotation, str)}
        return {name: hint for name, hint in known.items() if hint is not Parameter.empty}


def _bare(hint: Any) -> Any:
    """An annotation as help shows it: types alone."""
    kind, parts = get_origin(hint), get_args(hint)
    if _is_array_like(parts):
        others = [part.__name__ for part in parts if part not in get_args(ArrayLike)]
        return _Named(" | ".join(["ArrayLike", *others]))
    if kind in (Union, UnionType):
        return reduce(or_, map(_bare, parts))
    if type(hint) is GenericAlias:
        return GenericAlias(kind, tuple(map(_bare, parts)))
    return parts[0] if kind is Annotated else hint


class _Named(str):
    """An annotation by its name, which help shows without quotes."""

    __repr__ = str.__str__


def _read(value: Any, hint: Any, given: Given) -> Any:
    """The value as a type says, or `_REFUSED`."""
    kind, parts = get_origin(hint) or hint, get_args(hint)
    if kind is Any or _is_array_like(parts):
        return value
    if kind is Annotated:
        return _read(hint.__metadata__[0].read(value, given), parts[0], given)
    if kind in (Union, UnionType):
        readings = (_read(value, part, given) for part in _ordered(parts))
        return next((found for found in readings if found is not _REFUSED), _REFUSED)
    if not isinstance(kind, type):
        return value
    if issubclass(kind, AbstractArray):
        return _array(value, kind)
    if kind is Callable or kind is type(Callable):
        return value if callable(value) else _REFUSED
    if issubclass(kind, Mapping):
        return _entries(value, parts, given)
    if parts and issubclass(kind, Iterable):
        return _items(value, kind, parts, given)
    return _single(value, kind, given)


def _array(value: Any, kind: Any) -> Any:
    """An array of the shape and numbers that an annotation says, or what numpy makes one of."""
    try:
        array = np.asarray(value)
    except ValueError:  # rows of unequal length
        return _REFUSED
    if array.dtype.kind in "iu" and "float64" in kind.dtypes:
        array = array.astype(float)
    return array if isinstance(array, kind) else _REFUSED


def _is_finite(value: Any) -> bool:
    """Whether all numbers of a field are; a record in it has checked its own."""
    if type(value) is tuple:
        return all(map(_is_finite, value))
    if isinstance(value, np.ndarray):
        return value.dtype.kind != "f" or bool(np.isfinite(value).all())
    return not isinstance(value, float) or isfinite(value)


def _is_array_like(parts: tuple[Any, ...]) -> bool:
    """Whether what is read is numpy's `ArrayLike`, which says so by protocols of its own."""
    return any(getattr(part, "__module__", "").startswith("numpy._typing") for part in parts)


def _ordered(parts: tuple[Any, ...]) -> list[Any]:
    """Members of a union as they are tried: text last, and not at all beside words of an enumeration."""
    has_enum = any(isinstance(part, type) and issubclass(part, Enum) for part in parts)
    kept = [part for part in parts if not (part is str and has_enum)]
    return sorted(kept, key=lambda part: (part is not NoneType, part is str))


def _single(value: Any, kind: type, given: Given) -> Any:
    if kind in (int, float) and (isinstance(value, bool | np.bool_) or _is_nan(value)):
        return _REFUSED
    if kind in _READINGS:
        value = _READINGS[kind].read(value, given)
    elif isinstance(value, kind):
        return value
    elif kind in _PLAIN:
        return _plain(value, kind)
    elif issubclass(kind, Enum) and value in list(kind):
        return kind(value)
    return value if isinstance(value, kind) else _REFUSED


def _is_nan(value: Any) -> bool:
    return isinstance(value, float | np.floating) and isnan(value)


def _plain(value: Any, kind: type) -> Any:
    """A number, a truth value or a path from what is one without doubt; text isn't a number: which unit?"""
    if kind is bool:
        return bool(value) if isinstance(value, np.bool_) else _REFUSED
    if kind is int:
        whole = isinstance(value, Integral) or (isinstance(value, float) and value.is_integer())
        return int(value) if whole else _REFUSED
    if kind is float:
        return float(value) if isinstance(value, Real) else _REFUSED
    return Path(value) if kind is Path and isinstance(value, str) else _REFUSED


def share_of(text: str) -> float | str:
    """The number in a text such as `0.2` or `20%`; the text itself if it is none."""
    try:
        return float(text.strip().removesuffix("%")) / (100.0 if text.strip().endswith("%") else 1.0)
    except ValueError:
        return text


def _entries(value: Any, parts: tuple[Any, ...], given: Given) -> Any:
    if not isinstance(value, Mapping):
        return _REFUSED
    if not parts:
        return value
    read = {_read(k, parts[0], given): _read(v, parts[1], given) for k, v in value.items()}
    return _REFUSED if _REFUSED in read or any(v is _REFUSED for v in read.values()) else read


def _items(value: Any, kind: type, parts: tuple[Any, ...], given: Given) -> Any:
    """Several of a kind; a single one stands for itself, and names may have commas between them."""
    if isinstance(value, Mapping) or value is None:
        return _REFUSED
    if isinstance(value, str):
        value = [name.strip() for name in value.split(",") if name.strip()]
    several = list(value) if isinstance(value, Iterable) and isinstance(value, Sized) else [value]
    kinds = list(parts) if kind is tuple and parts[-1] is not Ellipsis else [parts[0]] * len(several)
    if len(kinds) != len(several):
        return _REFUSED
    found = tuple(_read(v, k, given) for v, k in zip(several, kinds, strict=True))
    return _REFUSED if any(v is _REFUSED for v in found) else found


def _text(hint: Any) -> str:
    """What may be given, for people; an annotation may say it itself."""
    if get_origin(hint) is Annotated:
        return hint.__metadata__[0].text
    kind, parts = get_origin(hint) or hint, get_args(hint)
    if kind in (Union, UnionType):
        return " or ".join(_text(part) for part in _ordered(parts) if part is not NoneType)
    if kind in _READINGS:
        return _READINGS[kind].text
    if kind in _PLAIN:
        return _PLAIN[kind]
    if not isinstance(kind, type) or issubclass(kind, Callable):  # type: ignore[arg-type]
        return "a function"
    if issubclass(kind, Enum):
        return f"one of {', '.join(map(str, kind))}"
    if issubclass(kind, Mapping):
        return f"a mapping to {_text(parts[1])}" if parts else "a mapping"
    if issubclass(kind, AbstractArray):
        return f"an array of shape ({hint.dim_str})" if hint.dim_str else "a number"
    if parts and issubclass(kind, Iterable):
        if kind is tuple and parts[-1] is not Ellipsis:
            texts = list(dict.fromkeys(map(_text, parts)))
            return f"{len(parts)} values ({'each ' if len(texts) == 1 else ''}{'; '.join(texts)})"
        return f"a list (each {_text(parts[0])})"
    return f"{'an' if kind.__name__[0] in 'AEIOU' else 'a'} {kind.__name__}"


def _shown(value: Any) -> str:
    """What was given, for people; only its kind where it is large."""
    if isinstance(value, str):
        return f"'{value}'"
    if value is None or isinstance(value, bool | int | float | tuple | list | set | dict):
        return repr(value)
    if isinstance(value, np.ndarray) and value.size <= MAX_SHOWN:
        return str(value.tolist())
    return f"{'an' if type(value).__name__[0] in 'AEIOU' else 'a'} {type(value).__name__}"
