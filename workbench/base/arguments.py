"""Arguments at the door: pydantic checks those of verbs and the fields of records by their annotations.

Inside, types are trusted. `Reads` in an annotation says what else may be given, such as a file for
measurements or text with a unit for a length, and makes a value of it; the rest is refused in one sentence.
pydantic takes 0.1 s to import, which the first call does.
"""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from enum import Enum
from functools import cache, wraps
from inspect import Parameter, cleandoc, signature
from numbers import Real
from pathlib import Path
from types import UnionType
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    ParamSpec,
    TypeVar,
    Union,
    get_args,
    get_origin,
    get_type_hints,
)

import numpy as np
from jaxtyping import AbstractArray

from workbench.base.errors import OptionError, UnitError
from workbench.base.units import Quantity, parse_quantity

P = ParamSpec("P")
Result = TypeVar("Result")
Kind = TypeVar("Kind")
Given = Mapping[str, Any]
"""Arguments before the one that is read, by name: what a path means may depend on the robot."""

if TYPE_CHECKING:
    Like = Union[Kind, Any]  # noqa: UP007 an alias with a parameter
    """What may be given where a checked verb takes a kind: one, or what it reads as one."""
else:

    class Like:
        """The kind itself: the decorator reads what stands for it."""

        def __class_getitem__(cls, kind):
            return kind


_SEVERAL = Parameter.VAR_POSITIONAL, Parameter.VAR_KEYWORD
LARGEST = 1e30
"""Sizes above this are refused: their squares and products overflow [m or rad]."""
MAX_SHOWN = 12
"""Numbers of an array that a message quotes."""


@dataclass(frozen=True, repr=False)
class Reads:
    """Metadata of an annotation: what may be given, and what makes a value of it.

    Args:
        text: For messages and help; pydantic's own if empty.
        read: Of a value, and of the arguments before it; what it can't read it hands back, or raises a
            TypeError or ValueError.
    """

    text: str
    read: Callable[[Any, Given], Any] = lambda value, given: value

    def __repr__(self) -> str:
        return repr(self.text)

    def wrapped(self, value: Any, inner: Callable[[Any], Any], info: Any) -> Any:
        """The value, read and then checked as pydantic would alone."""
        try:
            return inner(self.read(value, info.data or {}))
        except UnitError as error:
            raise OptionError(f"{info.field_name}: {error}", option=info.field_name, found=value) from None
        except (TypeError, ValueError):  # pydantic's own errors are some as well
            if not self.text:
                raise
            raise ValueError(self.text) from None


def checked_arguments(record: type | None = None) -> Callable[[Callable[P, Result]], Callable[P, Result]]:
    """Decorator of a verb: its arguments are checked, or read, by their annotations.

    Args:
        record: A dataclass whose fields the verb takes as `**fields`; help shows them one by one.
    """

    def decorate(verb: Callable[P, Result]) -> Callable[P, Result]:
        own = signature(verb)
        shown = own if record is None else _expanded(own, record)

        @wraps(verb)
        def call(*args: P.args, **options: P.kwargs) -> Result:
            try:
                given = (shown if options.keys() - shown.parameters.keys() else own).bind(*args, **options)
            except TypeError as error:
                raise TypeError(f"{verb.__name__}() {error}") from None
            single = {n: v for n, v in given.arguments.items() if own.parameters[n].kind not in _SEVERAL}
            given.arguments.update(admitted(verb, single))
            return verb(*given.args, **given.kwargs)

        call.__signature__ = shown  # type: ignore[attr-defined]
        call.__doc__ = _documented(verb.__doc__, record)
        return call

    return decorate


def admit(record: Any, *, is_finite: bool = True) -> None:
    """The fields of a frozen dataclass by their annotations; for its `__post_init__`.

    Args:
        is_finite: Whether all numbers must be.
    """
    values = {f.name: getattr(record, f.name) for f in fields(record)}
    for name, value in admitted(type(record), values, is_finite).items():
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


def admitted(of: Callable[..., Any], values: Mapping[str, Any], is_finite: bool = False) -> dict[str, Any]:
    """Some arguments or fields by name, each of the type that its annotation says."""
    from pydantic import ValidationError

    try:
        found = vars(_door(of, is_finite)(**values))
    except ValidationError as error:
        name, texts = str(error.errors()[0]["loc"][0]), dict[str, None]()
        for each in error.errors():
            if each["loc"][0] == name:
                texts[each["msg"].removeprefix("Input should be ").removeprefix("Value error, ")] = None
        text = f"{name} must be {' or '.join(texts)}, got {_shown(values[name])}"
        raise OptionError(text, option=name, found=values[name]) from None
    return {name: found[name] for name in values}


@cache
def _door(of: Callable[..., Any], is_finite: bool) -> Any:
    """A model of the arguments of a verb, or of the fields of a record."""
    from pydantic import ConfigDict, create_model

    config = ConfigDict(arbitrary_types_allowed=True, allow_inf_nan=not is_finite, protected_namespaces=())
    hints = get_type_hints(of, include_extras=True)
    names = [p.name for p in signature(of).parameters.values() if p.kind not in _SEVERAL]
    shown = {name: (_seen(hints.get(name, Any), is_finite), None) for name in names}
    return create_model(of.__name__, __config__=config, **shown)  # type: ignore[call-overload]


def _seen(hint: Any, is_finite: bool) -> Any:
    """An annotation for pydantic: numbers are no text, and arrays and tuples are made of what becomes one."""
    from pydantic import InstanceOf, WrapValidator

    kind, parts = get_origin(hint), get_args(hint)
    if isinstance(hint, type) and not parts:
        if hint in _PLAIN:
            return Annotated[hint, WrapValidator(_PLAIN[hint].wrapped)]
        if issubclass(hint, AbstractArray):
            return Annotated[hint, WrapValidator(_array_reader(hint, is_finite).wrapped)]
        is_record = is_dataclass(hint) or hasattr(hint, "_fields")
        return InstanceOf[hint] if is_record else hint  # type: ignore[misc]
    if any(isinstance(part, type) and issubclass(part, Enum) for part in parts):
        parts = tuple(part for part in parts if part is not str)
    inner = tuple(_seen(part, is_finite) for part in parts)
    if kind is Annotated:
        readers = [WrapValidator(each.wrapped) for each in hint.__metadata__ if isinstance(each, Reads)]
        return Annotated[(inner[0], *readers)]
    if any(getattr(part, "__module__", "").startswith("numpy._typing") for part in parts):
        return Any  # an `ArrayLike`: what reads it refuses the rest
    if kind in (Union, UnionType):
        return Union[inner]  # noqa: UP007 of as many as there are
    if kind in (Sequence, Collection, Iterable, tuple):
        several = inner if kind is tuple and ... not in parts else (inner[0], ...)
        return Annotated[tuple[several], WrapValidator(Reads("", _several).wrapped)]
    return Mapping[inner] if kind is Mapping and parts else hint  # type: ignore[misc]


def _number(value: Any, given: Given) -> Any:
    if isinstance(value, bool | np.bool_) or not isinstance(value, Real) or value != value:
        raise ValueError
    return value


def _truth(value: Any, given: Given) -> bool:
    if not isinstance(value, bool | np.bool_):
        raise ValueError
    return bool(value)


_PLAIN = {
    int: Reads("a whole number", _number),
    float: Reads("a number", _number),
    bool: Reads("True or False", _truth),
    str: Reads("text"),
    Path: Reads("a path"),
}


def _several(value: Any, given: Given) -> Any:
    """A single one stands for itself, and names may have commas between them."""
    if isinstance(value, str):
        return [name.strip() for name in value.split(",") if name.strip()]
    is_one = not isinstance(value, Iterable) or (isinstance(value, np.ndarray) and not value.ndim)
    return (value,) if is_one and value is not None else value


def _array_reader(kind: Any, is_finite: bool) -> Reads:
    def read(value: Any, given: Given) -> Any:
        array = np.asarray(value)
        if array.dtype.kind in "iufO" and "float64" in kind.dtypes:
            array = array.astype(float, copy=False)
        if is_finite and array.dtype.kind == "f" and not np.isfinite(array).all():
            raise ValueError
        return array

    finite = " of finite numbers" if is_finite else ""
    return Reads(f"an array of shape ({kind.dim_str}){finite}" if kind.dim_str else "a number", read)


def not_below(least: float) -> Callable[[Any, Given], Any]:
    def read(value: Any, given: Given) -> Any:
        if isinstance(value, Real) and value < least:
            raise ValueError
        return value

    return read


Seed = Annotated[int, Reads("a whole number of at least 0", not_below(0.0))]
"""Where random numbers begin."""
Count = Annotated[int, Reads("a whole number of at least 1", not_below(1.0))]


def _size_of(quantity: Quantity) -> Callable[[Any, Given], Any]:
    def read(value: Any, given: Given) -> Any:
        size = parse_quantity(value, quantity) if isinstance(value, str) else value
        if isinstance(size, int | float) and not 0.0 <= size < LARGEST:
            raise ValueError  # NaN, too
        return size

    return read


Length = Annotated[
    float, Reads('a length of 0 m or more, or text such as "0.5mm"', _size_of(Quantity.LENGTH))
]
Angle = Annotated[float, Reads('an angle of 0 rad or more, or text such as "2deg"', _size_of(Quantity.ANGLE))]
LengthAndAngle = Annotated[
    tuple[Length, Angle],
    Reads('a length in m and an angle in rad, 0 or more, such as (1e-4, 3e-4) or "0.1mm,0.02deg"'),
]
Sigma = Annotated[
    tuple[Length, Angle | None],
    Reads(
        "a length in m and an angle in rad, or the length alone where no rotation is read, such as "
        '(1e-4, 3e-4), or text such as "0.1mm,0.02deg"',
        lambda value, given: (*_several(value, given), None)[:2],
    ),
]


def pair_of(value: Any) -> tuple[float, ...] | None:
    """A length, or a length and an angle: in SI, or as text such as `0.05mm,0.01deg`; None for the rest."""
    parts = value.split(",") if isinstance(value, str) else value
    parts = parts if isinstance(parts, tuple | list) else [parts]
    pairs = zip(parts, (Quantity.LENGTH, Quantity.ANGLE)[: len(parts)], strict=True)
    try:
        sizes = [parse_quantity(p, kind) if isinstance(p, str) else _number(p, {}) for p, kind in pairs]
    except (UnitError, ValueError):
        return None
    return tuple(map(float, sizes)) or None


def _documented(text: str | None, record: type | None) -> str | None:
    """A verb's docstring with the fields of a record among its arguments."""
    if record is None or not text or not record.__doc__:
        return text
    lines = cleandoc(record.__doc__).partition("Args:\n")[2].splitlines()
    own, raises, rest = text.partition("\n    Raises:")
    return "\n".join([own.rstrip(), *(f"    {line}" for line in lines), raises + rest])


def _expanded(own: Any, record: type) -> Any:
    """A signature for people, with the fields of a record in place of `**fields`."""
    made, kept = record(), [p for p in own.parameters.values() if p.kind is not p.VAR_KEYWORD]
    flat = [
        Parameter(f.name, Parameter.KEYWORD_ONLY, default=getattr(made, f.name), annotation=f.type)
        for f in fields(record)
    ]
    return own.replace(parameters=kept + flat)


def _shown(value: Any) -> str:
    """What was given, for people; only its kind where it is large."""
    if isinstance(value, str):
        return f"'{value if len(value) < 100 else value[:99] + '…'}'"
    if value is None or isinstance(value, bool | int | float | tuple | list | set | dict):
        return repr(value)
    if isinstance(value, np.ndarray) and value.size <= MAX_SHOWN:
        return str(value.tolist())
    name = type(value).__name__
    return f"{'an' if name[0] in 'AEIOUaeiou' else 'a'} {name}"
