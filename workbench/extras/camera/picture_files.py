"""Files of pictures: which a folder has, how they are read, how sharp they are."""

import contextlib
import struct
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import UInt8
from PIL import Image

from workbench.base.errors import FileError
from workbench.base.files import read_bytes
from workbench.base.wording import listed, plural
from workbench.extras.camera.opencv import MAX_PIXELS, opencv
from workbench.extras.camera.rig import Rig

ENDINGS = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".pgm", ".webp")
ORIENTATION, DETAILS, FILM_FOCAL = 0x0112, 0x8769, 0xA405
"""EXIF's tags of how a picture is to be turned, of what it says in detail, and of the focal length [mm] …"""
FILM = 43.27
"""… on film of this diagonal [mm] with the same field of view."""

Image.MAX_IMAGE_PIXELS = MAX_PIXELS
Picture = UInt8[np.ndarray, "height width"]


def picture_files(folder: Path, rig: Rig) -> Iterator[tuple[str, Path]]:
    """Name of the camera and path of every picture, in the order of their names."""
    if not folder.is_dir():
        raise FileError("is not a folder of pictures", path=str(folder))
    names = [camera.name for camera in rig.cameras] or ["camera"]
    for name in names:
        own = folder if len(names) == 1 else folder / name
        inside = (own.iterdir(), own.rglob("*")) if own.is_dir() else ()
        every = (sorted((p for p in some if p.suffix.lower() in ENDINGS), key=_counting) for some in inside)
        found = next(filter(None, every), [])
        files = [path.name for path in found]
        if len(set(files)) < len(files):
            again = next(file for file in files if files.count(file) > 1)
            raise FileError(
                f"has '{again}' in several folders; give every picture its own name", path=str(own)
            )
        if not found:
            raise FileError(f"has no pictures ({', '.join(ENDINGS[:4])} …)", path=str(own))
        yield from ((name, path) for path in found)


def _counting(path: Path) -> tuple[int, str]:
    """Names in the order in which people count: 2 before 10."""
    return len(path.stem) if path.stem.isdigit() else 0, path.name


def read_picture(path: Path, size: tuple[int, int] | None = None) -> Picture:
    """A picture in grey as the sensor saw it; turned as its EXIF says only where `size` [px] then fits."""
    cv2 = opencv()
    found: list[Picture] = []
    content = read_bytes(path, wanted="a picture")
    for each, flag in ((_unturned(content), cv2.IMREAD_IGNORE_ORIENTATION), (content, 0)):
        with contextlib.suppress(cv2.error):  # of more than `MAX_PIXELS`, or empty
            picture = cv2.imdecode(np.frombuffer(each, np.uint8), cv2.IMREAD_GRAYSCALE | flag)
            found += [] if picture is None else [picture]
        if found and size in (None, found[-1].shape[::-1]):
            return found[-1]
    if not found:
        raise FileError(
            f"can't be read as a picture of at most {MAX_PIXELS // 10**6} megapixels", path=str(path)
        )
    return found[0]


def _unturned(content: bytes) -> bytes:
    """A picture; a TIFF without how it is to be turned, as OpenCV turns every one, or fails to."""
    order = {b"II*\0": "<", b"MM\0*": ">"}.get(content[:4])
    if order is None:
        return content
    changed = bytearray(content)
    with contextlib.suppress(struct.error):
        (start,) = struct.unpack_from(f"{order}I", content, 4)
        (count,) = struct.unpack_from(f"{order}H", content, start)
        for entry in range(start + 2, start + 2 + 12 * count, 12):
            if struct.unpack_from(f"{order}H", content, entry)[0] == ORIENTATION:
                struct.pack_into(f"{order}H", changed, entry + 8, 1)
    return bytes(changed)


def readable(files: list[tuple[str, Path]], sizes: Mapping[str, tuple[int, int] | None]) -> Iterator[Picture]:
    """Those of some pictures that can be read."""
    for camera, path in files:
        with contextlib.suppress(FileError):
            yield read_picture(path, sizes[camera])


def _by_pillow(path: Path, read: Callable[[Image.Image], Any]) -> Any:
    """What Pillow finds in a picture; None where it stumbles over it, each format in its own way."""
    with contextlib.suppress(Exception), Image.open(path) as picture:
        return read(picture)
    return None


def exif_note(paths: list[Path]) -> Iterator[str]:
    """A sentence on pictures whose EXIF says that they are to be turned."""
    turns = {p.name: _by_pillow(p, lambda found: found.getexif().get(ORIENTATION)) for p in paths}
    turned = [name for name, turn in turns.items() if turn not in (None, 1)]
    if turned:
        yield (
            f"{plural(len(turned), 'picture')} with an EXIF rotation, {listed(turned, longest=3)}: it is "
            "ignored, unless only the rotated ones have the camera's size"
        )


def exif_focal(path: Path, size: tuple[int, int]) -> float | None:
    """Focal length [px] of a picture of this size by EXIF; None where it says none."""
    focal = _by_pillow(path, lambda found: float(found.getexif().get_ifd(DETAILS).get(FILM_FOCAL, 0.0)))
    return focal / FILM * float(np.hypot(*size)) if focal and focal > 0.0 else None


def blur(picture: Picture) -> float:
    """How wide edges are in a picture [px, standard deviation], noise smoothed away first; inf without any.

    A blurred step has slopes g ∝ exp(−t²/2σ²), and ∫g² / ∫g'² = 2σ².
    """
    cv2 = opencv()
    soft = cv2.GaussianBlur(picture, (0, 0), 1.0).astype(np.float32)
    dx, dy = cv2.Sobel(soft, cv2.CV_32F, 1, 0) / 8.0, cv2.Sobel(soft, cv2.CV_32F, 0, 1) / 8.0
    slope = np.hypot(dx, dy)
    steep = slope > max(0.25 * float(np.percentile(slope, 99.5)), 1.0)
    if not steep.any():
        return float("inf")
    bend = cv2.Sobel(dx, cv2.CV_32F, 1, 0) / 8.0 + cv2.Sobel(dy, cv2.CV_32F, 0, 1) / 8.0
    near = cv2.dilate(steep.astype(np.uint8), np.ones((7, 7), np.uint8)).astype(bool)
    ratio = float((slope[near] ** 2).mean()) / max(float((bend[near] ** 2).mean()), 1e-12)
    return float(np.sqrt(max(0.5 * ratio - 1.0, 0.0)))
