"""Every block of a drawing is told by its label: it covers no other, and its line ends on its own."""

import csv
import io

import ezdxf
import numpy as np
import pytest
from matplotlib.path import Path

from workbench.extras.workshop.csv_lists import blocks_csv
from workbench.extras.workshop.drawing_set import drawings_of
from workbench.extras.workshop.fixture import fixture_of

CORNERS = ((-0.15, -0.11), (0.15, -0.11), (-0.15, 0.11), (0.15, 0.11))
NEXT_TO_THEM = ((-0.1, -0.07), (0.11, -0.06), (-0.15, 0.04), (0.1, 0.07))


@pytest.fixture(scope="module")
def crowded(plate_of):
    """Blocks that nearly touch, in the corners of their plate."""
    places = [(x, y, 0.06, 0.3 + 0.02 * i, 1.1 * i, 0.2) for i, (x, y) in enumerate(CORNERS + NEXT_TO_THEM)]
    return fixture_of(plate_of(*places, size=(0.4, 0.3, 0.012)))


def test_labels_stand_clear_and_point_to_their_own_block(crowded):
    """By the drawing and the list of blocks as they leave the program."""
    space = ezdxf.read(io.StringIO(drawings_of(crowded)["plate"].dxf())).modelspace()
    blocks = list(csv.DictReader(io.StringIO(blocks_csv(crowded))))
    feet = [closed(line.get_points("xy")) for line in space.query("LWPOLYLINE[layer=='BLOCKS']")]
    written = {text.dxf.text: box_of(text) for text in space.query("TEXT")}
    ends = [np.array([line.dxf.start, line.dxf.end])[:, :2] for line in space.query("LINE[layer=='TEXT']")]
    lines = [Path(end + 1e-3 * (end - end[::-1])) for end in ends]  # over the edge that they end on
    assert len(lines) == len(blocks)
    for block in blocks:
        place = float(block["x[mm]"]), float(block["y[mm]"])
        (own,) = (foot for foot in feet if foot.contains_point(place))
        label = written.pop(f"{block['target']} ({block['shape']})")
        assert not any(label.intersects_path(other) for other in (*feet, *written.values()))
        line = min(lines, key=lambda line: away(label, line))
        assert away(label, line) < np.ptp(label.vertices[:, 1])
        assert [foot for foot in feet if foot.intersects_path(line)] == [own]


def box_of(text):
    """What a text covers, its letters 0.6 of their height wide."""
    size = np.array([0.6 * text.dxf.height * len(text.dxf.text), text.dxf.height])
    across = {0: 0.0, 2: 1.0}.get(text.dxf.halign, 0.5)
    is_middle = text.dxf.valign == 2 or text.dxf.halign == 4
    at = text.dxf.align_point if text.dxf.halign or text.dxf.valign else text.dxf.insert
    low = np.array(at)[:2] - size * [across, 0.5 * is_middle]
    return closed(low + size * [[0, 0], [1, 0], [1, 1], [0, 1]])


def closed(corners):
    return Path([*corners, corners[0]])


def away(label, line):
    """Distance of a line's nearer end from a label [mm]."""
    low, high = label.vertices[0], label.vertices[2]
    return np.linalg.norm(line.vertices - np.clip(line.vertices, low, high), axis=1).min()
