"""OpenCV, if it is installed."""

from functools import cache
from typing import Any

from workbench.base.errors import MissingExtraError


@cache
def opencv() -> Any:
    try:
        import cv2

        cv2.aruco.CharucoDetector  # noqa: B018
    except (ImportError, AttributeError):
        raise MissingExtraError("working with pictures", extra="camera") from None
    return cv2
