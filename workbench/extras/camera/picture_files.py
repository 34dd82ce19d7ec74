"""Files of pictures: which a folder has, how they are read, what their EXIF says."""

import contextlib
import io
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path

import numpy as np
from jaxtyping import UInt8
from PIL import Image, ImageOps

from workbench.base.errors import FileError
from workbench.base.files import read_bytes
from workbench.data.readers.arrays import PICTURES
from workbench.extras.camera.rig import Rig

MAX_PIXELS = 250_000_000
"""Larger pictures are refused, as a small file may unpack to gigabytes; sensors have 150 million at most."""

Image.MAX_IMAGE_PIXELS = MAX_PIXELS
Picture = UInt8[np.ndarray, "height width"]


def picture_files(folder: Path, rig: Rig, named: Collection[str] = ()) -> Iterator[tuple[str, Path]]:
    """Name of the camera and path of every picture, in the order of their names: 2 before 10; of several with
    one stem the named one, if any is."""
    if not folder.is_dir():
        raise FileError("is not a folder of pictures", path=str(folder))
    names = [camera.name for camera in rig.cameras] or ["camera"]
    for name in names:
        own = folder if len(names) == 1 else folder / name
        inside = (own.iterdir(), own.rglob("*")) if own.is_dir() else ()
        pictures = ([p for p in some if p.suffix.lower() in PICTURES] for some in inside)
        every = (sorted(part, key=lambda p: (len(p.stem) * p.stem.isdigit(), p.name)) for part in pictures)
        found = next(filter(None, every), [])
        stems = {path.stem for path in found if path.name in named}  # of 0.jpg beside a depth 0.png
        found = [path for path in found if path.name in named or path.stem not in stems]
        files = [path.name for path in found]
        if len(set(files)) < len(files):
            again = next(file for file in files if files.count(file) > 1)
            raise FileError(
                f"has '{again}' in several folders; give every picture its own name", path=str(own)
            )
        if not found:
            raise FileError(f"has no pictures ({', '.join(PICTURES[:4])} …)", path=str(own))
        yield from ((name, path) for path in found)


def read_picture(path: Path, size: tuple[int, int] | None = None) -> Picture:
    """A picture in grey as the sensor saw it; turned as its EXIF says only where `size` [px] then fits."""

    def grey(picture: Image.Image) -> Picture:
        if picture.width * picture.height > MAX_PIXELS:
            return np.zeros((0, 0), np.uint8)
        is_turned = size not in (None, picture.size) and size == picture.size[::-1]
        picture = ImageOps.exif_transpose(picture) if is_turned else picture
        if picture.mode.startswith("I"):  # 16 bits
            return (np.asarray(picture) // 256).astype(np.uint8)
        return np.asarray(picture.convert("L"))

    with contextlib.suppress(Exception):  # Pillow stumbles over each format in its own way
        if (found := grey(Image.open(io.BytesIO(read_bytes(path, wanted="a picture"))))).size:
            return found
    raise FileError(f"can't be read as a picture of at most {MAX_PIXELS // 10**6} megapixels", path=str(path))


def readable(files: list[tuple[str, Path]], sizes: Mapping[str, tuple[int, int] | None]) -> Iterator[Picture]:
    """Those of some pictures that can be read."""
    for camera, path in files:
        with contextlib.suppress(FileError):
            yield read_picture(path, sizes[camera])
