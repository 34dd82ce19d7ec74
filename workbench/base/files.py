"""Whole files: read with a sentence where that fails, written so that nothing is ever half-written."""

import os
import tempfile
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
