"""Results as JSON: plain data, finite numbers only, every list of numbers on one line."""

import json
import re
from datetime import date
from enum import Enum
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from workbench.base.advice import ask, failures
from workbench.base.files import write_text

NUMBERS = re.compile(r'\[\n\s*([^\[\]{}"]*?)\n\s*\]')
"""A list of numbers as it is indented; strings have no line breaks, so none is touched."""

Json = dict[str, Any]


def write_json(path: Path | str, content: Json) -> Path:
    """Write plain data as JSON, the whole file or nothing."""
    return write_text(path, json_text(content))


def json_text(content: Json) -> str:
    """Plain data as JSON text, every list of numbers on one line."""
    written = json.dumps(plain(content), indent=1, ensure_ascii=False, allow_nan=False) + "\n"
    return NUMBERS.sub(lambda found: "[" + " ".join(found[1].split()) + "]", written)


def document(schema: str, **content: Any) -> Json:
    """A result as plain data under its schema.

    Args:
        content: Values, or functions that compute them; one that fails leaves null and a warning.
    """
    with failures() as failed:
        made = {key: ask(f"'{key}'", partial(plain, value), None) for key, value in content.items()}
    more = {"warnings": [*(made.get("warnings") or ()), *failed]} if failed else {}
    return {"schema": schema, **made, **more}


def plain(value: Any) -> Any:
    """The same data with Python's own types: dates and enumerations as text, None for every number that is
    not finite, and of a function what it computes."""
    if callable(value):
        return plain(value())
    if isinstance(value, dict):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, list | tuple):
        return [plain(v) for v in value]
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, float):
        return value if np.isfinite(value) else None
    if isinstance(value, Enum):
        return str(value)
    return value.isoformat() if isinstance(value, date) else value
