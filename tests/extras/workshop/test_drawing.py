"""The drawing set: ezdxf's auditor finds nothing, every hole is there, dimensions say what they measure.
A block rebuilt from its drawing and the lists alone is the solid."""

import csv
import io
import re
import sys
from dataclasses import replace

import ezdxf
import numpy as np
import pytest
import trimesh
from manifold3d import Manifold
from refusals import mentions

from workbench.base.errors import MissingExtraError
from workbench.extras.workshop.csv_lists import blocks_csv, bores_csv, holes_csv, parts_csv
from workbench.extras.workshop.drawing import DrawingSheet
from workbench.extras.workshop.drawing_set import AXIAL, drawings_of
from workbench.extras.workshop.fixture import fixture_of
from workbench.extras.workshop.meshes import mesh_of, stl
from workbench.extras.workshop.parts import Turned
from workbench.plate.stock import Stock
from workbench.plate.tolerances import USUAL, Production

SLANTED = ((-0.08, 0.05, 0.07, 0.4371, 0.7, 0.83), (0.05, -0.03, 0.09, 0.61, -2.0, -2.2))


def drawings(fixture):
    """The files read back."""
    return {name: ezdxf.read(io.StringIO(sheet.dxf())) for name, sheet in drawings_of(fixture).items()}


@pytest.fixture(scope="module")
def drawn(fixture):
    return drawings(fixture)


@pytest.fixture(scope="module")
def slanted(plate_of):
    return fixture_of(plate_of(*SLANTED))


def test_the_auditor_finds_nothing_in_a_drawing_of_every_part(fixture, drawn):
    assert list(drawn) == [
        "plate",
        *(f"block-{s.letter}" for s in fixture.shapes),
        *(p.name for p in fixture.others),
    ]
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


def message(drawing):
    """All words of a drawing, those of dimensions too."""
    labels = [t.dxf.text for t in drawing.modelspace().query("TEXT")]
    for dimension in drawing.modelspace().query("DIMENSION"):
        labels += [t.plain_text() for t in drawing.blocks[dimension.dxf.geometry].query("MTEXT")]
    return labels


def test_dimensions_say_millimetres(fixture, drawn):
    """Overall size and the place of every block on the plate; heights of every shape on its page."""
    numbers = [float(w) for w in message(drawn["plate"]) if re.fullmatch(r"-?[\d.]+", w)]
    size = 1e3 * fixture.slab.size[:2]
    places = [v for b in fixture.blocks for v in fixture.from_corner(b.pose[:3, 3])]
    for value in (*size, *places):
        assert min(abs(value - number) for number in numbers) < 2e-3
    for shape in fixture.shapes:
        labels = message(drawn[f"block-{shape.letter}"])
        numbers = [float(w.strip("()")) for w in labels if re.fullmatch(r"\(?-?[\d.]+\)?", w)]
        for height in shape.block.heights:
            assert min(abs(1e3 * height - number) for number in numbers) < 2e-3
        assert any(
            w.startswith(f"{1e3 * shape.block.height:.3f}".rstrip("0").rstrip(".") + " ±0.05") for w in labels
        )


def test_tolerances_are_the_plate_s_own_budget(plate_of):
    own = replace(plate_of(*SLANTED), production=Production(position=2e-5, angle=np.deg2rad(0.02)))
    assert fixture_of(own).tolerances.production.position == 2e-5
    text = "\n".join(message(drawings(fixture_of(own))["block-A"]))
    assert "±0.02°" in text
    assert "±0.01°" in text  # half for the index hole, half for the dowels in the plate
    assert mentions(text, "Ø0.020", "A B C")
    assert "as stated for this plate" in text
    usual = fixture_of(plate_of(*SLANTED)).tolerances
    assert usual.production == USUAL
    assert usual.assumed


def numbers(labels):
    return [float(n) for n in re.findall(r"\d+(?:\.\d+)?", labels)]


def table_of(drawing):
    """The rows of a drawing's table of holes as words by the words of its head."""
    labels = [(t.dxf.insert.x, t.dxf.insert.y, t.dxf.text) for t in drawing.modelspace().query("TEXT")]
    left, top = next((x, y) for x, y, word in labels if word == "hole")
    head = {round(x, 3): word for x, y, word in labels if abs(y - top) < 0.1 and x >= left}
    rows = {}
    for x, y, word in labels:
        if y < top - 0.1 and round(x, 3) in head:
            rows.setdefault(round(y, 3), {})[head[round(x, 3)]] = word
    return [row for _, row in sorted(rows.items(), reverse=True) if len(row) > 3]


def drawn_block(drawing, shape, blocks, bores):
    """A block's solid and bores from its lines in the lists, its side from the drawing's title."""
    row = next(r for r in blocks if r["shape"] == shape)
    tilt, height = np.deg2rad(float(row["tilt[deg]"])), float(row["height[mm]"])
    title = r"(?:square bar|printed block) ([\d.]+) mm"
    side = next(float(m.group(1)) for w in message(drawing) if (m := re.match(title, w)))
    normal, down = np.array([np.sin(tilt), 0.0, np.cos(tilt)]), np.array([np.cos(tilt), 0.0, -np.sin(tilt)])
    bar = Manifold.cube((side, side, 400.0), True).translate((0.0, 0.0, 200.0))
    stated = []
    for line in (b for b in bores if b["shape"] == shape):
        u, v = float(line["u[mm]"]), float(line["v[mm]"])
        foot = line["on"] == "foot"
        mouth = np.array([u, v, 0.0]) if foot else np.array([0.0, v, height]) + u * down
        size = float(line["diameter[mm]"]), float(line["depth[mm]"]), "cone" in line["size"]
        stated.append((mouth, np.array([0.0, 0.0, 1.0]) if foot else -normal, *size))
    return bar.trim_by_plane((-normal).tolist(), float(-height * np.cos(tilt))), stated


def drawn_slab(drawing, rows):
    """A plate with holes through it: size from the title, (x, y, diameter) from rows."""
    length, width, thick = next(numbers(w)[:3] for w in message(drawing) if w.endswith("all holes through"))
    down = np.array([0.0, 0.0, -1.0])
    stated = [(np.array([x - length / 2, y - width / 2, 0.0]), down, d, thick, False) for x, y, d in rows]
    return Manifold.cube((length, width, thick), True).translate((0.0, 0.0, -thick / 2)), stated


def drawn_turned(drawing):
    """A turned part: diameters and lengths from its dimensions, bores from table and dashed outlines."""
    dimensions = [
        t.plain_text()
        for d in drawing.modelspace().query("DIMENSION")
        for t in drawing.blocks[d.dxf.geometry].query("MTEXT")
    ]
    diameters = [float(w[1:]) for w in dimensions if w.startswith("Ø")]
    lengths = [numbers(w)[0] for w in dimensions if not w.startswith("Ø")]
    solid, z = Manifold(), 0.0
    for diameter, length in zip(diameters, lengths, strict=False):  # the last length is the whole
        solid += Manifold.cylinder(length, diameter / 2, diameter / 2, 256).translate((0.0, 0.0, z))
        z += length
    assert np.isclose(z, lengths[-1])
    dashed = [
        np.array(p.get_points())[:, 1] for p in drawing.modelspace().query("LWPOLYLINE[layer=='HIDDEN']")
    ]
    foot = min(
        np.array(p.get_points())[:, 1].min()
        for p in drawing.modelspace().query("LWPOLYLINE[layer=='OUTLINE']")
    )
    stated = []
    for row, outline in zip(table_of(drawing), dashed, strict=True):
        start, end = outline[[0, 2]] - foot
        size = row["size"].split("core")[-1]
        mouth = np.array([float(row["x"]), float(row["y"]), start])
        depth = abs(end - start) if row["depth"] == "through" else float(row["depth"])
        diameter = numbers(size.split("cone")[-1])[0]
        stated.append(
            (mouth, np.array([0.0, 0.0, np.sign(end - start)]), diameter, depth, "cone" in row["size"])
        )
    return solid, stated


def bored(solid, stated):
    """What drills and countersinks leave of a solid."""
    for mouth, direction, diameter, depth, cone in stated:
        across = np.cross(direction, [0.0, 1.0, 0.0])
        frame = np.column_stack([across, np.cross(direction, across), direction, mouth])
        low, high = diameter / 2 + cone, 0.0 if cone else diameter / 2
        solid -= Manifold.cylinder(depth + 1.0, low, high, 256).translate((0.0, 0.0, -1.0)).transform(frame)
    return solid


MADE = {
    "machined seats": ("seat", Stock()),
    "points": ("point", Stock()),
    "printed": ("socket", Stock.named("printed")),
    "breadboard": ("socket", Stock.named("breadboard")),
    "ball-bar": ("socket", Stock.named("ball-bar")),
}


@pytest.mark.parametrize("made", MADE)
def test_every_part_rebuilt_from_drawing_and_lists_is_the_solid(plate_of, made):
    """Plate, blocks, probe, bottom plate, stand-offs: to 0.01 mm and 0.01°, from DXF and CSV alone."""
    kind, stock = MADE[made]
    fixture = fixture_of(plate_of(*SLANTED, kinds=(kind,), lean=(0.0, 0.0, 0.0)), stock=stock)
    blocks, bores, holes = (
        list(csv.DictReader(io.StringIO(write(fixture)))) for write in (blocks_csv, bores_csv, holes_csv)
    )
    drawn = drawings(fixture)
    others = {"bottom", "stand-off", *({"probe"} if kind != "point" else ())}  # a pointed probe is bought
    assert {part.name for part in fixture.others} == others
    for name, part in fixture.made:
        page = drawn[name]
        if name == "plate":
            columns = ("x[mm]", "y[mm]", "diameter[mm]")
            solid, stated = drawn_slab(page, [[float(hole[c]) for c in columns] for hole in holes])
        elif name == "bottom":
            rows = [(float(r["x"]), float(r["y"]), numbers(r["size"])[0]) for r in table_of(page)]
            solid, stated = drawn_slab(page, rows)
        elif name.startswith("block"):
            solid, stated = drawn_block(page, name.removeprefix("block-"), blocks, bores)
        else:
            solid, stated = drawn_turned(page)
        for bore, (mouth, direction, diameter, depth, cone) in zip(part.bores, stated, strict=True):
            assert np.allclose(1e3 * bore.mouth, mouth, atol=0.01), (name, bore.label)
            assert np.degrees(np.arccos(np.clip(bore.direction @ direction, -1.0, 1.0))) < 0.01
            assert np.allclose([1e3 * bore.diameter, 1e3 * bore.depth], [diameter, depth], atol=0.01)
            assert bore.conical == cone
        file = trimesh.load(io.BytesIO(stl(mesh_of(part))), file_type="stl")
        mine = bored(solid, stated)
        round_off = 0.02 if isinstance(part, Turned) else 0.01  # its mesh is a polygon of the circle's area
        assert np.allclose(np.reshape(mine.bounding_box(), (2, 3)), file.bounds, atol=round_off), name
        assert np.isclose(mine.volume(), file.volume, rtol=2e-4), name


def test_a_block_s_face_and_index_hole_lie_as_drawn(slanted):
    """To 0.01°: the face of the solid, the angle of the index hole that stands on the page."""
    blocks = list(csv.DictReader(io.StringIO(blocks_csv(slanted))))
    bores = list(csv.DictReader(io.StringIO(bores_csv(slanted))))
    angles = {name: message(drawing) for name, drawing in drawings(slanted).items()}
    for shape in slanted.shapes:
        tilt = np.deg2rad(float(next(r for r in blocks if r["shape"] == shape.letter)["tilt[deg]"]))
        file = trimesh.load(io.BytesIO(stl(mesh_of(shape.block))), file_type="stl")
        normal = np.array([np.sin(tilt), 0.0, np.cos(tilt)])
        turned = np.degrees(np.arccos(np.clip(file.face_normals @ normal, -1.0, 1.0)))
        assert turned.min() < 0.01
        index = next(b for b in bores if b["shape"] == shape.letter and "index" in b["purpose"])
        angle = float(index["from_downhill[deg]"])
        assert any(w.startswith(f"{angle:.4f}° ±") for w in angles[f"block-{shape.letter}"])


def texts_of(fixture):
    return {name: message(drawing) for name, drawing in drawings(fixture).items()}


def test_words_of_a_ball_s_drawings(plate_of):
    """A probe has no datums of a block; a bought board's holes are its own; anchors are not targets."""
    plate = plate_of((-0.08, 0.0, 0.09, 0.0, 0.0, 0.0), (0.05, 0.0, 0.09, 0.0, 0.0, 0.0), kinds=("socket",))
    board = fixture_of(plate, stock=Stock.named("breadboard"))
    pages = texts_of(board)
    assert AXIAL in pages["probe"]
    assert not any("A B C" in labels for labels in pages["probe"])
    assert "Screw holes: the board's own. Drill the mounting holes, Ø0.2." in pages["plate"]
    assert any(w.endswith("for targets 1, 2") for w in pages["block-A"])
    assert "stamp letter and target on the +x side" in pages["block-A"]
    anchored = texts_of(replace(board, anchored=True, blocks=board.blocks[:1]))
    assert any(w.endswith("for anchor 1") for w in anchored["block-A"])


def test_labels_of_holes_stand_clear_of_other_holes(plate):
    space = drawings(fixture_of(plate))["bottom"].modelspace()
    labels = [t for t in space.query("TEXT") if t.dxf.halign == 1 and re.fullmatch(r"[RS]\d", t.dxf.text)]
    holes = np.array([c.dxf.center.vec2 for c in space.query("CIRCLE[layer=='HOLES']")])
    assert len(labels) == 8
    for label in labels:
        high = label.dxf.height
        distance = np.abs(holes - np.array(label.dxf.align_point.vec2) - [0.0, 0.5 * high])
        assert not (distance < [high, 0.8 * high]).all(axis=1).any(), label.dxf.text


def dimensions(drawing):
    """Direction [°], length [mm] and text of linear dimensions."""
    found = drawing.modelspace().query("DIMENSION")
    linear = [d for d in found if d.dimtype == 0]
    return [(d.dxf.angle, d.get_measurement(), d.dxf.text) for d in linear]


def test_a_chain_of_lengths_is_not_closed(fixture, drawn):
    """The whole length and all steps but one are held; the last is for reference, in brackets."""
    lengths = [text for turn, _, text in dimensions(drawn["probe"]) if turn == 90.0]
    probe = next(part for part in fixture.others if part.name == "probe")
    assert len(lengths) == len(probe.steps) + 1
    assert len([text for text in lengths if "(" not in text]) == len(probe.steps)


def test_a_block_s_drawing_says_each_size_once(slanted):
    """The bar's two sides once each; what the table holds stands in brackets elsewhere."""
    for name, drawing in drawings(slanted).items():
        if name.startswith("block"):
            held = [(turn, length) for turn, length, text in dimensions(drawing) if "(" not in text]
            assert sorted(turn for turn, length in held if np.isclose(length, 46.0)) == [0.0, 90.0]
            assert not any(np.isclose(length, 14.0) for _, length in held)


def test_nothing_of_a_column_runs_into_the_next_or_over_the_frame(drawn):
    for drawing in drawn.values():
        space = drawing.modelspace()
        frame = np.array(space.query("LWPOLYLINE[layer=='FRAME']")[0].get_points("xy"))
        lines = [t for t in space.query("TEXT") if t.dxf.halign == 0]
        for line in lines:
            x, y = line.dxf.insert.vec2
            end = x + 0.6 * line.dxf.height * len(line.dxf.text)
            assert frame.min(axis=0)[0] < x < end < frame.max(axis=0)[0], line.dxf.text
            beside = [o.dxf.insert.x for o in lines if abs(o.dxf.insert.y - y) < 0.1 and o.dxf.insert.x > x]
            assert end < min(beside, default=np.inf), line.dxf.text


def test_what_the_drawing_allows_stays_within_the_budget(slanted):
    """The seat is held to where the block stands, its dowels, whose own place in the foot costs nothing."""
    page = texts_of(slanted)["block-A"]
    tolerances = slanted.tolerances
    assert any("B midway between the dowel holes" in w for w in page)
    (across,) = {float(w[1:].split()[0]) for w in page if w.endswith("to A B C")}
    (pair,) = {float(w[1:].split()[0]) for w in page if w.endswith("to each other")}
    in_plate = 1e3 * tolerances.place
    assert across / 2 + in_plate <= 1e3 * tolerances.production.position + 1e-9
    assert np.isclose(pair, 1e3 * tolerances.pair, atol=5e-4)


def test_bought_pins_and_screws_fit_the_plate(plate_of):
    """20 mm pins would end within a plate of 20 mm; every screw ends above the bottom of its hole."""
    thick = fixture_of(replace(plate_of(*SLANTED, lean=(0.0, 0.0, 0.0)), size=np.array([0.4, 0.4, 0.02])))
    parts = {p["part"]: p for p in csv.DictReader(io.StringIO(parts_csv(thick)))}
    long = {
        name.split(",")[0]: numbers(part["size"])[0] for name, part in parts.items() if "long" in part["size"]
    }
    assert long["dowel pin ISO 8734 Ø4 m6"] == 28.0
    assert long["screw ISO 4762 M8"] <= 15.0 + 1e3 * min(b.depth for b in thick.standoff.bores) - 2.0
    assert parts["screw ISO 4762 M6, for the probe's flange"]["quantity"] == "4"
    assert any("Ø4 m6 × 28" in w for w in texts_of(thick)["block-A"])


def test_drawings_of_ball_blocks_name_neither_pins_nor_dowels(plate_of):
    plate = plate_of((0.05, -0.025, 0.05, 0.6, 1.1, 0.0), kinds=("socket",))
    for stock in (Stock.named("printed"), Stock.named("breadboard")):
        sheets = drawings_of(fixture_of(plate, stock=stock)).values()
        written = " ".join(text.dxf.text for sheet in sheets for text in sheet.space.query("TEXT"))
        assert "ndex" not in written
        assert "dowel" not in written


def test_without_ezdxf_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "ezdxf", None)
    with pytest.raises(MissingExtraError) as error:
        DrawingSheet(1.0)
    assert error.value.extra == "cad"
