"""Pictures on the page: small ones of all with their corners, drawn when these are found."""

import base64
import contextlib
from collections.abc import Mapping
from itertools import product
from pathlib import Path

import numpy as np

from workbench.base.errors import FileError
from workbench.data.dataset import Dataset
from workbench.extras.camera.camera import opencv
from workbench.extras.camera.folder import only_folder
from workbench.extras.camera.picture_files import ENDINGS, picture_files, read_picture
from workbench.extras.camera.pixel_table import plain_names
from workbench.extras.camera.rig import PictureReadings
from workbench.views.page.html import BAD, CAREFUL, GOOD, block, text

FOUND = (94, 197, 34)
"""Colour (blue, green, red) of corners as found."""
WIDTH = 160
"""Of a picture [px]."""
TELLING_CORNERS = 8
"""Corners from which on a picture tells much."""
MAX_PICTURES = 200
"""Pictures that are shown."""
SUBPIXEL = 4
"""Binary digits of parts of a pixel in OpenCV's drawings."""


def small_pictures(folder: Path, data: Dataset) -> dict[tuple[str, str], bytes]:
    """Small JPEG of every picture, or an empty one, by camera and image, with rings about its corners."""
    cv2, own = opencv(), PictureReadings.of(data)
    cameras = {camera.name: c for c, camera in enumerate(own.rig.cameras)}
    place, rows = only_folder(folder), {str(image): k for k, image in enumerate(own.image)}
    is_table = not any(p.suffix.lower() in ENDINGS for p in place.rglob("*"))
    files = [] if is_table else picture_files(place, own.rig)
    paths = {(camera, plain_names([path.name])[0]): path for camera, path in files}
    found = {}
    for camera, image in list(dict.fromkeys([*product(cameras, rows), *paths]))[:MAX_PICTURES]:
        size = own.rig.cameras[cameras[camera]].size
        scale, small = WIDTH / size[0], np.full((round(size[1] * WIDTH / size[0]), WIDTH), 41, np.uint8)
        with contextlib.suppress(FileError, KeyError):
            small = cv2.resize(
                read_picture(paths[camera, image], size), small.shape[::-1], interpolation=cv2.INTER_AREA
            )
        drawn = cv2.cvtColor(small, cv2.COLOR_GRAY2BGR)
        pixels = own.pixels[rows[image], cameras[camera]] if image in rows else np.zeros((0, 2))
        for u, v in np.round(pixels[np.isfinite(pixels).all(1)] * scale * 2.0**SUBPIXEL).astype(int).tolist():
            cv2.circle(drawn, (u, v), 4 << SUBPIXEL, FOUND, 1, cv2.LINE_AA, SUBPIXEL)
        found[camera, image] = cv2.imencode(".jpg", drawn)[1].tobytes()
    return found


def thumbnails(data: Dataset, pictures: Mapping[tuple[str, str], bytes]) -> str:
    """Small pictures, framed green, amber with few corners, or red."""
    own, found = PictureReadings.of(data), []
    seen = dict(zip(map(str, own.image), own.seen.sum(2), strict=True))
    number = {camera.name: c for c, camera in enumerate(own.rig.cameras)}
    for (camera, image), content in pictures.items():
        count = int(seen[image][number[camera]]) if image in seen else 0
        colour = GOOD if count >= TELLING_CORNERS else CAREFUL if count else BAD
        source = f"data:image/jpeg;base64,{base64.b64encode(content).decode()}"
        style = f"width:100%;border-radius:4px;display:block;outline:2px solid {colour}"
        label = f'<div style="font-size:12px;text-align:center">{text(image)} · {count}</div>'
        found.append(f'<div><img src="{source}" alt="rings: corners" style="{style}">{label}</div>')
    grid = "display:grid;grid-template-columns:repeat(4,1fr);gap:6px;margin:4px 0 8px"
    return block("".join(found), testid="thumbnails", style=grid)
