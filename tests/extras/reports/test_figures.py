import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.layout_engine import ConstrainedLayoutEngine

from workbench.data.accuracy_requirement import Requirement
from workbench.data.prediction import RowComponents
from workbench.extras.reports.identification_figures import NAMES, STEMS, error_grid, pictures
from workbench.identification.report.constants import corrections
from workbench.identification.report.error_plots import before_after, error_where, residual_histogram
from workbench.identification.result import ArmErrors, columns_of, order_of_measuring
from workbench.report.figures import INK, look, new_figure, plain_ticks, svg


def stems(axes):
    """Heights of the stems in the order of l."""
    found = {}
    for collection in axes.collections:
        for segment in collection.get_segments() if hasattr(collection, "get_segments") else []:
            (x, start), (_, end) = segment
            if start == 0.0 and float(x).is_integer():
                found[int(x)] = end
    return np.array([found[x] for x in sorted(found)])


@pytest.mark.parametrize("rotation", [False, True])
def test_the_papers_array_shows_the_errors(result, rotation):
    columns, place = columns_of(result), order_of_measuring(result)
    figure = error_grid(columns, place, rotation=rotation)
    assert len(figure.axes) == 4 * 3  # X, Y, Z, norm × NOM, OLS, OPT2
    assert [figure.axes[j].get_title() for j in range(3)] == ["NOM", "OLS", "OPT2"]
    for j, column in enumerate(columns):
        parts = (column.train, column.held_out)
        errors = np.concatenate([p.rotation if rotation else p.position for p in parts])
        errors = errors[np.argsort(place)] * (np.rad2deg(1.0) if rotation else 1e3)
        for i in range(3):
            assert stems(figure.axes[3 * i + j]) == pytest.approx(errors[:, i])
        assert stems(figure.axes[9 + j]) == pytest.approx(np.linalg.norm(errors, axis=1))


def test_identified_columns_share_a_scale_and_the_nominal_one_says_its_own(result):
    figure = error_grid(columns_of(result), order_of_measuring(result), rotation=False)
    for i in range(4):
        nominal, ols, opt2 = figure.axes[3 * i : 3 * i + 3]
        assert ols.get_ylim() == opt2.get_ylim()
        assert nominal.get_ylim()[1] > 3.0 * ols.get_ylim()[1]
        ratio = nominal.get_ylim()[1] / ols.get_ylim()[1]
        assert f"scale 1 : {ratio:.0f}" == nominal.get_title("right")


def test_equal_sizes_share_one_scale(result):
    same = columns_of(result)[1]
    figure = error_grid((same, same), order_of_measuring(result), rotation=False)
    assert all(figure.axes[2 * i].get_ylim() == figure.axes[2 * i + 1].get_ylim() for i in range(4))


def test_many_rows_are_sorted():
    rng = np.random.default_rng(0)
    train, held = (RowComponents(rng.normal(size=(n, 3)), np.full((n, 3), np.nan)) for n in (STEMS, 50))
    columns = (ArmErrors("NOM", train, held), ArmErrors("OLS", train, held))
    figure = error_grid(columns, np.arange(1, STEMS + 51), rotation=False)
    curve = next(line for line in figure.axes[0].lines if len(line.get_xdata()) == STEMS + 1)
    y = np.asarray(curve.get_ydata())
    assert (np.diff(y) >= 0).all()
    errors = 1e3 * np.sort(train.position[:, 0])
    assert (y[0], y[-1]) == pytest.approx((errors[0], errors[-1]))
    assert "sorted" in figure.axes[-1].get_xlabel()
    assert error_grid(columns, np.arange(1, STEMS + 51), rotation=True) is None


def test_rows_of_another_file_come_behind(result):
    assert sorted(order_of_measuring(result)) == list(range(1, 30))
    other = replace(result, held_out_rows=np.arange(0))
    place = order_of_measuring(other)
    assert place[len(result.train_rows) :].min() > place[: len(result.train_rows)].max()


def test_before_and_after_show_every_row_and_ring_the_suspicious(result):
    figure = before_after(result, order_of_measuring(result))
    assert len(figure.axes) == 2
    lines = {line.get_label(): line for line in figure.axes[0].lines}
    assert len(lines["nominal"].get_xdata()) == 29
    assert np.asarray(lines["identified, fitted rows"].get_ydata()) == pytest.approx(
        1e3 * result.best.train_rows.position
    )
    assert np.asarray(lines["identified, held-out rows"].get_ydata()) == pytest.approx(
        1e3 * result.best.held_out_rows.position
    )
    suspicious = result.best.fit.suspicious
    assert len(lines["stands out"].get_xdata()) == len(suspicious) == 1


@pytest.mark.parametrize(("low", "high"), [(0.2, 7.0), (2.2, 4.8), (0.004, 60.0)])
def test_a_logarithmic_axis_has_plain_numbers(low, high):
    with look():
        figure = new_figure(4.0, 3.0)
        axes = figure.subplots()
        axes.set_yscale("log")
        axes.plot([0, 1], [low, high])
        plain_ticks(axes.yaxis)
        FigureCanvasAgg(figure).draw()
    texts = axes.get_yticklabels(which="both")
    shown = [t.get_text() for t in texts if t.get_text() and low <= t.get_position()[1] <= high]
    assert 1 <= len(shown) <= 7
    assert [float(text) for text in shown] == pytest.approx(
        [t.get_position()[1] for t in texts if t.get_text() in shown]
    )


def test_the_other_figures(result, points):
    assert len(residual_histogram(result).axes) == 2
    assert len(residual_histogram(points).axes) == 1
    visible = [axes for axes in error_where(result).axes if axes.get_visible()]
    assert len(visible) == 1 + 6
    drawn = corrections(result.best).axes[0].get_yticklabels()
    assert [t.get_text() for t in drawn] == list(result.best.fit.problem.names)


@pytest.mark.parametrize("name", ["result", "points"])
def test_pictures_are_valid(name, report, replaced):
    folder = {"result": report, "points": replaced.path}[name].parent
    found = {path.stem: path.read_text(encoding="utf-8") for path in folder.glob("*.svg")}
    assert set(found) == {n for n in NAMES if name == "result" or n != "errors-orientation"}
    identifiers = []
    for text in found.values():
        root = ET.fromstring(text)
        assert root.tag == "{http://www.w3.org/2000/svg}svg"
        assert INK not in text
        assert "currentColor" in text
        identifiers += [e.get("id") for e in root.iter() if e.get("id")]
    assert len(identifiers) == len(set(identifiers))


def test_pictures_are_always_the_same(points, replaced):
    wanted = Requirement(per_axis=1e-7).wanted
    for picture in pictures(points, wanted=wanted):
        assert "{" not in picture.caption
        if picture.name in ("before-after", "corrections"):
            written = (replaced.path.parent / f"{picture.name}.svg").read_text(encoding="utf-8")
            assert written == svg(picture.draw(), picture.name)


def test_a_figure_is_laid_out_once_and_drawn_once_where_it_is_saved(result, monkeypatch):
    """Matplotlib draws a figure with a layout once for nothing before it saves it."""
    figure, drawn, laid = residual_histogram(result), [], []
    draw, execute = type(figure.axes[0]).draw, ConstrainedLayoutEngine.execute
    monkeypatch.setattr(Axes, "draw", lambda axes, renderer: (drawn.append(axes), draw(axes, renderer)))
    monkeypatch.setattr(ConstrainedLayoutEngine, "execute", lambda *a: (laid.append(a), execute(*a)))
    svg(figure, "name")
    assert drawn == figure.axes
    assert len(laid) == 1
    FigureCanvasAgg(figure).draw()  # what is shown without being saved has both, too
    assert drawn == 2 * figure.axes


def test_references_stay_inside_the_picture(result):
    text = svg(residual_histogram(result), "name")
    root = ET.fromstring(text)
    known = {e.get("id") for e in root.iter()}
    for element in root.iter():
        for key, value in element.attrib.items():
            if key.endswith("href"):
                assert value[1:] in known
            if value.startswith("url(#"):
                assert value[5:-1] in known
