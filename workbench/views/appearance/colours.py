"""The palette: one meaning, one colour."""

import numpy as np
from jaxtyping import Float, UInt8

LINK = (233, 237, 242)
JOINT = (92, 112, 146)
FOOT = (92, 112, 146)
PROBE = (120, 130, 146)
PLATE = (203, 210, 220)
GHOST = (245, 158, 11)
BENT = (147, 51, 234)

REACHED = (45, 155, 120)
SELECTED = (37, 99, 235)
BLOCKED = (133, 77, 14)
OUT_OF_REACH = (220, 68, 55)

REGION = (100, 116, 139)
GRID = (214, 220, 228)
GRID_SECTION = (186, 195, 208)

SKY = (246, 248, 251)
SKY_DARK = (24, 27, 33)
GRID_DARK = (46, 51, 60)
GRID_SECTION_DARK = (66, 73, 85)

BEFORE = (220, 68, 55)
AFTER = (45, 155, 120)
ARROW_BEFORE = (168, 26, 170)
ARROW_AFTER = (8, 130, 170)
MARK = (250, 204, 21)

BLAMED = (225, 29, 72)
BRANCH = (100, 116, 139)
FITTED = (37, 99, 235)
HELD_OUT = (219, 39, 119)
LEFT_OUT = (148, 163, 184)
NO_VALUE = (176, 184, 196)
UNBOUNDED = (110, 20, 40)
SCALE = np.array([(199, 54, 66), (236, 146, 60), (240, 214, 104), (112, 190, 122), (20, 130, 110)], float)
"""From bad to good."""
GAMMA = 2.2


def scale_colours(shares: Float[np.ndarray, " n"]) -> UInt8[np.ndarray, "n 3"]:
    """Colours of places on the scale, 0 bad to 1 good."""
    stops = np.linspace(0.0, 1.0, len(SCALE))
    return np.stack([np.interp(shares, stops, SCALE[:, i]) for i in range(3)], -1).astype(np.uint8)


def css(colour: tuple[int, int, int]) -> str:
    """The colour for HTML."""
    return "#{:02x}{:02x}{:02x}".format(*colour)


def linear(colours: UInt8[np.ndarray, "n 3"]) -> UInt8[np.ndarray, "n 3"]:
    """Colours of points and faces for viser, whose pages take them for linear ones."""
    return np.round(255.0 * (colours / 255.0) ** GAMMA).astype(np.uint8)
