"""The hole drawing: ezdxf's auditor finds nothing, every hole is there, dimensions say what they measure."""

import io

import ezdxf
import numpy as np
import pytest

from workbench.plate.parts.hole_drawing import dxf


@pytest.fixture(scope="module")
def drawing(fixture):
    return ezdxf.read(io.StringIO(dxf(fixture)))


def test_the_auditor_finds_nothing(drawing):
    audit = drawing.audit()
    assert not audit.errors
    assert not audit.fixes
    assert drawing.units == ezdxf.units.MM


def test_every_hole_is_drawn_to_size(fixture, drawing):
    drawn = sorted(
        (c.dxf.center.x, c.dxf.center.y, c.dxf.radius)
        for c in drawing.modelspace().query("CIRCLE[layer=='HOLES']")
    )
    meant = sorted((*fixture.from_corner(b.mouth), 500.0 * b.diameter) for b in fixture.slab.bores)
    assert np.allclose(drawn, meant)


def test_dimensions_say_millimetres(fixture, drawing):
    """The written numbers: the overall size, and the place of every block."""
    said = set()
    for dimension in drawing.modelspace().query("DIMENSION"):
        block = drawing.blocks[dimension.dxf.geometry]
        said |= {float(text.plain_text()) for text in block.query("MTEXT")}
    size = 1e3 * fixture.slab.size[:2]
    places = [v for b in fixture.blocks for v in fixture.from_corner(b.pose[:3, 3])]
    assert len(said) >= 3
    for value in (*size, *places):
        assert min(abs(value - number) for number in said) < 1e-3


def test_labels_of_near_blocks_do_not_touch():
    from workbench.plate.parts.hole_drawing import _spread

    spread = _spread(np.array([10.0, 11.0, 10.0, 50.0, 12.0]), 8.0)
    assert [value for value, _ in spread] == [10.0, 11.0, 12.0, 50.0]
    labels = np.array([label for _, label in spread])
    assert (np.diff(labels) >= 8.0 - 1e-9).all()
    assert np.isclose(labels[:3].mean(), 11.0)
    assert labels[3] == 50.0
