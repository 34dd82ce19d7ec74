"""Pictures on the page: small ones of all with their corners."""

import base64
from functools import lru_cache

import numpy as np
from jaxtyping import Float

from workbench.data.dataset import Dataset
from workbench.extras.camera.opencv import opencv
from workbench.extras.camera.rig import PictureReadings
from workbench.extras.camera.session_commands import Previews
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


def _drawn(picture: bytes | None, size: tuple[int, int], found: Float[np.ndarray, "points 2"]) -> str:
    """A picture, or an empty one, with rings about its corners."""
    cv2, scale = opencv(), WIDTH / size[0]
    image = np.full((round(size[1] * scale), WIDTH, 3), (55, 41, 31), np.uint8)
    if picture is not None:
        read = cv2.imdecode(np.frombuffer(picture, np.uint8), cv2.IMREAD_COLOR)
        image = cv2.resize(read, image.shape[1::-1], interpolation=cv2.INTER_AREA)
    for u, v in np.round(found[np.isfinite(found).all(1)] * scale * 2.0**SUBPIXEL).astype(int).tolist():
        cv2.circle(image, (u, v), 4 << SUBPIXEL, FOUND, 1, cv2.LINE_AA, SUBPIXEL)
    content = base64.b64encode(cv2.imencode(".jpeg", image)[1].tobytes()).decode()
    style = "width:100%;border-radius:4px;display:block"
    return f'<img src="data:image/jpeg;base64,{content}" alt="rings: corners" style="{style}">'


@lru_cache(maxsize=2)
def thumbnails(data: Dataset, previews: Previews | None) -> str:
    """Small pictures by their images, framed green, amber with few corners, or red; those without last."""
    own = PictureReadings.of(data)
    rows = {str(image): k for k, image in enumerate(own.image)}
    number = {camera.name: c for c, camera in enumerate(own.rig.cameras)}
    known = {} if previews is None else previews.by_image
    keys = dict.fromkeys([*((camera, image) for image in rows for camera in number), *known])
    found = []
    for name, image in list(keys)[:MAX_PICTURES]:
        c = number[name]
        pixels = own.pixels[rows[image], c] if image in rows else np.zeros((0, 2))
        count = int(np.isfinite(pixels).all(1).sum())
        colour = GOOD if count >= TELLING_CORNERS else CAREFUL if count else BAD
        small = _drawn(known.get((name, image)), own.rig.cameras[c].size, pixels)
        frame = f"outline:2px solid {colour};border-radius:4px"
        label = f'<div style="font-size:12px;text-align:center">{text(image)} · {count}</div>'
        found.append(f'<div><div style="{frame}">{small}</div>{label}</div>')
    grid = "display:grid;grid-template-columns:repeat(4,1fr);gap:6px;margin:4px 0 8px"
    return block("".join(found), testid="thumbnails", style=grid)
