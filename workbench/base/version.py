"""Which version of the package this is."""

import tomllib
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path


def package_version() -> str:
    """The installed version, or the one that the project's file names."""
    try:
        return version("workbench")
    except PackageNotFoundError:
        return _source_version()


def _source_version() -> str:
    """The version in the project's file, where the package is run from its source and not installed."""
    project = Path(__file__).resolve().parents[2] / "pyproject.toml"
    try:
        table = tomllib.loads(project.read_text(encoding="utf-8"))["project"]
    except (OSError, KeyError, tomllib.TOMLDecodeError):
        return "unknown"
    return f"{table.get('version', 'unknown')} (source)"
