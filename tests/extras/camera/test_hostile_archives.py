"""Archives and pictures that are made to do harm: each is one sentence, and nothing leaves the folder."""

import os
import struct
import subprocess
import sys
import zipfile
import zlib
from pathlib import Path

import pytest
from binary_files import zipped
from refusals import mentions, refuses
from slow import slow

from workbench.base.errors import FileError
from workbench.extras.camera import folder as folders
from workbench.extras.camera.folder import read_folder, unpacked


def marked(content: bytes, place: int, value: int) -> bytes:
    """A ZIP with another value in the local and the central header of its first file."""
    made = bytearray(content)
    for signature, more in ((b"PK\x03\x04", 0), (b"PK\x01\x02", 2)):
        made[made.find(signature) + place + more] = value
    return bytes(made)


def inside(content: bytes) -> list[str]:
    with unpacked("shots.zip", content) as place:
        return sorted(str(path.relative_to(place)) for path in place.rglob("*") if path.is_file())


def test_no_name_leads_outside_and_what_macos_packs_beside_is_left_out():
    names = ["../../a.csv", "/etc/b.csv", "..\\..\\c.csv", "d/../../e.csv", "...", "..", "C:\\f.csv"]
    names += ["shots/0.png", "__MACOSX/shots/._0.png", "shots/._joints.csv"]
    made = inside(zipped(*((name, "x") for name in names)))
    assert made == ["C_/f.csv", "a.csv", "c.csv", "d/e.csv", "etc/b.csv", "shots/0.png"]


def test_a_link_is_a_file_of_its_text():
    link = zipfile.ZipInfo("link")
    link.external_attr = 0xA1ED0000
    with unpacked("shots.zip", zipped((link, "/etc/passwd"))) as place:
        assert not (place / "link").is_symlink()
        assert (place / "link").read_text() == "/etc/passwd"


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (marked(zipped(("a.csv", "x" * 90)), 6, 1), "without a password"),
        (marked(zipped(("a.csv", "x" * 90)), 8, 99), "can't be unpacked"),
        (zipped(("a", "x"), ("a/b", "y")), "a directory"),
        (zipped(("n" * 300, "x")), "too long"),
        (zipped(("a.csv", "x" * 90))[:40], "BadZipFile"),
    ],
    # the bytes hold the time when they were made, and every worker must collect the same names
    ids=["encrypted", "unknown compression", "file and folder", "long name", "torn"],
)
def test_a_broken_archive_is_one_sentence(content, reason):
    with pytest.raises(FileError, match=reason) as found:
        inside(content)
    assert "\n" not in str(found.value)


def test_as_many_files_as_the_bound_are_unpacked_and_one_more_or_a_bomb_is_not(monkeypatch):
    assert folders.MAX_FILES >= 10_000
    monkeypatch.setattr(folders, "MAX_FILES", 20)
    monkeypatch.setattr(folders, "LARGEST", 8 << 20)
    assert len(inside(zipped(*((f"{k}.png", "") for k in range(20))))) == 20
    bomb = zipped(*((f"{k}.png", bytes(6 << 20)) for k in range(20)))
    assert len(bomb) < 1 << 20
    for content, bound in (zipped(*((f"{k}.png", "") for k in range(21))), "20 files"), (bomb, "8 MiB"):
        with refuses(FileError, bound, path="shots.zip"):
            inside(content)


def test_a_folder_of_tables_is_not_read_one_by_one(tmp_path):
    for k in range(101):
        (tmp_path / f"{k}.csv").write_text("image,q1[rad]\n")
    with refuses(FileError, "100 tables", path=str(tmp_path)):
        read_folder(tmp_path)


def png(path: Path, side: int) -> Path:
    """A black picture whose header claims so many pixels each way."""

    def part(kind, content):
        size = struct.pack(">I", len(content))
        return size + kind + content + struct.pack(">I", zlib.crc32(kind + content))

    head, data = struct.pack(">IIBBBBB", side, side, 8, 0, 0, 0, 0), zlib.compress(bytes(101 * 100))
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + part(b"IHDR", head) + part(b"IDAT", data) + part(b"IEND", b""))
    return path


READ = """
import resource, sys
from pathlib import Path
from workbench.base.errors import FileError
from workbench.extras.camera.panels import CamerasPanel
from workbench.extras.camera.corner_detection import read_picture
from workbench.extras.camera.camera import opencv
opencv()
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
try:
    read_picture(Path(sys.argv[1]))
except FileError as error:
    print(error)
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)
"""


@pytest.mark.parametrize("side", [slow(16_000), 50_000])
def test_a_picture_that_unpacks_to_gigabytes_is_not_begun(tmp_path, side):
    command = [sys.executable, "-c", READ, png(tmp_path / "a.png", side)]
    done = subprocess.run(command, capture_output=True, text=True, env=os.environ)
    message, grown = done.stdout.splitlines()
    assert mentions(message, "250 megapixels")
    assert int(grown) < 60 * 1024  # kibibytes
