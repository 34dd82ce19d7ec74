"""Reading files and folders with clear errors, and writing them atomically."""

import contextlib
import errno
import os
import shutil
import stat
import sys
import tempfile
import zipfile
import zlib
from collections.abc import Callable, Iterator, Mapping
from contextvars import ContextVar
from functools import partial
from os.path import exists
from pathlib import Path

from workbench.base.errors import FileError

MAX_FILE_BYTES = 4 * 2**30
"""Files beyond this size are refused [bytes]: a device without end is one of them."""
CHUNK_BYTES = 16 * 2**20
STANDARD_OUTPUT = ("-", "/dev/stdout", "/dev/fd/1")
"""Names of files that mean standard output."""
_WAITING: ContextVar[list[Callable[[], None]] | None] = ContextVar("waiting", default=None)
DAMAGED = zipfile.BadZipFile, RuntimeError, NotImplementedError, EOFError, zlib.error
"""What reading a damaged archive raises."""


def open_regular(path: Path | str, flags: int) -> int:
    """Open a file that is neither a link nor a pipe or device, as in a folder that somebody else has made."""
    handle = os.open(path, flags | os.O_NOFOLLOW | os.O_NONBLOCK, 0o666)
    if stat.S_ISREG(os.fstat(handle).st_mode):
        return handle
    os.close(handle)
    raise OSError(errno.EINVAL, "it is no regular file")


def read_bytes(
    path: Path | str,
    *,
    wanted: str,
    maximum: int = MAX_FILE_BYTES,
    opener: Callable[[Path | str, int], int] | None = None,
) -> bytes:
    """Contents of a file.

    Args:
        path: Which.
        wanted: What to give instead, such as "a measurement file".
        maximum: The largest size that is read [bytes].
        opener: How it is opened; None: as usual.
    """
    parts, left = list[bytes](), maximum + 1
    try:
        with open(path, "rb", opener=opener) as file:  # all at once would have its memory beforehand
            while left > 0 and (part := file.read(min(left, CHUNK_BYTES))):
                parts.append(part)
                left -= len(part)
    except (OSError, ValueError) as error:  # a name with a zero byte is the latter
        why = error.strerror if isinstance(error, OSError) else error
        raise FileError(f"can't be opened ({why}); give {wanted}", path=str(path)) from None
    if left <= 0:
        raise FileError(f"has more than {maximum / 2**20:.0f} MiB; give {wanted}", path=str(path))
    return b"".join(parts)


def write_bytes(path: Path | str, content: bytes) -> Path:
    """Write a file; parent folders are made.

    A regular file is written beside its place, brought onto the disk, and moved there in one step. Links are
    followed; into a device or a pipe it is written directly, and `-` is standard output.
    """
    path = Path(path)
    with _file_errors(path):
        if str(path) in STANDARD_OUTPUT and (waiting := _WAITING.get()) is not None:
            waiting.append(partial(_write_through, 1, content))
        elif str(path) in STANDARD_OUTPUT:
            _write_through(1, content)
        elif exists(path) and not path.is_file():
            _write_through(os.open(path, os.O_WRONLY), content)
        else:
            _replace(Path(os.path.realpath(path)), content)
    return path


def check_ending(path: Path | str, what: str, *endings: str) -> Path:
    """The path, checked for one of the endings that promise what is written; standard output has none.

    Args:
        what: What is written, for messages: "a plate is".
    """
    path = Path(path)
    if str(path) not in STANDARD_OUTPUT and path.suffix.lower() not in endings:
        raise FileError(f"{what} written as {' or '.join(endings)}; choose this ending", path=str(path))
    return path


def check_writable(path: Path | str, *, folder: bool = False) -> None:
    """Check before any work begins that a path can be written; leaves nothing behind.

    Args:
        path: A file or folder that is to be made or replaced.
        folder: Whether it is a folder.
    """
    path = Path(path)
    if path.is_dir() and not folder:
        raise FileError("it is a folder; give the name of a file", path=str(path))
    if not folder and (str(path) in STANDARD_OUTPUT or (path.exists() and not path.is_file())):
        return
    nearest = Path(os.path.realpath(path)) if folder else Path(os.path.realpath(path)).parent
    while not os.path.lexists(nearest):
        nearest = nearest.parent
    with _file_errors(path), tempfile.TemporaryFile(dir=nearest):
        pass


@contextlib.contextmanager
def _file_errors(path: Path) -> Iterator[None]:
    """Why writing failed, in one sentence that names the file or folder."""
    try:
        yield
    except OSError as error:
        remedy = "make room" if error.errno in (errno.ENOSPC, errno.EDQUOT) else "choose a place"
        remedy += "" if remedy == "make room" else " where you may write"
        raise FileError(f"it can't be written ({error.strerror}); {remedy}", path=str(path)) from None
    except ValueError as error:  # a name with a zero byte
        raise FileError(f"it can't be written ({error}); choose another name", path=str(path)) from None


@contextlib.contextmanager
def standard_output_last() -> Iterator[list[Callable[[], None]]]:
    """Files named as standard output wait, to be written by the caller when all others are."""
    waiting: list[Callable[[], None]] = []
    token = _WAITING.set(waiting)
    try:
        yield waiting
    finally:
        _WAITING.reset(token)


def _write_through(descriptor: int, content: bytes) -> None:
    """Write into what is not a regular file, and close it unless it is standard output."""
    if descriptor == 1:
        sys.stdout.flush()
    with open(descriptor, "wb", closefd=descriptor != 1) as file:
        file.write(content)


def _replace(path: Path, content: bytes) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name[:100]}.")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        mask = os.umask(0)
        os.umask(mask)
        os.chmod(name, 0o666 & ~mask)
        os.replace(name, path)
        sync_folder(path.parent)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise


def sync_folder(folder: Path) -> None:
    """Bring the names in a folder onto the disk, where its file system can."""
    with contextlib.suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def write_text(path: Path | str, content: str) -> Path:
    """`write_bytes` for UTF-8 text."""
    return write_bytes(path, content.encode())


def write_folder(folder: Path | str, files: Mapping[str, bytes]) -> Path:
    """Write files beside the folder and, once all are on the disk, move all in or none; others in it stay.

    Args:
        folder: Made if it is not there, with its parents.
        files: Names and contents.
    """
    folder = Path(folder).absolute()
    with _file_errors(folder):
        folder.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder.parent, prefix=f".{folder.name}.") as room:
            (fresh := Path(room) / "new").mkdir()
            for name, content in files.items():
                (fresh / name).write_bytes(content)
            if not folder.exists():
                return fresh.replace(folder)
            with contextlib.ExitStack() as undo:
                for name in files:
                    there, former = folder / name, Path(room) / f"{name}.former"
                    if there.exists():
                        shutil.copy2(there, former)
                        undo.callback(os.replace, former, there)
                    else:
                        undo.callback(there.unlink, missing_ok=True)
                    os.replace(fresh / name, there)
                undo.pop_all()
    return folder


def unpacked(path: Path, endings: tuple[str, ...], largest: int, most: int) -> Path:
    """Folder beside a ZIP file with its files of these endings: at most so many, of so many bytes."""
    try:
        with zipfile.ZipFile(path) as archive:
            files = [one for one in archive.infolist() if one.filename.lower().endswith(endings)]
            files = [one for one in files if not one.filename.startswith("__MACOSX")]
            if len(files) > most or sum(one.file_size for one in files) > largest:
                text = f"holds more than {most} files and {largest // 2**20} MiB; leave out what isn't needed"
                raise FileError(text, path=path.name)
            for one in files:
                archive.extract(one, path.parent / "unpacked")  # which keeps within that folder
    except DAMAGED:
        raise FileError("is a damaged archive; pack it again", path=path.name) from None
    return path.parent / "unpacked"
