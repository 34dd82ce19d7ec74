"""Reading the package's TOML files, with one clear sentence for each error."""

import tomllib
from abc import ABC
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any, ClassVar, TypeVar

import numpy as np

from workbench.base.arguments import admitted
from workbench.base.errors import FileError, OptionError
from workbench.base.files import exists, read_bytes
from workbench.base.types import frozen

MAX_FILE_BYTES = 16 * 2**20
"""Files beyond this size are refused [bytes]."""
MAX_TABLES = 1000
"""More tables of one name than this are refused: computing with them would take forever."""
MAX_NUMBER = 1e100
"""Numbers beyond this overflow when they are squared."""
Kind = TypeVar("Kind")


class AbstractTableReader(ABC):
    """One file being read: how values must look; a reader extends it with what its tables mean."""

    wanted: ClassVar[str]
    """What to give instead of a file that is none, such as `a plate TOML`."""
    otherwise: ClassVar[str]
    """What to give instead of a file that is missing."""

    def __init__(self, path: Path | str):
        self.path = str(path)

    def load(self) -> dict[str, Any]:
        """The file's tables."""
        if not exists(self.path):
            raise self.fail(f"no such file; give {self.otherwise}")
        content = read_bytes(self.path, wanted=self.wanted, maximum=MAX_FILE_BYTES)
        try:
            return tomllib.loads(content.decode("utf-8-sig"))
        except UnicodeDecodeError as error:
            raise self.fail(f"can't be read as a text file ({error}); give {self.wanted}") from None
        except ValueError as error:  # of TOML, or of a number with thousands of digits
            raise self.fail(f"is not valid TOML: {error}; give {self.wanted}") from None
        except RecursionError:
            raise self.fail("is not valid TOML: it has too many brackets within brackets") from None

    def fail(self, message: str) -> FileError:
        return FileError(message, path=self.path)

    def number(self, value: Any, what: str) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < MAX_NUMBER:
            raise self.fail(f"{what} must be a finite number, not {value!r}")
        return float(value)

    def numbers(self, value: Any, count: int | None, what: str) -> np.ndarray:
        """So many numbers, or any number of them but none."""
        if not isinstance(value, list) or not value or count not in (None, len(value)):
            wanted = "numbers" if count is None else f"{count} numbers"
            raise self.fail(f"{what} must be a list of {wanted}, not {value!r}")
        return frozen(np.array([self.number(v, what) for v in value]))

    def table(self, value: Any, what: str) -> dict[str, Any]:
        if not isinstance(value, dict):
            raise self.fail(f"{what} must be a table of keys and values, not {value!r}")
        return value

    def tables(self, data: dict[str, Any], key: str) -> list[dict[str, Any]]:
        """The `[[key]]` tables; none where the key is missing."""
        value = data.get(key, [])
        if not isinstance(value, list):
            raise self.fail(f"{key} must be given as [[{key}]] tables, with two brackets, not as {value!r}")
        if len(value) > MAX_TABLES:
            raise self.fail(f"has {len(value)} [[{key}]] tables; give at most {MAX_TABLES}")
        return [self.table(entry, f"[[{key}]] {i + 1}") for i, entry in enumerate(value)]

    def keys(self, table: Any, known: set[str], what: str) -> None:
        """Refuse keys that mean nothing."""
        if unknown := sorted(set(self.table(table, what)) - known):
            raise self.fail(f"{what} has the unknown key '{unknown[0]}'; known: {', '.join(sorted(known))}")

    def record(self, kind: type[Kind], given: Any, what: str) -> Kind:
        """A dataclass whose fields are a table's keys, checked by their annotations; numbers are finite."""
        known = {f.name: f for f in fields(kind)}  # type: ignore[arg-type]
        self.keys(given, set(known), what)
        needed = [name for name, f in known.items() if f.default is f.default_factory is MISSING]
        if missing := [name for name in needed if name not in given]:
            raise self.fail(f"{what} has no {missing[0]}; give {', '.join(needed)}")
        try:
            return kind(**admitted(kind, given, is_finite=True))
        except OptionError as error:
            raise self.fail(f"{what}: {error}") from None
