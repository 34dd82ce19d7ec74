"""Location of the files that come with the package."""

from functools import cache
from pathlib import Path

PACKAGE = Path(__file__).resolve().parent.parent


@cache
def assets() -> Path:
    """Folder of the built-in robots, plates and samples: in the package, or beside it in a checkout."""
    inside = PACKAGE / "assets"
    return inside if inside.is_dir() else PACKAGE.parent / "assets"


@cache
def built_in_robots() -> dict[str, Path]:
    """Name and file of every built-in arm."""
    return {path.stem: path for path in sorted((assets() / "robots").glob("*.toml"))}
