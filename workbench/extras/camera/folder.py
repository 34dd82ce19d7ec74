"""Reading a folder with pictures or a table of their corners, joints, cameras and target.

The kind of a table is determined by its content, not its name: corners (a column `u[px]`), joints or poses.
"""

import io
import re
import tempfile
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from workbench.base.errors import FileError
from workbench.base.wording import listed
from workbench.data.dataset import Dataset
from workbench.data.readers.arrays import BLOCKS, PICTURES, arrays_in
from workbench.data.readers.columns_option import Joints
from workbench.data.readers.read import read_fields
from workbench.extras.camera.pixel_table import read_pixels
from workbench.extras.camera.rig import Rig, read_rig

TABLES = (".csv", ".tsv", ".xlsx", ".parquet")
LARGEST, MAX_FILES = 1 << 30, 20_000
"""Bytes and files of an archive that are unpacked."""
MAX_TABLES = 100
"""Tables of a folder that are looked into."""


def read_folder(
    place: Path | str, *, rig: Rig | None = None, joints: Path | None = None, dof: Joints = None
) -> Dataset:
    """Pictures, or a table of their corners, in a folder or in the only one that it holds.

    Args:
        place: The folder.
        rig: Cameras and target; None: those of its camera.toml and target.toml.
        joints: Table of the joints; None: the one beside the pictures, or joints stand with the corners.
        dof: The robot, the names of its joints in order, or their number; None: as many as the file names.
    """
    place = Path(place)
    while len(inside := [p for p in place.iterdir() if p.name[0] != "."]) == 1 and inside[0].is_dir():
        place = inside[0]
    tables = sorted(p for p in place.iterdir() if p.is_file() and p.suffix.lower() in TABLES)
    if len(tables) > MAX_TABLES:
        text = f"has more than {MAX_TABLES} tables; keep only those of the pictures"
        raise FileError(text, path=str(place))
    if rig is None:
        camera, target = place / "camera.toml", place / "target.toml"
        if not target.exists():
            text = "has no target.toml: add one, with [charuco], [[point]] or [[board]], beside the pictures"
            raise FileError(text, path=str(place))
        rig = read_rig(camera if camera.exists() else None, target)
    columns = {p: set(read_fields(p, layout="plain").values) for p in tables}
    if not tables and arrays_in({"": place}).numbers:
        columns = {place: set(read_fields(place).values)}
    corners = _only(place, [p for p, keys in columns.items() if "u" in keys])
    beside = [p for p, keys in columns.items() if "u" not in keys and keys & {"q1", "x"}]
    data = read_pixels(corners or place, rig, joints=joints or _only(place, beside), dof=dof)
    return replace(data, source=place.name)


def packed(place: Path | str) -> bytes:
    """A folder as a ZIP archive: pictures, tables and TOML files."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        for path in sorted(Path(place).rglob("*")):
            if path.suffix.lower() in (*PICTURES, *BLOCKS, *TABLES, ".toml"):
                archive.write(path, path.relative_to(place))
    return out.getvalue()


@contextmanager
def unpacked(name: str, content: bytes) -> Iterator[Path]:
    """The folder that a ZIP archive holds, as long as it is looked at; nothing is written outside of it."""
    with tempfile.TemporaryDirectory(prefix="workbench-") as folder:
        try:
            _unpack(name, content, Path(folder))
        except FileError:
            raise
        except Exception as error:  # a broken archive raises nearly anything
            why = (isinstance(error, OSError) and error.strerror) or type(error).__name__
            text = f"can't be unpacked as a ZIP archive ({why}); pack it again, without a password"
            raise FileError(text, path=name) from None
        yield Path(folder)


def _unpack(name: str, content: bytes, folder: Path) -> None:
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        files = archive.infolist()  # no file unpacks to more than it says
        if len(files) > MAX_FILES or sum(info.file_size for info in files) > LARGEST:
            raise FileError(f"unpacks to more than {LARGEST >> 20} MiB or {MAX_FILES} files", path=name)
        for info in files:
            info.filename = re.sub(r"[^\w.+ ()/-]", "_", info.filename.replace("\\", "/"))
            own = info.filename.rpartition("/")[2]
            if own.strip(".") and not own.startswith("._") and not info.filename.startswith("__MACOSX/"):
                archive.extract(info, folder)


def _only(place: Path, found: list[Path]) -> Path | None:
    """The one file; None for none."""
    if len(found) > 1:
        names = listed([p.name for p in found])
        raise FileError(f"has several files of the same kind: {names}; keep one of them", path=str(place))
    return found[0] if found else None
