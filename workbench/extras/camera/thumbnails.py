"""All pictures of a folder, small, with the corners that were found."""

import base64
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from workbench.base.wording import plural
from workbench.data.dataset import Dataset
from workbench.extras.camera.capture import Previews
from workbench.extras.camera.opencv import opencv
from workbench.extras.camera.readings import PictureReadings
from workbench.views.page.html import BAD, CAREFUL, GOOD, text

WIDTH, QUALITY = 160, 60
"""Width [px] and quality of a small picture."""
TELLING_CORNERS = 8
"""Corners from which on a picture tells much."""
MAX_PICTURES = 200
"""Pictures that are shown."""


class Thumbnail(NamedTuple):
    """A small picture: its name and its HTML."""

    image: str
    html: str


@lru_cache(maxsize=2)
def thumbnails(data: Dataset, previews: Previews | None) -> tuple[Thumbnail, ...]:
    """Of all pictures, those without the target last."""
    own = PictureReadings.of(data)
    rows = {str(image): k for k, image in enumerate(own.image)}
    known = {} if previews is None else previews.by_image
    keys = dict.fromkeys([*((camera.name, image) for image in rows for camera in own.rig.cameras), *known])
    number = {camera.name: c for c, camera in enumerate(own.rig.cameras)}
    found = []
    for name, image in list(keys)[:MAX_PICTURES]:
        c = number[name]
        pixels = own.pixels[rows[image], c] if image in rows else np.zeros((0, 2))
        html = _html(
            image, own.rig.cameras[c].size, pixels[np.isfinite(pixels).all(1)], known.get((name, image))
        )
        found.append(Thumbnail(image, html))
    return tuple(found)


def _html(image: str, size: tuple[int, int], seen: Float[np.ndarray, "n 2"], picture: bytes | None) -> str:
    """A picture framed green with its corners; amber with few, red where it has none."""
    width, height = size
    back = f'<rect width="{width}" height="{height}" fill="#1f2937"/>'
    if picture is not None:
        data = base64.b64encode(_small(picture)).decode()
        back += f'<image width="{width}" height="{height}" href="data:image/jpeg;base64,{data}"/>'
    colour = GOOD if len(seen) >= TELLING_CORNERS else CAREFUL if len(seen) else BAD
    dots = "".join(f"M{u:.0f} {v:.0f}h0" for u, v in seen)
    title = f"{image}: {plural(len(seen), 'corner')}" if len(seen) else f"{image}: no corners"
    return (
        f'<svg viewBox="0 0 {width} {height}" width="100%" role="img" style="display:block;border-radius:3px;'
        f'outline:2px solid {colour}"><title>{text(title)}</title>{back}'
        f'<path d="{dots}" stroke="#22c55e" stroke-width="{width / 40:.0f}" stroke-linecap="round"/></svg>'
        f'<div style="font-size:12px;text-align:center">{text(image)} · {len(seen)}</div>'
    )


def _small(picture: bytes) -> bytes:
    cv2 = opencv("showing pictures")
    read = cv2.imdecode(np.frombuffer(picture, np.uint8), cv2.IMREAD_GRAYSCALE)
    part = WIDTH / read.shape[1]
    shrunk = cv2.resize(read, None, fx=part, fy=part, interpolation=cv2.INTER_AREA)
    return cv2.imencode(".jpg", shrunk, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])[1].tobytes()
