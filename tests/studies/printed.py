"""Reads what the two works print: the TOML files beside the studies."""

import tomllib
from pathlib import Path
from typing import Any


def read_printed(work: str) -> dict[str, Any]:
    """The printed numbers of a work, `aria` or `katana`, in the units that its file states."""
    return tomllib.loads((Path(__file__).parent / f"{work}_printed.toml").read_text(encoding="utf-8"))
