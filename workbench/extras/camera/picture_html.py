"""Pictures on the page: small ones of all with their corners, and what they cover."""

import base64
from collections.abc import Mapping
from functools import lru_cache

import numpy as np
from jaxtyping import Float

from workbench.base.wording import plural
from workbench.data.dataset import Dataset
from workbench.extras.camera.opencv import opencv
from workbench.extras.camera.rig import PictureReadings
from workbench.extras.camera.session_commands import Previews
from workbench.views.page.html import BAD, CAREFUL, GOOD, badge, text

FOUND = (94, 197, 34)
"""Colour (blue, green, red) of corners as found."""
WIDTH = 160
"""Of a picture [px]."""
COLUMNS, ROWS = 8, 6
"""Cells into which a picture is divided to say how much of it was used."""
WELL_USED_SHARE = 0.6
"""Part of the picture that is well used."""
TELLING_CORNERS = 8
"""Corners from which on a picture tells much."""
MAX_PICTURES = 200
"""Pictures that are shown."""
SUBPIXEL = 4
"""Binary digits of parts of a pixel in OpenCV's drawings."""


def _drawn(picture: bytes | None, size: tuple[int, int], found: Float[np.ndarray, "points 2"]) -> str:
    """A picture, or an empty one, with rings about its corners."""
    cv2, scale = opencv(), WIDTH / size[0]
    image = np.full((round(size[1] * scale), WIDTH, 3), (55, 41, 31), np.uint8)
    if picture is not None:
        read = cv2.imdecode(np.frombuffer(picture, np.uint8), cv2.IMREAD_COLOR)
        image = cv2.resize(read, image.shape[1::-1], interpolation=cv2.INTER_AREA)
    for u, v in np.round(found[np.isfinite(found).all(1)] * scale * 2.0**SUBPIXEL).astype(int).tolist():
        cv2.circle(image, (u, v), 4 << SUBPIXEL, FOUND, 1, cv2.LINE_AA, SUBPIXEL)
    return _image(image, "rings: corners", "picture", "width:100%;border-radius:4px;display:block")


def _image(image: np.ndarray, caption: str, testid: str, style: str) -> str:
    kind, name = "png" if image.shape[2] == 4 else "jpeg", text(caption)
    content = base64.b64encode(opencv().imencode(f".{kind}", image)[1].tobytes()).decode()
    address = f"data:image/{kind};base64,{content}"
    return f'<img src="{address}" alt="{name}" title="{name}" data-testid="{testid}" style="{style}">'


@lru_cache(maxsize=2)
def thumbnails(data: Dataset, previews: Previews | None) -> Mapping[str, str]:
    """Small pictures in HTML by image, framed green, amber with few corners, or red; those without last."""
    own = PictureReadings.of(data)
    rows = {str(image): k for k, image in enumerate(own.image)}
    number = {camera.name: c for c, camera in enumerate(own.rig.cameras)}
    known = {} if previews is None else previews.by_image
    keys = dict.fromkeys([*((camera, image) for image in rows for camera in number), *known])
    found: dict[str, str] = {}
    for name, image in list(keys)[:MAX_PICTURES]:
        c = number[name]
        pixels = own.pixels[rows[image], c] if image in rows else np.zeros((0, 2))
        count = int(np.isfinite(pixels).all(1).sum())
        colour = GOOD if count >= TELLING_CORNERS else CAREFUL if count else BAD
        small = _drawn(known.get((name, image)), own.rig.cameras[c].size, pixels)
        frame = f"outline:2px solid {colour};border-radius:4px"
        label = f'<div style="font-size:12px;text-align:center">{text(image)} · {count}</div>'
        found[image] = f'{found.get(image, "")}<div style="{frame}">{small}</div>{label}'
    return found


@lru_cache(maxsize=4)
def cells(data: Dataset, camera: int) -> Float[np.ndarray, "rows columns"]:
    """How many corners each cell of a camera's pictures has, over all of them."""
    own = PictureReadings.of(data)
    seen, (width, height) = own.pixels[:, camera][own.seen[:, camera]], own.rig.cameras[camera].size
    ends = (0.0, height), (0.0, width)
    return np.histogram2d(seen[:, 1], seen[:, 0], bins=(ROWS, COLUMNS), range=ends)[0]


def covered(cells: Float[np.ndarray, "rows columns"]) -> str:
    """How much of the picture has corners, and which parts of it."""
    share = float((cells > 0).mean())
    used = f"{100 * share:.0f} % of the picture used"
    shade = np.where(cells > 0, 0.3 + 0.7 * cells / max(float(cells.max()), 1.0), 0.0)
    grid = np.append(np.tile(np.array(FOUND, float), (*cells.shape, 1)), 255.0 * shade[..., None], axis=2)
    look = "width:96px;image-rendering:pixelated;outline:1px solid"
    picture = _image(grid.astype(np.uint8), plural(int(cells.sum()), "corner"), "cells", look)
    content = badge(used, GOOD if share > WELL_USED_SHARE else CAREFUL)
    row = "display:flex;gap:10px;align-items:center;margin-top:6px"
    return f'<div style="{row}">{picture}<span data-testid="coverage">{content}</span></div>'
