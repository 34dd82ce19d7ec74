"""Pictures on the page: with their corners as found and predicted, small ones of all, and what they cover."""

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

FOUND, MODEL, FAR = (94, 197, 34), (94, 63, 244), (11, 158, 245)
"""Colours (blue, green, red) of corners as found, as the model puts them, and of what lies between."""
LARGE, SMALL = 720, 160
"""Widths of pictures [px]."""
ARROWS = 20.0
"""How many times residuals are drawn."""
WELL_USED_SHARE = 0.6
"""Part of the picture that is well used."""
TELLING_CORNERS = 8
"""Corners from which on a picture tells much."""
MAX_PICTURES = 200
"""Pictures that are shown."""
SUBPIXEL = 4
"""Binary digits of parts of a pixel in OpenCV's drawings."""


def drawn(
    picture: bytes | None,
    size: tuple[int, int],
    found: Float[np.ndarray, "points 2"],
    model: Float[np.ndarray, "points 2"] | None = None,
    *,
    width: int = LARGE,
) -> str:
    """A picture, or an empty one, with corners as found (rings) and as the model has them (crosses)."""
    cv2, scale = opencv(), width / size[0]
    image = np.full((round(size[1] * scale), width, 3), (55, 41, 31), np.uint8)
    if picture is not None:
        read = cv2.imdecode(np.frombuffer(picture, np.uint8), cv2.IMREAD_COLOR)
        image = cv2.resize(read, image.shape[1::-1], interpolation=cv2.INTER_AREA)
    rings = found * scale
    crosses = np.full_like(rings, np.nan) if model is None else model * scale
    for ring, cross in zip(rings, crosses, strict=True):
        is_found, is_predicted = np.isfinite(ring).all(), np.isfinite(cross).all()
        if is_predicted:
            cv2.drawMarker(image, _near(cross), MODEL, cv2.MARKER_CROSS, 9)
        if is_found:
            place = _near(ring * 2.0**SUBPIXEL)
            cv2.circle(image, place, 4 << SUBPIXEL, FOUND, 1, cv2.LINE_AA, SUBPIXEL)
        if is_found and is_predicted:
            end = _near((ring + ARROWS * (ring - cross)) * 2.0**SUBPIXEL)
            cv2.line(image, place, end, FAR, 1, cv2.LINE_AA, SUBPIXEL)
    caption = "rings: found"
    if model is not None and np.isfinite(model).any():
        caption += f"; crosses: by the model; lines: the difference × {ARROWS:g}"
    return _image(image, caption, "picture", "width:100%;border-radius:4px;display:block")


def _near(place: Float[np.ndarray, "2"]) -> tuple[int, int]:
    u, v = np.clip(np.round(place), -30_000, 30_000).astype(int).tolist()
    return u, v


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
        small = drawn(known.get((name, image)), own.rig.cameras[c].size, pixels, width=SMALL)
        frame = f"outline:2px solid {colour};border-radius:4px"
        label = f'<div style="font-size:12px;text-align:center">{text(image)} · {count}</div>'
        found[image] = f'{found.get(image, "")}<div style="{frame}">{small}</div>{label}'
    return found


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
