"""The page of a diagnosis and its pictures."""

import json
from dataclasses import replace

import numpy as np
import pytest
from html_page import Page
from scipy.interpolate import CubicSpline

from tests.diagnosis.test_diagnosis import DENT, HOSTILE, diagnosed, nothing
from workbench import load_robot
from workbench.arm.effects import EFFECTS
from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.diagnosis.report.results_json import diagnosis_json
from workbench.extras.reports import diagnosis_figures
from workbench.extras.reports.apparent_errors import FinalRows
from workbench.extras.reports.diagnosis_page import PAGE, PICTURES, RESULT, write_diagnosis
from workbench.extras.reports.effect_plots import BAND_ERRORS, shapes
from workbench.identification.problem import Problem
from workbench.plate.simulated_measurement import measure_poses

__all__ = ["diagnosed", "nothing"]


@pytest.fixture(scope="module")
def page(diagnosed, tmp_path_factory):
    path = write_diagnosis(diagnosed, tmp_path_factory.mktemp("report") / "new")
    parsed = Page()
    parsed.feed(path.read_text(encoding="utf-8"))
    return path, parsed


def test_the_folder_has_everything(page, diagnosed):
    path, parsed = page
    names = {"errors", "ranking", "effect-1", "effect-2", "shapes", "structure", "arrows"}
    wanted = {PAGE, RESULT, *(f"diagnosis-{name}.png" for name in names)}
    assert {p.name for p in path.parent.iterdir()} == wanted
    assert json.loads((path.parent / RESULT).read_text()) == json.loads(json.dumps(diagnosis_json(diagnosed)))
    assert all(p.read_bytes().startswith(b"\x89PNG") for p in path.parent.glob("*.png"))
    assert parsed.stack == []
    assert parsed.tags.count("figure") == len(names)


def test_the_page_needs_nothing_else_and_believes_nobody(page, diagnosed):
    _, parsed = page
    links = [v for k, v in parsed.attributes if k in ("src", "href", "xlink:href") and v]
    assert all(v.startswith(("#", "data:image/png;base64,")) for v in links)
    assert "script" not in parsed.tags
    assert HOSTILE in "".join(parsed.text)
    assert diagnosed.message in "".join(parsed.text)


def test_an_older_report_goes(nothing, page, tmp_path):
    folder = tmp_path / "report"
    folder.mkdir()
    (folder / "diagnosis-effect-7.png").write_bytes(b"old")
    (folder / "mine.txt").write_text("kept")
    write_diagnosis(nothing, folder)
    assert {p.name for p in folder.iterdir()} == {
        PAGE,
        RESULT,
        "mine.txt",
        *(f"diagnosis-{name}.png" for name in ("errors", "ranking", "structure", "arrows")),
    }
    assert "geometry alone explains" in (folder / PAGE).read_text()


def test_the_drawn_shape_is_the_hidden_one_within_its_band(diagnosed):
    (axes,) = [a for a in shapes(diagnosed).axes if a.get_title() == "joint 4"]
    (drawn,) = [line for line in axes.lines if line.get_label() == "error of the joint"]
    degrees, shape = drawn.get_xdata(), drawn.get_ydata()
    hidden = CubicSpline(DENT.knots, DENT.coefficients, bc_type="clamped")
    fitted = diagnosed.after_fit.problem.data.q[:, 3]
    hidden = 1e3 * (hidden(np.deg2rad(degrees)) - hidden(fitted).mean())
    band = axes.collections[0].get_paths()[0].vertices[1 : len(degrees) + 1, 1]
    std = np.abs(band - shape) / BAND_ERRORS
    assert np.abs(hidden).max() > 1.0
    assert np.mean(np.abs(shape - hidden) < 3.0 * std + 0.05) > 0.95


@pytest.mark.parametrize("name", list(EFFECTS))
def test_rows_show_the_law_of_every_effect(name):
    """At a model without the effect, exact rows show its law in the increment over its driver."""
    robot = load_robot("aria")
    text = name if EFFECTS[name].whole_arm else f"{name}:3"
    actual, rows = measure_poses(robot, 40, effects=(text,), actual=robot, instrument="ideal", seed=4)
    (effect,) = actual.effects
    alone = replace(effect, coefficients=_only_last(effect))
    data = replace(_exact(robot.with_effects(alone), rows), sigma=None)
    zero = replace(alone, coefficients=(0.0,) * len(effect.names))
    missing = FinalRows((Problem.build(robot.with_effects(zero), data, free=()),), 1.0)
    full = FinalRows((Problem.build(robot.with_effects(alone), data, free=()),), 1.0)
    view = alone.views(full.state)[-1]
    found, std = missing.along(view.elements, view.direction)
    sure = std < 4.0 * np.median(std)
    assert np.abs(view.law).max() > 1e-6
    assert np.abs(found - view.law)[sure].max() < 0.02 * np.abs(view.law).max()
    left, _ = full.along(view.elements, view.direction)
    assert np.abs(left).max() < 1e-3 * np.abs(view.law).max()


def _only_last(effect):
    """All of a joint's shape, or the last of coefficients that act on elements of their own."""
    if effect.name in ("link-flexure", "base-drift", "frame-step", "tool-step"):
        return (*[0.0] * (len(effect.names) - 1), effect.coefficients[-1])
    return effect.coefficients


def _exact(robot, rows):
    """The rows as a robot would be measured without noise."""
    poses = tool_poses(robot, Motion.of(rows))
    return replace(rows, position=poses[:, :3, 3], rotation=poses[:, :3, :3])


def test_a_picture_that_fails_is_left_out_of_the_report(nothing, monkeypatch, tmp_path):
    def failing(*_, **__):
        raise np.linalg.LinAlgError("Singular matrix")

    monkeypatch.setattr(diagnosis_figures, "ranking", failing)
    page = write_diagnosis(nothing, tmp_path / "out")
    assert "Singular matrix" in page.read_text()
    pictures = {path.stem.removeprefix(PICTURES) for path in page.parent.glob("*.png")}
    assert {"errors", "arrows"} < pictures
    assert "ranking" not in pictures
