"""Commands as plain data and back, by their field's types; files in them go beside the journal.

A command is a frozen record of plain values, so every command is written and read by the same few rules; what
a task computed is in a file (`records.py`). A field that an older journal lacks has its default. A command
that this version doesn't know, or whose fields it can't read, is an `UnknownCommand`. A line ends with a
checksum of what comes before it.
"""

import contextlib
import dataclasses
import functools
import hashlib
import hmac
import math
import os
import re
import types
import typing
import uuid
import zlib
from collections.abc import Callable, Mapping
from enum import Enum
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np

from workbench.base.errors import MALFORMED, WorkbenchError
from workbench.base.types import frozen
from workbench.plate.plate import Plate
from workbench.session.command import AbstractCommand, UnknownCommand, kinds
from workbench.session.journal import records
from workbench.session.state import Session

INPUTS = "inputs"
"""Folder of the files that commands brought."""
LONGEST_SUFFIX = 8
CHECK = "check"
"""Name of a line's checksum, its last value."""
CHECKSUM = re.compile(rf', "{CHECK}": "([0-9a-f]{{8}})"}}\s*$'.encode())


class LostFile(Exception):
    """A file of a command is not there, or not as it was recorded."""


Load = Callable[[str], bytes]
Read = Callable[[Any, Load], Any]


def encode(command: AbstractCommand) -> tuple[dict[str, Any], dict[str, bytes]]:
    """Fields of a command as plain data, and the files in it by their place in the recording."""
    files: dict[str, bytes] = {}
    suffix = PurePosixPath(str(getattr(command, "name", ""))).suffix[:LONGEST_SUFFIX]
    ending = suffix if suffix[1:].isalnum() else ""
    return _record(command, files, ending), files


def decode(name: str, values: Mapping[str, Any], load: Load, *, title: str = "") -> AbstractCommand:
    """The command of a line; an `UnknownCommand` where no installed package takes it as it was recorded.

    Args:
        name: Of the command.
        values: Its fields.
        load: Gives the content of a file by its place in the recording, or raises `LostFile`.
        title: Of the command, as it was recorded.
    """
    kind = kinds().get(name)
    if kind is None and not name.isidentifier():
        raise ValueError(f"'{name}' is not the name of a command")
    try:
        return UnknownCommand(name, title) if kind is None else _build(kind, values, load)
    except (ValueError, KeyError, TypeError, AttributeError, OverflowError, WorkbenchError):
        return UnknownCommand(name, title)


def encode_result(result: Any, before: Session) -> tuple[dict[str, str] | None, dict[str, bytes]]:
    """Which file has what a task computed, and the file; None where reopening computes it again."""
    if result is None:
        return None, {}
    try:
        content = records.pack(result, records.known(before))
    except TypeError:  # a record of somebody else's package
        return None, {}
    return {"file": (name := file_name(content, ".npz")), "by": _by_us(name)}, {name: content}


def decode_result(stored: Mapping[str, Any] | None, load: Load) -> bytes | None:
    """The file of what a task computed; None if it is to be computed again. Recordings of November 2026
    say in the line itself which plate a search found."""
    with contextlib.suppress(*MALFORMED, WorkbenchError, LostFile):
        if stored is not None and "plate" in stored:
            return records.pack((stored, record(Plate, stored["plate"]), ""), {"plate": stored})
        if stored is not None and stored.get("by") == _by_us(name := stored.get("file", "")):
            return load(name)
    return None


def record(kind: Any, values: Mapping[str, Any], load: Load = str.encode) -> Any:
    """A record of a kind by its fields as plain data; what another version's had besides is left out."""
    return _build(kind, {name: value for name, value in values.items() if name in _readers(kind)}, load)


def digest(content: bytes) -> str:
    """By which a file's content is known."""
    return hashlib.sha256(content).hexdigest()[:20]


def origin(header: Mapping[str, Any]) -> str:
    """By which a header's machine and user are known, as far as nobody else knows the machine's number."""
    begun = f"{header.get('began')} {header.get('inputs')}".encode()
    return hmac.digest(_machine(), begun, "sha256").hex()[:20]


def _by_us(file: str) -> str:
    """By which a result's file, whose name tells its content, is known as computed here by any version."""
    return hmac.digest(_machine(), file.encode(), "sha256").hex()[:20]


@functools.cache
def _machine() -> bytes:
    """Number of this machine and user; where the system has none, that of the network card."""
    try:
        number = Path("/etc/machine-id").read_text(encoding="ascii").strip()
    except OSError:
        number = ""
    return f"{number or uuid.getnode()} {os.getuid()}".encode()


def file_name(content: bytes, ending: str) -> str:
    """Place of a file in a recording, from its content."""
    return f"{INPUTS}/{digest(content)}{ending}"


def sealed(line: str) -> str:
    """A line of the journal, a JSON object, with its checksum as the last value."""
    return f'{line[:-1]}, "{CHECK}": "{zlib.crc32(line[:-1].encode()):08x}"}}'


def is_whole(line: bytes) -> bool:
    """Whether a line is as it was written."""
    found = CHECKSUM.search(line)
    return found is not None and zlib.crc32(line[: found.start()]) == int(found[1], 16)


def _record(value: Any, files: dict[str, bytes], ending: str) -> dict[str, Any]:
    return {f.name: _plain(getattr(value, f.name), files, ending) for f in dataclasses.fields(value)}


def _plain(value: Any, files: dict[str, bytes], ending: str) -> Any:
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, tuple | list):
        return [_plain(v, files, ending) for v in value]
    if isinstance(value, bytes):
        name = file_name(value, ending)
        files[name] = value
        return {"file": name}
    if dataclasses.is_dataclass(value):
        return _record(value, files, ending)
    raise TypeError(f"a value of type {type(value).__name__} can't be written")


def _build(kind: Any, values: Mapping[str, Any], load: Load) -> Any:
    readers = _readers(kind)
    values = {name: value for name, value in values.items() if name in readers or value}
    if unknown := sorted(set(values) - set(readers)):
        raise ValueError(f"'{kind.__name__}' has no '{unknown[0]}'")
    return kind(**{name: readers[name](value, load) for name, value in values.items()})


@functools.cache
def _readers(kind: Any) -> dict[str, Read]:
    hints = typing.get_type_hints(kind)
    return {f.name: _reader(hints[f.name]) for f in dataclasses.fields(kind)}


def _reader(hint: Any) -> Read:
    """How a plain value becomes one of this type."""
    if isinstance(hint, types.UnionType) or typing.get_origin(hint) is typing.Union:
        some, *others = [kind for kind in typing.get_args(hint) if kind is not type(None)]
        read, plain = _reader(some), (type(None), *others)
        return lambda value, load: value if isinstance(value, plain) else read(value, load)
    if typing.get_origin(hint) in (tuple, list):
        each = tuple(_reader(kind) for kind in typing.get_args(hint) if kind is not ...)
        if len(each) == 1:
            return lambda value, load: tuple(each[0](v, load) for v in value)
        return lambda value, load: tuple(read(v, load) for read, v in zip(each, value, strict=True))
    if getattr(hint, "array_type", None) is np.ndarray:
        return lambda value, load: frozen(np.array(value, float))
    if hint is bytes:
        return lambda value, load: load(value["file"])
    if dataclasses.is_dataclass(hint):
        return lambda value, load: record(hint, value, load)
    if isinstance(hint, type) and issubclass(hint, bool | int | float | str | Enum):
        return lambda value, load: hint(value)
    return lambda value, load: value
