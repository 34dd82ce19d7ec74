"""What parts of other packages must have: the attributes that their kind declares, each of its type."""

import sys
from collections.abc import Iterator, Sequence
from enum import Enum
from functools import cache
from pathlib import Path
from sysconfig import get_paths
from traceback import extract_tb
from types import NoneType, UnionType
from typing import Any, ClassVar, Union, get_args, get_origin, get_type_hints

_HERE = Path(__file__).parents[1]
_SYSTEM = Path(get_paths()["stdlib"])
_PLAIN = (bool, int, float, str)


def attribute_mistake(part: Any, kinds: Sequence[type]) -> str:
    """What is wrong with a part's attributes, as the end of a sentence about it; empty if nothing is.

    Args:
        part: A class, or an object of one.
        kinds: What it derives from.
    """
    for kind in kinds:
        for name, hint in _declared(kind).items():
            if not hasattr(part, name):
                return f"lacks {name}"
            value = getattr(part, name)
            if not isinstance(value, property) and not _is_of(value, hint):
                return f"has a wrong {name}: {value!r} is not {_text(hint)}"
    return ""


@cache
def _declared(kind: type) -> dict[str, Any]:
    """Class variables that a kind declares, with their types; none where these can't be resolved."""
    try:
        hints = get_type_hints(kind)
    except NameError:
        return {}
    return {
        name: get_args(hint)[0]
        for name, hint in hints.items()
        if get_origin(hint) is ClassVar and not name.startswith("_")
    }


def _is_of(value: Any, hint: Any) -> bool:
    """Whether a value is of a type, as far as that is plain."""
    kind, parts = get_origin(hint) or hint, get_args(hint)
    if kind in (Union, UnionType):
        return any(_is_of(value, part) for part in parts)
    if kind is NoneType:
        return value is None
    if kind is tuple:
        each = parts[:1] if parts and parts[-1] is Ellipsis else ()
        return isinstance(value, tuple) and all(_is_of(v, part) for v in value for part in each)
    if kind is float:
        return isinstance(value, int | float) and not isinstance(value, bool)
    if kind is int:
        return isinstance(value, int) and not isinstance(value, bool)
    if isinstance(kind, type) and (kind in _PLAIN or issubclass(kind, Enum) or _is_ours(kind)):
        return isinstance(value, kind)
    return True


def _is_ours(kind: type) -> bool:
    return kind.__module__.startswith("workbench.")


def _text(hint: Any) -> str:
    """A type, for people."""
    parts = get_args(hint)
    if get_origin(hint) in (Union, UnionType):
        return " or ".join(map(_text, parts))
    if get_origin(hint) is tuple and parts and parts[-1] is Ellipsis:
        return f"a tuple of {_text(parts[0])}"
    names = {str: "text", float: "a number", int: "a whole number", bool: "True or False", NoneType: "None"}
    return names.get(hint, getattr(hint, "__name__", str(hint)))


def place_of(error: BaseException) -> str:
    """File and line where somebody else's code went wrong, in brackets; empty if it is unknown."""
    if isinstance(error, SyntaxError) and error.filename:
        return f" ({_short(error.filename)}, line {error.lineno})"
    frames = list(_foreign(error))
    return f" ({_short(frames[-1][0])}, line {frames[-1][1]})" if frames else ""


def _foreign(error: BaseException) -> Iterator[tuple[str, int | None]]:
    """Frames of an error that lie in other packages, or in extras of ours."""
    for frame in extract_tb(error.__traceback__):
        path = Path(frame.filename)
        is_library = _SYSTEM in path.parents and "site-packages" not in path.parts
        is_core = _HERE in path.parents and _HERE / "extras" not in path.parents
        if not (frame.filename.startswith("<") or is_library or is_core):
            yield frame.filename, frame.lineno


def _short(filename: str) -> str:
    """The file with its folder."""
    path = Path(filename)
    return f"{path.parent.name}/{path.name}" if path.name in ("__init__.py", "__main__.py") else path.name


def stops(error: BaseException) -> bool:
    """Whether an error that somebody else's code raises is meant for the program: a request to stop."""
    return isinstance(error, KeyboardInterrupt | GeneratorExit) or sys.is_finalizing()
