"""The plate's drawing: ezdxf's auditor finds nothing, and what is rebuilt from the file is the plate."""

import io
from dataclasses import replace

import ezdxf
import numpy as np
import pytest
from refusals import mentions

from workbench.base import se3
from workbench.extras.workshop.drawing import dxf_of, plate_drawing
from workbench.extras.workshop.fixture import fixture_of
from workbench.plate.plate import Kind
from workbench.plate.tolerances import Production


def drawn(fixture):
    """The file read back."""
    return ezdxf.read(io.StringIO(dxf_of(plate_drawing(fixture)).decode()))


@pytest.fixture(scope="module")
def page(fixture):
    return drawn(fixture)


def words(page):
    return [(t.dxf.insert.x, t.dxf.insert.y, t.dxf.text) for t in page.modelspace().query("TEXT")]


def table_of(page, first, columns=5):
    """Rows of a table by the words of its head; it may go on beside itself."""
    texts, rows = words(page), []
    for left, top, _ in (head for head in texts if head[2] == first):
        heads = sorted((x, word) for x, y, word in texts if abs(y - top) < 0.1 and x >= left)[:columns]
        for _, y, _ in sorted(
            (t for t in texts if abs(t[0] - left) < 0.1 and t[1] < top - 0.1), key=lambda t: -t[1]
        ):
            cells = {round(x, 3): word for x, at, word in texts if abs(at - y) < 0.1}
            if all(round(x, 3) in cells for x, _ in heads):
                rows.append({head: cells[round(x, 3)] for x, head in heads})
    return rows


def test_the_auditor_finds_nothing(page):
    audit = page.audit()
    assert not audit.errors
    assert not audit.fixes
    assert page.units == ezdxf.units.MM


def test_every_hole_is_drawn_and_listed_to_a_micrometre(fixture, page):
    meant = [(*fixture.from_corner(b.mouth), 1e3 * b.diameter) for b in fixture.slab.bores]
    circles = page.modelspace().query("CIRCLE[layer=='HOLES']")
    assert np.allclose(
        [(c.dxf.center.x, c.dxf.center.y, 2 * c.dxf.radius) for c in circles], meant, atol=1e-9
    )
    rows = table_of(page, "hole")
    assert [row["hole"] for row in rows] == [bore.label for bore in fixture.slab.bores]
    assert len({row["hole"] for row in rows}) == len(rows)
    listed = [(float(r["x"]), float(r["y"]), float(r["size"].strip("Ø").split()[0])) for r in rows]
    assert np.allclose(listed, meant, atol=5.1e-4)
    assert all(("H7" in row["size"]) is (row["for"] == "dowel") for row in rows)


def test_targets_rebuilt_from_the_drawing_are_the_plate_s(made_plate, fixture, page):
    """Place, height, tilt and turn of a block give its target's point and normal, the index the tool's x."""
    holes = {row["hole"]: row for row in table_of(page, "hole")}
    blocks = table_of(page, "target", 6)
    for row, target, block in zip(blocks, made_plate.targets, fixture.blocks, strict=True):
        screw = holes[row["target"]]
        place = np.array([float(screw[axis]) / 1e3 for axis in "xy"]) - 0.5 * made_plate.size[:2]
        tilt, turn = (np.deg2rad(float(row[name].strip("°"))) for name in ("tilt", "turn"))
        normal = [np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), np.cos(tilt)]
        tool = se3.inverse(made_plate.pose) @ target.pose
        assert np.allclose(normal, -tool[:3, 2], atol=2e-6)
        assert (row["index"] == "–") is (target.kind is not Kind.SEAT)
        index = np.deg2rad(float(row["index"].strip("°").replace("–", "nan")))
        x = se3.rpy_to_matrix(np.array([0.0, tilt, turn])) @ [np.cos(index), np.sin(index), 0.0]
        assert np.allclose(np.where(np.isnan(x), tool[:3, 0], x), tool[:3, 0], atol=2e-6)
        lift = block.height - tool[2, 3]  # the ball's centre lies over its face
        assert np.allclose([*place, float(row["height"]) / 1e3 - lift], tool[:3, 3], atol=2e-6)
        assert any(block in alike for letter, alike in fixture.shapes.items() if letter == row["block"])


def test_outlines_and_dimensions_are_the_plate_s(fixture, page):
    size = 1e3 * fixture.slab.size
    (outline,) = page.modelspace().query("LWPOLYLINE[layer=='OUTLINE']")
    assert np.allclose(np.ptp(outline.get_points("xy"), axis=0), size[:2])
    measured = [d.get_measurement() for d in page.modelspace().query("DIMENSION")]
    assert np.allclose(measured, size[:2])
    feet = page.modelspace().query("LWPOLYLINE[layer=='BLOCKS']")
    for foot, block in zip(feet, fixture.blocks, strict=True):
        assert np.allclose(foot.get_points("xy"), fixture.from_corner(block.footprint))


def test_tolerances_are_the_plate_s_own_and_stay_within_its_budget(mixed):
    """Half for the dowels in the plate, half for the seat in the block; ±b/2 for either of the turns."""
    own = replace(mixed, production=Production(tolerance=(2e-5, np.deg2rad(0.02))))
    text = " ".join(word for *_, word in words(drawn(fixture_of(own))))
    assert mentions(text, "±0.02 mm, ±0.02°", "position Ø0.020", "Ø0.005 to each other", "height ±0.02")
    assert mentions(text, "mitre ±0.02°", "index hole ±0.01°", "Ø6 H7", "ball of Ø12")
    usual = " ".join(word for *_, word in words(drawn(fixture_of(mixed))))
    assert mentions(usual, "±0.05 mm, ±0.05°", "position Ø0.050", "Ø0.012 to each other")
