"""The first steps in a notebook: every cell runs as it is written, and its answer looks as one wants it."""

import ast
import json
import urllib.request
import webbrowser
from pathlib import Path

import matplotlib.figure
import pytest
from refusals import mentions

pytestmark = [pytest.mark.slow, pytest.mark.extra("reports")]
NOTEBOOKS = Path(__file__).parent / "notebooks"
NOTEBOOK = NOTEBOOKS / "first_steps.ipynb"
EXECUTED = ("identify_and_diagnose", "design_a_plate")
LARGEST = 5000
"""Characters of an answer in a terminal; a table fits a screen."""


def cells() -> list[str]:
    """Source of every code cell."""
    found = json.loads(NOTEBOOK.read_text(encoding="utf-8"))["cells"]
    return ["".join(cell["source"]) for cell in found if cell["cell_type"] == "code"]


def answer(source: str, names: dict) -> object:
    """Run a cell; the value of its last line, as a notebook shows it."""
    tree = ast.parse(source)
    last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, "cell", "exec"), names)
    return None if last is None else eval(compile(ast.Expression(last.value), "cell", "eval"), names)


@pytest.fixture(scope="module")
def answers(tmp_path_factory) -> dict[str, object]:
    """What every cell shows, by its source; and the names that the notebook leaves."""
    names: dict = {}
    opened: list[str] = []
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path_factory.mktemp("notebook"))
        patch.setattr(webbrowser, "open", opened.append)
        shown: dict[str, object] = {}
        for source in cells():
            if "stop()" in source:
                with urllib.request.urlopen(names["page"].url) as page:
                    shown["page"] = page.read()
                shown["session"] = names["page"].session
            value = answer(source, names)
            shown[source.splitlines()[-1]] = value
        shown["saved"] = Path("ur10.urdf").read_text()
    return {**shown, "opened": opened, "names": names}


def test_the_notebook_holds_the_snippet():
    """The lines that a notebook wants, as they were asked for."""
    text = "\n".join(cells())
    for line in (
        'arm = wb.load_robot("ur10")',
        'data = wb.read_measurements("ur10.csv")',
        "fit = wb.identify(arm, data, held_out=0.2)",
        "found = wb.diagnose(arm, data)",
        "found.plot()",
        'plate = wb.load_plate("table2")',
        "wb.score(arm, plate)",
        "better = wb.optimise_plate(arm, plate)",
        'fit.robot.save("ur10.urdf")',
        "wb.show(fit.robot, data, plate)",
    ):
        assert line in text


def test_answers_are_small_tables_in_a_terminal_and_in_a_notebook(answers):
    for name in ("fit", "found", "wb.score(arm, plate)", "better"):
        text, html = repr(answers[name]), answers[name]._repr_html_()
        assert 100 < len(text) < LARGEST, name
        assert max(map(len, text.splitlines())) <= 100, name
        assert "<table>" in html, name
        assert "mm" in html, name


def test_what_is_shown_first_is_what_one_asks(answers):
    fit, found = answers["names"]["fit"], answers["names"]["found"]
    assert "nominal" in repr(fit)
    assert "held out" in repr(fit)
    assert fit.error.before.position_mm.mean > 3 * fit.error.after.position_mm.mean  # the rest is an effect
    assert found.message in " ".join(repr(found).split())
    assert mentions(repr(found), "joint-compliance, joint 2")
    assert found.effects
    assert found.error.after.position_mm.mean < found.error.before.position_mm.mean


def test_pictures_are_figures_that_show_themselves(answers):
    for name in ("fit.plot()", "found.plot()", "better.plot()"):
        assert isinstance(answers[name], matplotlib.figure.Figure)
        assert answers[name]._repr_png_().startswith(b"\x89PNG")


def test_the_calibrated_arm_is_saved(answers):
    assert "<robot" in answers["saved"]


def test_the_page_shows_exactly_this(answers):
    names, session = answers["names"], answers["session"]
    assert b"<html" in answers["page"]
    assert answers["opened"] == [names["page"].url]
    assert names["page"].url.startswith("http://127.0.0.1:")
    assert session.robot is names["fit"].robot
    assert session.plate.targets is names["plate"].targets
    assert (session.measurements.loaded.dataset.q == names["data"].q).all()
    assert repr(names["page"]) == "<Page, stopped>"


@pytest.mark.parametrize("name", EXECUTED)
def test_executed_notebooks_show_what_they_say(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = NOTEBOOKS / f"{name}.ipynb"
    assert path.stat().st_size < 600_000
    names: dict = {}
    for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]:
        if cell["cell_type"] != "code":
            continue
        value, kept = answer("".join(cell["source"]), names), cell["outputs"]
        assert not [out for out in kept if out["output_type"] == "error"]
        kinds = {kind for out in kept for kind in out.get("data", {})}
        if isinstance(value, matplotlib.figure.Figure):
            assert "image/png" in kinds
        elif hasattr(value, "_repr_html_"):
            assert "text/html" in kinds
        else:
            assert not kinds & {"image/png", "text/html"}
