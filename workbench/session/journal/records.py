"""Results of tasks as files, so that a recording is opened by reading instead of computing.

A file is an archive of numpy's: the result's arrays, and as JSON every other object in it once, those within
it before it. Only frozen records of this program, enums, collections and plain values are written; reading
calls their constructors and nothing else, so that a file from anybody runs no code of its own. What a record
has worked out besides its fields is worked out again when it is asked for. What the session has as well
(`known`) stands there by name, and is the session's own object again.
"""

import dataclasses
import io
import json
import zipfile
from collections.abc import Callable, Mapping
from enum import Enum
from importlib import import_module
from typing import Any

import numpy as np

from workbench.base.types import frozen
from workbench.session.state import Session

OBJECTS = "objects"
LARGEST = 2**30
"""Files that take more room than this once unpacked are not read [bytes]."""
COLLECTIONS: dict[str, Callable[[list], Any]] = {k.__name__: k for k in (tuple, list, frozenset, set)}


def known(session: Session) -> dict[str, Any]:
    """What results share with the session in which they were computed."""
    loaded = session.measurements.loaded
    of_rows = {} if loaded is None else {"loaded": loaded, "dataset": loaded.dataset, "checks": loaded.checks}
    own = {"robot": session.robot, "plate": session.plate, "diagnosis": session.results.diagnosis}
    return own | of_rows


def pack(value: Any, shared: Mapping[str, Any]) -> bytes:
    """The content of a file.

    Raises:
        TypeError: something in it that can't be read again.
    """
    names = {id(own): name for name, own in shared.items() if own is not None}
    places, objects, arrays = dict[int, int](), list[Any](), dict[str, Any]()

    def plain(value: Any) -> Any:
        if isinstance(value, np.generic):
            value = value.item()
        if value is None or type(value) in (bool, int, float, str):
            return value
        if id(value) not in places:
            made = ["known", names[id(value)]] if id(value) in names else written(value)
            places[id(value)] = len(objects)
            objects.append(made)
        return [places[id(value)]]

    def written(value: Any) -> list[Any]:
        kind = type(value)
        if isinstance(value, np.ndarray) and value.dtype != object:
            arrays[f"a{len(arrays)}"] = value
            return ["array", f"a{len(arrays) - 1}"]
        if isinstance(value, Mapping):
            return ["dict", [[plain(name), plain(one)] for name, one in value.items()]]
        if kind.__name__ in COLLECTIONS and kind.__module__ == "builtins":
            return [kind.__name__, [plain(one) for one in value]]
        if isinstance(value, Enum):
            return ["enum", _name_of(kind), plain(value.value)]
        return ["record", _name_of(kind), {name: plain(one) for name, one in _given(value).items()}]

    plain([value])  # the last object is a list of it
    arrays[OBJECTS] = np.frombuffer(json.dumps(objects).encode(), np.uint8)
    np.savez(content := io.BytesIO(), allow_pickle=False, **arrays)  # to compress it takes longer
    return content.getvalue()


def unpack(content: bytes, shared: Mapping[str, Any]) -> Any:
    """The result again; it raises nearly anything for a file that was not written by this version."""
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        if sum(one.file_size for one in archive.infolist()) > LARGEST:
            raise ValueError("takes too much room")
    made: list[Any] = []

    def value(given: Any) -> Any:
        return made[given[0]] if isinstance(given, list) else given

    with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
        for kind, what, *more in json.loads(arrays[OBJECTS].tobytes()):
            if kind == "known":
                made.append(shared[what])
            elif kind == "array":
                made.append(frozen(arrays[what]))
            elif kind == "dict":
                made.append({value(name): value(one) for name, one in what})
            elif kind == "enum":
                made.append(_kind(what, Enum)(value(more[0])))
            elif kind == "record":
                made.append(_kind(what, object)(**{name: value(one) for name, one in more[0].items()}))
            else:
                made.append(COLLECTIONS[kind]([value(one) for one in what]))
    return made[-1][0]


def _name_of(kind: type) -> str:
    name = f"{kind.__module__}:{kind.__qualname__}"
    _kind(name, object)
    return name


def _kind(name: str, base: type) -> type:
    """A frozen record, a named tuple or an enum of this program."""
    module, _, own = name.partition(":")
    if not module.startswith("workbench.") or "__" in module:
        raise TypeError(f"{name} is none of this program's records")
    kind = getattr(import_module(module), own)
    if not (isinstance(kind, type) and issubclass(kind, base) and kind.__module__ == module):
        raise TypeError(f"{name} is no class there")
    settings = getattr(kind, "__dataclass_params__", None)
    if not (issubclass(kind, Enum) or hasattr(kind, "_fields") or (settings and settings.frozen)):
        raise TypeError(f"{name} is no frozen record")
    return kind


def _given(value: Any) -> dict[str, Any]:
    """What its constructor was given, but for defaults."""
    if hasattr(value, "_asdict"):
        return value._asdict()
    fields = ((f, getattr(value, f.name)) for f in dataclasses.fields(value) if f.init)
    return {f.name: one for f, one in fields if one is not f.default}
