"""Robots as xacro: expanded to URDF with arguments, as `xacro FILE name:=value` does."""

import atexit
import shutil
import tempfile
from pathlib import Path

from workbench.base.errors import FileError, MissingExtraError


def expand_xacro(path: Path | str, arguments: dict[str, str]) -> Path:
    """The URDF of a xacro, in a folder that is gone when the program ends.

    Packages are looked for beside the file, in the folders above it, and where ROS has them.

    Raises:
        FileError: it can't be expanded; says why.
    """
    try:
        from xacrodoc import XacroDoc
    except ImportError:
        raise MissingExtraError("reading xacro", extra="xacro") from None
    if not Path(path).is_file():
        raise FileError("there is no such file; give a .xacro", path=str(path))
    folder = Path(tempfile.mkdtemp(prefix="workbench-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    urdf = folder / Path(path).name.removesuffix(".xacro").removesuffix(".urdf")
    urdf = urdf.with_suffix(".urdf")
    try:
        XacroDoc.from_file(str(path), subargs=arguments).to_urdf_file(str(urdf))
    except Exception as error:  # xacro raises many kinds for a malformed file or a missing package
        why = f"{type(error).__name__}: {error}"
        raise FileError(
            f"can't be expanded ({why}); arguments are given as name:=value", path=str(path)
        ) from None
    return urdf
