"""OpenCV, if it is installed."""

import os
from functools import cache
from typing import Any

from workbench.base.errors import MissingExtraError

MAX_PIXELS = 250_000_000
"""Larger pictures are refused, as a small file may unpack to gigabytes; sensors have 150 million at most."""


@cache
def opencv() -> Any:
    os.environ.setdefault("OPENCV_IO_MAX_IMAGE_PIXELS", str(MAX_PIXELS))
    try:
        import cv2

        cv2.aruco.CharucoDetector  # noqa: B018
    except (ImportError, AttributeError):
        raise MissingExtraError("working with pictures", extra="camera") from None
    return cv2
