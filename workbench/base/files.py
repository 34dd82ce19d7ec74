"""Files and folders of files, read with a clear error and written whole or not at all."""

import os
import shutil
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path

from workbench.base.errors import FileError


def read_bytes(path: Path | str, *, wanted: str) -> bytes:
    """Contents of a file.

    Args:
        path: Which.
        wanted: What to give instead, such as "a measurement file".

    Raises:
        FileError: it can't be opened.
    """
    try:
        return Path(path).read_bytes()
    except OSError as error:
        raise FileError(f"can't be opened ({error.strerror}); give {wanted}", path=str(path)) from None


def write_bytes(path: Path | str, content: bytes) -> Path:
    """Write a whole file beside its place and move it there in one step; parent folders are made.

    Raises:
        FileError: it can't be written there.
    """
    path = Path(path)
    try:
        return _write(path, content)
    except OSError as error:
        raise FileError(
            f"it can't be written ({error.strerror}); choose a place where you may write", path=str(path)
        ) from None


def check_writable(path: Path | str, *, folder: bool = False) -> None:
    """Refuse a place where nothing can be written before any work begins; leaves nothing there.

    Args:
        path: A file or folder that is to be made or replaced.
        folder: Whether it is a folder.

    Raises:
        FileError: it can't be written there.
    """
    path = Path(path)
    if path.is_dir() and not folder:
        raise FileError("it is a folder; give the name of a file", path=str(path))
    nearest = path.absolute() if folder else path.absolute().parent
    while not os.path.lexists(nearest):
        nearest = nearest.parent
    try:
        with tempfile.TemporaryFile(dir=nearest):
            pass
    except OSError as error:
        raise FileError(
            f"nothing can be written there ({error.strerror}); choose a place where you may write",
            path=str(path),
        ) from None


def _write(path: Path, content: bytes) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
        mask = os.umask(0)
        os.umask(mask)
        os.chmod(name, 0o666 & ~mask)
        os.replace(name, path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise
    return path


def write_text(path: Path | str, content: str) -> Path:
    """`write_bytes` for UTF-8 text."""
    return write_bytes(path, content.encode())


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
