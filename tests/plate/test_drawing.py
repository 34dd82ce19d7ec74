"""The drawing set: ezdxf's auditor finds nothing, every hole is there, dimensions say what they measure.
A block rebuilt from its drawing and the lists alone is the solid."""

import csv
import io
import re
from dataclasses import replace

import ezdxf
import numpy as np
import pytest
import trimesh
from manifold3d import Manifold

from workbench.plate.parts.drawing import Circle, Words, dxf_of, pdf_of
from workbench.plate.parts.drawing_set import AXIAL, pages_of
from workbench.plate.parts.fixture import fixture_of
from workbench.plate.parts.lists import blocks_csv, bores_csv, inspection_csv, parts_csv
from workbench.plate.parts.page_parts import spread
from workbench.plate.parts.solids import mesh_of, stl
from workbench.plate.parts.stock import Stock
from workbench.plate.tolerances import USUAL, Making

SLANTED = ((-0.08, 0.05, 0.07, 0.4371, 0.7, 0.83), (0.05, -0.03, 0.09, 0.61, -2.0, -2.2))


@pytest.fixture(scope="module")
def drawn(fixture):
    return {page.name: ezdxf.read(io.StringIO(dxf_of(page))) for page in pages_of(fixture)}


@pytest.fixture(scope="module")
def slanted(plate_of):
    return fixture_of(plate_of(*SLANTED))


def test_a_page_for_every_part(fixture, drawn):
    assert list(drawn) == [
        "plate",
        *(f"block-{s.letter}" for s in fixture.shapes),
        *(p.name for p in fixture.others),
    ]
    assert pdf_of(pages_of(fixture)).count(b"/Type /Page ") == len(drawn)


def test_the_auditor_finds_nothing(drawn):
    for drawing in drawn.values():
        audit = drawing.audit()
        assert not audit.errors
        assert not audit.fixes
        assert drawing.units == ezdxf.units.MM


def test_every_hole_of_the_plate_is_drawn_to_size(fixture, drawn):
    circles = [
        (c.dxf.center.x, c.dxf.center.y, c.dxf.radius)
        for c in drawn["plate"].modelspace().query("CIRCLE[layer=='HOLES']")
    ]
    meant = [(*fixture.from_corner(b.mouth), 500.0 * b.diameter) for b in fixture.slab.bores]
    outline = next(iter(drawn["plate"].modelspace().query("LWPOLYLINE[layer=='OUTLINE']")))
    corner = np.min([p[:2] for p in outline.get_points()], axis=0)
    gaps = np.abs(np.array(meant)[:, None] - (np.array(circles) - [*corner, 0.0])[None]).max(axis=2)
    assert len(circles) == len(meant)
    assert (gaps.min(axis=0) < 1e-6).all()
    assert (gaps.min(axis=1) < 1e-6).all()


def said(drawing):
    """All words of a drawing, those of dimensions too."""
    words = [t.dxf.text for t in drawing.modelspace().query("TEXT")]
    for dimension in drawing.modelspace().query("DIMENSION"):
        words += [t.plain_text() for t in drawing.blocks[dimension.dxf.geometry].query("MTEXT")]
    return words


def test_dimensions_say_millimetres(fixture, drawn):
    """Overall size and the place of every block on the plate; heights of every shape on its page."""
    numbers = [float(w) for w in said(drawn["plate"]) if re.fullmatch(r"-?[\d.]+", w)]
    size = 1e3 * fixture.slab.size[:2]
    places = [v for b in fixture.blocks for v in fixture.from_corner(b.pose[:3, 3])]
    for value in (*size, *places):
        assert min(abs(value - number) for number in numbers) < 2e-3
    for shape in fixture.shapes:
        words = said(drawn[f"block-{shape.letter}"])
        numbers = [float(w.strip("()")) for w in words if re.fullmatch(r"\(?-?[\d.]+\)?", w)]
        for height in shape.block.heights:
            assert min(abs(1e3 * height - number) for number in numbers) < 2e-3
        assert any(
            w.startswith(f"{1e3 * shape.block.height:.3f}".rstrip("0").rstrip(".") + " ±0.05") for w in words
        )


def test_tolerances_are_the_plate_s_own_budget(plate_of):
    own = replace(plate_of(*SLANTED), making=Making(position=2e-5, angle=np.deg2rad(0.02)))
    assert fixture_of(own).tolerances.making.position == 2e-5
    text = "\n".join(said(ezdxf.read(io.StringIO(dxf_of(pages_of(fixture_of(own))[1])))))
    assert "±0.02°" in text
    assert "±0.01°" in text  # half for the index hole, half for the dowels in the plate
    assert "Ø0.020 to A B C" in text
    assert "as stated for this plate" in text
    usual = fixture_of(plate_of(*SLANTED)).tolerances
    assert usual.making == USUAL
    assert usual.assumed


def bore_of(row, tilt, height):
    """A bore's mouth and direction in the block, from its line in the list [mm]."""
    u, v = float(row["u[mm]"]), float(row["v[mm]"])
    if row["on"] == "foot":
        return np.array([u, v, 0.0]), np.array([0.0, 0.0, 1.0])
    down = np.array([np.cos(tilt), 0.0, -np.sin(tilt)])
    mouth = np.array([0.0, 0.0, height]) + u * down + np.array([0.0, v, 0.0])
    return mouth, -np.array([np.sin(tilt), 0.0, np.cos(tilt)])


def rebuilt(shape, blocks, bores, drawing):
    """A block from its lines in the lists, its side from the drawing's title."""
    row = next(r for r in blocks if r["shape"] == shape)
    tilt, height = np.deg2rad(float(row["tilt[deg]"])), float(row["height[mm]"])
    side = next(float(m.group(1)) for w in said(drawing) if (m := re.match(r"square bar ([\d.]+) mm", w)))
    bar = Manifold.cube((side, side, 400.0), True).translate((0.0, 0.0, 200.0))
    normal = np.array([np.sin(tilt), 0.0, np.cos(tilt)])
    solid = bar.trim_by_plane((-normal).tolist(), float(-height * np.cos(tilt)))
    axes = []
    for line in (b for b in bores if b["shape"] == shape):
        mouth, direction = bore_of(line, tilt, height)
        radius, depth = 0.5 * float(line["diameter[mm]"]), float(line["depth[mm]"])
        across = np.cross(direction, [0.0, 1.0, 0.0])
        frame = np.column_stack([across, np.cross(direction, across), direction, mouth])
        solid -= (
            Manifold.cylinder(depth + 1.0, radius, radius, 256).translate((0.0, 0.0, -1.0)).transform(frame)
        )
        axes.append((mouth, direction))
    return solid, axes, normal


def test_a_block_rebuilt_from_drawing_and_lists_is_the_solid(slanted):
    blocks = list(csv.DictReader(io.StringIO(blocks_csv(slanted))))
    bores = list(csv.DictReader(io.StringIO(bores_csv(slanted))))
    pages = {p.name: ezdxf.read(io.StringIO(dxf_of(p))) for p in pages_of(slanted)}
    for shape in slanted.shapes:
        drawing = pages[f"block-{shape.letter}"]
        solid, axes, normal = rebuilt(shape.letter, blocks, bores, drawing)
        file = trimesh.load(io.BytesIO(stl(mesh_of(shape.block))), file_type="stl")
        low, high = np.array(solid.bounding_box()[:3]), np.array(solid.bounding_box()[3:])
        assert np.allclose([low, high], file.bounds, atol=0.01)
        raw = solid.to_mesh()
        mine = trimesh.Trimesh(np.array(raw.vert_properties)[:, :3], np.array(raw.tri_verts))
        assert np.isclose(mine.volume, file.volume, rtol=2e-4)
        turned = np.degrees(np.arccos(np.clip(file.face_normals @ normal, -1.0, 1.0)))
        assert turned.min() < 0.01
        for bore, (mouth, direction) in zip(shape.block.bores, axes, strict=True):
            assert np.allclose(1e3 * bore.mouth, mouth, atol=0.01)
            assert np.degrees(np.arccos(np.clip(bore.direction @ direction, -1.0, 1.0))) < 0.01
        index = next(b for b in bores if b["shape"] == shape.letter and "index" in b["purpose"])
        angle = float(index["from_downhill[deg]"])
        assert any(w.startswith(f"{angle:.4f}° ±") for w in said(drawing))


def test_what_is_checked_and_what_is_bought(slanted, plate_of):
    checks = list(csv.DictReader(io.StringIO(inspection_csv(plate_of(*SLANTED), slanted))))
    assert {"height at the screw's axis", "mitre", "index hole from downhill"} <= {
        c["feature"] for c in checks
    }
    assert all(float(c["least"]) < float(c["nominal"]) < float(c["greatest"]) for c in checks)
    assert all(c["measured"] == "" for c in checks)
    parts = list(csv.DictReader(io.StringIO(parts_csv(slanted))))
    assert [p["part"] for p in parts[:4]] == ["plate", "block A", "block B", "probe"]
    assert next(p for p in parts if "dowel" in p["part"])["quantity"] == "4"


def test_labels_of_near_blocks_do_not_touch():
    found = spread(np.array([10.0, 11.0, 10.0, 50.0, 12.0]), 8.0)
    assert [value for value, _ in found] == [10.0, 11.0, 12.0, 50.0]
    labels = np.array([label for _, label in found])
    assert (np.diff(labels) >= 8.0 - 1e-9).all()
    assert np.isclose(labels[:3].mean(), 11.0)
    assert labels[3] == 50.0


def words_of(fixture):
    return {page.name: [i.text for i in page.items if isinstance(i, Words)] for page in pages_of(fixture)}


def test_words_of_a_ball_s_drawings(plate_of):
    """A probe has no datums of a block; a bought board's holes are its own; anchors are not targets."""
    plate = plate_of((-0.08, 0.0, 0.09, 0.0, 0.0, 0.0), (0.05, 0.0, 0.09, 0.0, 0.0, 0.0), kinds=("socket",))
    board = fixture_of(plate, stock=Stock.breadboard())
    pages = words_of(board)
    assert AXIAL in pages["probe"]
    assert not any("A B C" in words for words in pages["probe"])
    assert "Screw holes: the board's own. Drill the mounting holes, Ø0.2." in pages["plate"]
    assert any("for targets 1, 2; stamp letter and target on the +x side" in w for w in pages["block-A"])
    anchored = words_of(replace(board, anchored=True, blocks=board.blocks[:1]))
    assert any("for anchor 1; stamp" in w for w in anchored["block-A"])
    assert "magnet" not in inspection_csv(plate, board)


def test_labels_of_holes_stand_clear_of_other_holes(plate):
    page = next(page for page in pages_of(fixture_of(plate)) if page.name == "bottom")
    words = [i for i in page.items if isinstance(i, Words) and i.align == "center"]
    names = [i for i in words if re.fullmatch(r"[RS]\d", i.text)]
    holes = np.array([i.centre for i in page.items if isinstance(i, Circle)])
    assert len(names) == 8
    for label in names:
        apart = np.abs(holes - label.at - [0.0, 0.5 * label.height])
        assert not (apart < [label.height, 0.8 * label.height]).all(axis=1).any(), label.text
