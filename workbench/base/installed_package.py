"""The distribution that this package is installed from: its version, and the command that installs an extra.

The distribution has a longer name than the package, since another project's is called `workbench`: installing
that name from a package index fetches the other project. Every text therefore names the checkout.
"""

from pathlib import Path

NAME = "arm-calibration-workbench"


def install_command(extra: str = "") -> str:
    """What to type in a checkout of the project, with an extra or without."""
    checkout = f"'.[{extra}]'" if extra else "."
    return f"pip install -e {checkout}"


def package_version() -> str:
    """The installed version, or that of the project's file where the package is run from its source."""
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version(NAME)
    except PackageNotFoundError:
        return _source_version()


def _source_version() -> str:
    import tomllib

    project = Path(__file__).resolve().parents[2] / "pyproject.toml"
    try:
        table = tomllib.loads(project.read_text(encoding="utf-8"))["project"]
    except (OSError, KeyError, tomllib.TOMLDecodeError):
        return "unknown"
    return f"{table.get('version', 'unknown')} (source)"
