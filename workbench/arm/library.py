"""The arms that come with the package, and one door for a file or a built-in name."""

from functools import cache
from pathlib import Path

from workbench.arm.robot import Robot
from workbench.arm.robot_toml import read_toml
from workbench.base.errors import FileError

PACKAGE = Path(__file__).resolve().parent.parent


@cache
def assets() -> Path:
    """Folder of the built-in robots, plates and samples: in the package, or beside it in a checkout."""
    inside = PACKAGE / "assets"
    return inside if inside.is_dir() else PACKAGE.parent / "assets"


def built_in_robots() -> dict[str, Path]:
    """Name and file of every built-in arm."""
    return {path.stem: path for path in sorted((assets() / "robots").glob("*.toml"))}


def load_robot(source: Path | str, *, tip: str | None = None) -> Robot:
    """A robot from a TOML or URDF file, or a built-in arm by name (`aria`, `katana450`, …).

    Raises:
        FileError: neither a file nor a built-in name, or a file that is no robot.
    """
    built_in = built_in_robots()
    if str(source).lower() in built_in:
        return read_toml(built_in[str(source).lower()])
    path = Path(source)
    if path.suffix.lower() in (".urdf", ".xml"):
        from workbench.arm.urdf import read_urdf

        return read_urdf(path, tip=tip)
    if path.suffix.lower() != ".toml":
        raise FileError(
            f"is neither a .toml nor a .urdf file nor a built-in arm; built in are {', '.join(built_in)}",
            path=str(source),
        )
    return read_toml(path)
