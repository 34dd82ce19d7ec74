"""Check of MATLAB files of version 5 to 7, whose reader takes sizes and types on trust and crashes on others.

Every element is a tag of its type and size, and as many bytes; a variable is an element of elements. They are
visited in the reader's order. Source: MAT-File Format (MathWorks), chapter "Level 5 MAT-Files".
"""

import io
import math
import struct
import zlib
from typing import BinaryIO

from workbench.base.bounded_process import MEBIBYTE, ChildError

MAX_UNPACKED_BYTES = 512 * MEBIBYTE
"""What one variable may unpack to [bytes]."""
DEEPEST = 64
"""Structs in structs."""
MATRIX, COMPRESSED = 14, 15
INT8, UINT8, UINT16, INT32, UINT32, UTF8 = 1, 2, 4, 5, 6, 16
SIZES = {INT8: 1, UINT8: 1, 3: 2, UINT16: 2, INT32: 4, UINT32: 4, 7: 4, 9: 8, 12: 8, 13: 8}
"""Bytes of a number, by its type."""
NUMBERS, INTEGERS, NAMES = frozenset(SIZES), frozenset({INT32, UINT32}), frozenset({INT8, UTF8})
TEXTS = frozenset({INT8, UINT8, UINT16, UTF8, 17, 18})
CELL, STRUCT, OBJECT, TEXT, SPARSE, NUMERIC, FUNCTION, OPAQUE = 1, 2, 3, 4, 5, range(6, 16), 16, 17


class _DamagedError(Exception):
    """An element is none that the format allows here."""


class _Inflated(io.RawIOBase):
    """What a compressed element holds, inflated only as far as it is read."""

    def __init__(self, packed: BinaryIO):
        self._packed, self._inflate = packed, zlib.decompressobj()

    def readable(self) -> bool:
        return True

    def readinto(self, buffer) -> int:
        made, given = b"", b"more"
        while given and not made:
            given = self._inflate.unconsumed_tail or self._packed.read(4096)
            made = self._inflate.decompress(given, len(buffer))
        buffer[: len(made)] = made
        return len(made)


class _Variable:
    """The elements of one variable in the order of the file; none reaches beyond the variable's end."""

    def __init__(self, stream: BinaryIO, order: str, size: int):
        self._stream, self._order, self._left = stream, order, size

    def array(self, depth: int = 0) -> None:
        """An array: flags, sizes, name, and what its class holds."""
        kind, flags = self._element({UINT32})
        if len(flags) != 8 or depth > DEEPEST:
            raise _DamagedError
        mclass, is_complex = self._integers(flags)[0] & 0xFF, bool(self._integers(flags)[0] & 0x800)
        if mclass == OPAQUE:
            for _ in range(3):
                self._element(NAMES)
            self._nested(1, depth)
            return
        shape = self._integers(self._element(INTEGERS)[1])
        self._element(NAMES)
        count = math.prod(shape)
        if (
            not 0 < len(shape) <= 32
            or max(shape) >= 2**31
            or (count > MAX_UNPACKED_BYTES and mclass != SPARSE)
        ):
            raise _DamagedError
        if mclass in NUMERIC:
            for _ in range(1 + is_complex):
                kind, numbers = self._element(NUMBERS)
                if len(numbers) // SIZES[kind] != count:
                    raise _DamagedError
        elif mclass == SPARSE:
            for _ in range(3 + is_complex):
                self._element(NUMBERS)
        elif mclass == TEXT:
            self._element(TEXTS)
        elif mclass == CELL:
            self._nested(count, depth)
        elif mclass in (STRUCT, OBJECT):
            if mclass == OBJECT:
                self._element(NAMES)
            self._nested(count * self._fields(), depth)
        elif mclass == FUNCTION:
            self._nested(1, depth)
        else:
            raise _DamagedError

    def _fields(self) -> int:
        """How many fields a struct has."""
        (length,) = self._integers(self._element(INTEGERS)[1])
        names = self._element(NAMES)[1]
        if not 0 < length < 2**31:
            raise _DamagedError
        return len(names) // length

    def _nested(self, count: int, depth: int) -> None:
        """Arrays inside this one; one of size 0 is empty."""
        if 8 * count > self._left:
            raise _DamagedError
        for _ in range(count):
            kind, size = self._integers(self._read(8))
            if kind != MATRIX:
                raise _DamagedError
            if size:
                self.array(depth + 1)

    def _element(self, kinds: frozenset[int] | set[int]) -> tuple[int, bytes]:
        """Type and content of the next element; one of up to 4 bytes stands in its tag."""
        tag = self._read(8)
        kind, size = self._integers(tag)
        if small := kind >> 16:
            kind, size = kind & 0xFFFF, min(small, 5)
        if kind not in kinds or (size == 5 and small):
            raise _DamagedError
        if small:
            return kind, tag[4 : 4 + size]
        content = self._read(size)
        self._read(min(-size % 8, self._left))
        return kind, content

    def _integers(self, content: bytes) -> tuple[int, ...]:
        return struct.unpack(f"{self._order}{len(content) // 4}I", content[: len(content) // 4 * 4])

    def _read(self, size: int) -> bytes:
        if size > self._left:
            raise _DamagedError
        self._left -= size
        content = self._stream.read(size)
        if len(content) < size:
            raise _DamagedError
        return content


def check_matlab(data: bytes) -> None:
    """Refuse the first variable that is not as the format says."""
    order, file = "<" if data[126:128] == b"IM" else ">", io.BytesIO(data)
    at, number = 128, 1
    while at < len(data):
        file.seek(at)
        try:
            kind, size = struct.unpack(f"{order}II", file.read(8))
            if at + 8 + size > len(data):
                raise _DamagedError
            _check_variable(file, order, kind, size)
        except (_DamagedError, ValueError, struct.error, zlib.error):
            raise ChildError(f"variable {number}, at byte {at}, is damaged") from None
        at, number = at + 8 + size, number + 1


def _check_variable(file: io.BytesIO, order: str, kind: int, size: int) -> None:
    stream: BinaryIO = file
    if kind == COMPRESSED:
        stream = io.BufferedReader(_Inflated(io.BytesIO(file.read(size))))
        kind, size = struct.unpack(f"{order}II", stream.read(8))
        if size > MAX_UNPACKED_BYTES:
            raise ChildError(
                f"a variable unpacks to {size >> 20} MiB; the limit is {MAX_UNPACKED_BYTES >> 20} MiB"
            )
    if kind != MATRIX or not size:
        raise _DamagedError
    _Variable(stream, order, size).array()
