"""Writing several files into one folder: all of them, or none and the folder as it was."""

import os
import shutil
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path

from workbench.base.errors import FileError


def write_folder(folder: Path | str, files: Mapping[str, bytes], *, replaces: Iterable[str] = ()) -> Path:
    """Write files beside the folder and move them in; whatever else the folder holds stays.

    Args:
        folder: Made if it is not there, with its parents.
        files: Names and contents.
        replaces: Names of files of an older version that go, even if nothing new has their name.

    Raises:
        FileError: the folder is a file.
    """
    folder = Path(folder).absolute()
    check_folder(folder)
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder.parent, prefix=f".{folder.name}.") as room:
        fresh, old = Path(room) / "new", Path(room) / "old"
        fresh.mkdir()
        old.mkdir()
        for name, content in files.items():
            (fresh / name).write_bytes(content)
        if folder.exists():
            _exchange(folder, fresh, old, {*files, *replaces})
        else:
            os.replace(fresh, folder)
    return folder


def check_folder(folder: Path | str) -> None:
    """Refuse a folder that is a file, before anything is made for it."""
    if Path(folder).exists() and not Path(folder).is_dir():
        raise FileError("is a file; a report needs a folder, so give another name", path=str(folder))


def _exchange(folder: Path, fresh: Path, old: Path, names: set[str]) -> None:
    """Move old files out and new ones in; on any failure, back again."""
    moved_out: list[str] = []
    moved_in: list[str] = []
    try:
        for name in sorted(names):
            if (folder / name).exists():
                os.replace(folder / name, old / name)
                moved_out.append(name)
        for path in sorted(fresh.iterdir()):
            os.replace(path, folder / path.name)
            moved_in.append(path.name)
    except BaseException:
        for name in moved_in:
            (folder / name).unlink(missing_ok=True)
        for name in moved_out:
            shutil.move(old / name, folder / name)
        raise
