"""Corners that were found in pictures, as a table has them: one a row."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from workbench.base.errors import FileError
from workbench.data.dataset import Labels
from workbench.data.readers.fields import Fields


@dataclass(frozen=True, eq=False, kw_only=True)
class PixelRows:
    """Corners found in pictures, one a row.

    Args:
        image: Name of the picture.
        camera: Name of the camera; "" where there is one only.
        id: Of the tag, or of the board's corner.
        corner: Number of the tag's corner; 0 where an id has one point.
        uv: Where it is in the picture [px].
        pictures: All that were looked at, in their order; none: those that show corners.
        source: Where they came from, for messages.
        notes: Each decision that was taken on the way, in one sentence.
    """

    image: Labels
    camera: Labels
    id: Int[np.ndarray, " n"]
    corner: Int[np.ndarray, " n"]
    uv: Float[np.ndarray, "n 2"]
    pictures: tuple[str, ...] = ()
    source: str = "pictures"
    notes: tuple[str, ...] = ()

    @classmethod
    def of(cls, fields: Fields) -> "PixelRows":
        if missing := [key for key in ("image", "id", "u", "v") if key not in fields.values]:
            heading = {"u": "u[px]", "v": "v[px]"}.get(missing[0], missing[0])
            raise FileError(f"a table of pixels needs the column '{heading}'", path=fields.source)
        blank = np.full(fields.rows, "")
        return cls(
            image=fields.values["image"],
            camera=fields.values.get("camera", blank),
            id=_whole(fields, "id"),
            corner=_whole(fields, "corner") if "corner" in fields.values else np.zeros(fields.rows, int),
            uv=np.stack([fields.values["u"], fields.values["v"]], axis=1),
            source=fields.source,
            notes=fields.notes,
        )


def _whole(fields: Fields, key: str) -> Int[np.ndarray, " rows"]:
    found = []
    for row, text in enumerate(fields.values[key].tolist()):
        try:
            found.append(np.int64(text.removesuffix(".0") or 0))
        except (ValueError, OverflowError):
            raise fields.error(
                f"'{text[:40]}' is not a whole number of at most 18 digits", row, key
            ) from None
    return np.array(found, int)
