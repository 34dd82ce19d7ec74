"""What the workshop adds to the files of a plate; the sheet promises the accuracy of the plate as drawn."""

import io
import re
import zipfile
from dataclasses import replace
from html import unescape

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from refusals import mentions

import workbench as wb
from workbench.extras.workshop.drawing import figure_of, pdf_of
from workbench.extras.workshop.drawing_set import drawings_of
from workbench.extras.workshop.fixture import fixture_of
from workbench.extras.workshop.sheet import PlateSheet
from workbench.plate.export import export_plate
from workbench.plate.plate import Target
from workbench.plate.plate_toml import load_plate
from workbench.plate.stock import made_as_drawn
from workbench.report.numbers import short
from workbench.session.export import fixture_zip
from workbench.session.live_score import score
from workbench.session.start import start

PARTS = ("plate", "block-A", "block-B", "probe", "bottom", "stand-off")
FORMATS = ("pdf", "svg", "3mf", "step", "inspection", "sheet")


def test_every_format_is_written(tmp_path, aria):
    files, missing, _ = export_plate(load_plate("table2"), tmp_path, formats=FORMATS, robot=aria)
    assert {path.name for path in files} == {
        *(f"{part}.{end}" for part in PARTS for end in ("svg", "step")),
        *("fixture.3mf", "drawings.pdf", "sheet.html", "inspection.csv"),
    }
    assert not missing
    page = (tmp_path / "sheet.html").read_text(encoding="utf-8")
    assert page.count("<svg") == 1
    drawn = wb.score(aria, made_as_drawn(load_plate("table2")))
    assert mentions(page, "±0.05 mm, ±0.05°", "±0.012 mm, ±0.08°")
    assert f"{1e3 * drawn.measured.error.position_mean:.3f} mm" in page
    assert mentions(page, "wrist flip")
    assert (tmp_path / "drawings.pdf").read_bytes().count(b"/Type /Page ") == len(PARTS)


def test_the_sheet_holds_the_page_s_own_figure(aria, plate):
    """Of a plate whose targets turned away from those that it was loaded with; as drawn it is less exact."""
    session = start(aria, plate)
    turned = replace(plate, targets=plate.targets[:7])
    states = session.states[:7]
    now = score(aria, turned, states, noise=session.noise, region_q=session.region.q)
    _, content, notes = fixture_zip(replace(session, plate=turned, states=states, score=now))
    page = zipfile.ZipFile(io.BytesIO(content)).read("fixture/sheet.html").decode()
    found = [float(n) for n in re.findall(r"([\d.]+) mm rms", page)]
    assert f"{short(1e3 * now.position)} mm rms" in page
    assert f"{short(1e3 * now.position)} mm rms" in notes[-1]
    assert max(found) > 1e3 * now.position
    assert set(fixture_of(turned).notes) <= set(notes)


def test_what_is_drawn_fills_its_page(plate):
    """Ink from side to side, and not so much that anything is filled that should be open."""
    sheet = drawings_of(fixture_of(plate))["plate"]
    figure = figure_of(sheet)
    (axes,) = figure.axes
    assert np.ptp(axes.get_xlim()) > 1e3 * plate.size[0]
    figure.set_dpi(100)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    ink = 255 - np.asarray(canvas.buffer_rgba())[..., :3].min(axis=2)
    columns = np.flatnonzero((ink > 100).any(axis=0))
    assert np.ptp(columns) > 0.8 * ink.shape[1]
    assert 0.005 < (ink > 100).mean() < 0.05
    assert pdf_of([sheet, sheet]).count(b"/Type /Page ") == 2


def test_every_shape_is_drawn(plate_of):
    """Ten different blocks: all in the page, and the sheet says where the rest of the PDF's are."""
    places = [
        (0.1 * (i % 5) - 0.2, 0.1 * (i // 5) - 0.05, 0.05 + 0.003 * i, 0.3, 0.4, 0.1 * i) for i in range(10)
    ]
    fixture = fixture_of(plate_of(*places, size=(0.6, 0.3, 0.012)))
    assert len(fixture.shapes) == 10
    page = PlateSheet(fixture=fixture).html()
    assert mentions(page, "--shapes 3")
    assert len(drawings_of(fixture).keys() & {f"block-{s.letter}" for s in fixture.shapes}) == 10


def test_a_target_out_of_reach_is_named(aria, plate):
    away = replace(plate, targets=(Target(np.array([2.0, 0.0, 0.0])), *plate.targets))
    page = PlateSheet(fixture=fixture_of(plate), score=wb.score(aria, away)).html()
    assert "can't be measured (target 1 is out of reach" in " ".join(unescape(page).split())
