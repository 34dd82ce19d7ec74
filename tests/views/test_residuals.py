"""Residuals where they are: colours of the measured points, their scale, and what a click on one means."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from workbench import load_robot
from workbench.session.comparison import STAGES, Comparison, ModelStage, Overlay
from workbench.session.state import Focus
from workbench.views.appearance.colours import EXCLUDED, SET_APART, ErrorScale, css
from workbench.views.drawables.measured import error_scale, measured, selected_row_mark
from workbench.views.page.panels.legend import colour_bar, marks
from workbench.views.page.panels.row_errors import chart
from workbench.views.page.scene.picking import nearest_to_ray

ERRORS = 1e-3 * np.array([[1.0, 0.3, 0.1], [2.0, 0.2, 0.1], [4.0, 0.4, 0.2], [3.0, 0.3, 0.1]])


def comparison(stages=3) -> Comparison:
    """Four rows, the last held out, whose errors at the first stages are known."""
    places = np.array([[0.5, 0.0, 0.2], [0.4, 0.3, 0.3], [0.3, -0.2, 0.4], [0.6, 0.1, 0.1]])
    residuals = np.full((4, 3, 3), np.nan)
    residuals[:, :stages] = ERRORS[:, :stages, None] * [0.0, 0.6, 0.8]
    poses = np.tile(np.eye(4), (4, 1, 1))
    poses[:, :3, 3] = places + np.nan_to_num(residuals[:, 0])
    return Comparison(
        q=np.linspace(-1.0, 1.0, 24).reshape(4, 6),
        number=np.array([0, 1, 2, 7]),
        held_out=np.array([False, False, False, True]),
        kept_out=np.full(4, False),
        measured=places,
        nominal=poses,
        residuals=residuals,
        set_apart=np.arange(4) == 2,
        models=dict.fromkeys(STAGES[:stages], load_robot("aria")),
    )


def drawn(rows, *, overlay=None, focus=Focus.ROW, left_out=frozenset(), row=0):
    """What the page shows of the rows, by path."""
    session = SimpleNamespace(
        robot=load_robot("aria"),
        seen_rows=rows,
        results=SimpleNamespace(comparison=rows, row=row, accepted=len(rows.stages) > 2),
        choices=SimpleNamespace(overlay=overlay or Overlay()),
        measurements=SimpleNamespace(left_out=left_out),
        playback=SimpleNamespace(focus=focus),
    )
    items = [*measured(session), *selected_row_mark(session)]
    return {item.path: item.make(*item.inputs) for item in items if item.shown}


@pytest.mark.parametrize(
    ("stages", "shown"), [(1, ModelStage.NOMINAL), (2, ModelStage.GEOMETRY), (3, ModelStage.EFFECTS)]
)
def test_points_have_the_colour_of_their_error_at_the_last_known_stage(stages, shown):
    rows = comparison(stages)
    scene = drawn(rows)
    expected = error_scale(rows).colours(ERRORS[:, STAGES.index(shown)])
    assert np.array_equal(scene["measured"].colours, expected[:3])
    assert np.array_equal(scene["measured/held_out"].colours, expected[3:])
    assert (scene["measured"].are_squares, scene["measured/held_out"].are_squares) == (False, True)
    assert scene["measured/held_out"].numbers.tolist() == [3]


def test_a_stage_is_chosen_and_rows_left_out_are_grey():
    rows = comparison()
    scene = drawn(rows, overlay=Overlay(stage=ModelStage.NOMINAL), left_out=frozenset({1, 7}))
    expected = error_scale(rows).colours(ERRORS[:, 0])
    assert tuple(scene["measured"].colours[1]) == EXCLUDED
    assert np.array_equal(scene["measured"].colours[[0, 2]], expected[[0, 2]])
    assert tuple(scene["measured/held_out"].colours[0]) == EXCLUDED


def test_all_of_many_rows_are_drawn():
    rows, count = comparison(2), 11_911
    many = replace(
        rows,
        **{name: np.resize(getattr(rows, name), (count, *getattr(rows, name).shape[1:])) for name in
           ("q", "number", "held_out", "kept_out", "measured", "nominal", "residuals", "set_apart")},
    )  # fmt: skip
    scene = drawn(many)
    assert len(scene["measured"].places) + len(scene["measured/held_out"].places) == count
    arrows, few = scene["errors/nominal"], drawn(rows)["errors/nominal"]
    assert few.thick == 1.0
    assert 60 < len(arrows.starts) <= 120
    assert len(arrows.starts) * arrows.thick**2 <= 30.001  # more would hide the points


@pytest.mark.parametrize(
    ("errors", "low", "high", "ticks"),
    [
        (ERRORS, 1e-4, 5e-3, (1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 5e-3)),
        (ERRORS[:, :1], 1e-3, 1e-2, (1e-3, 2e-3, 5e-3, 1e-2)),
        (np.geomspace(1.1e-4, 7e-2, 99)[:, None], 1e-4, 0.1, (1e-4, 1e-3, 1e-2, 1e-1)),
        (np.geomspace(1.1e-5, 1.5e-2, 99)[:, None], 1e-5, 2e-2, (1e-5, 1e-4, 1e-3, 1e-2, 2e-2)),
        (np.zeros((5, 1)), 1e-6, 5e-6, (1e-6, 2e-6, 5e-6)),
    ],
)
def test_the_scale_has_round_ends_and_ticks_between(errors, low, high, ticks):
    scale = ErrorScale.of(errors)
    assert (scale.low, scale.high) == pytest.approx((low, high))
    assert scale.ticks == pytest.approx(ticks)
    text = colour_bar(scale)
    assert "≤" in text
    assert "mm" in text


def test_a_row_that_no_arm_explains_does_not_hide_the_others_at_the_foot_of_the_chart():
    links, words = dict.fromkeys(range(4), ""), dict(zip(STAGES, STAGES, strict=True))
    for out, colour, name in ((set(), SET_APART, "No arm explains"), ({2}, EXCLUDED, "Excluded")):
        shown, key = chart(comparison(2), 0, links, words, out), marks(comparison(2), out)
        assert css(colour) in shown
        assert f"{name}, beyond the edge" in shown
        assert (">0.3<" in shown, ">0.4<" in shown) == (True, False)  # the axis ends as before
        assert ("excluded" in key, "1 that no arm explains" in key) == (bool(out), not out)
        assert (drawn(comparison(2), left_out=frozenset(out))["measured/set_apart"] is None) == bool(out)


def test_a_click_means_the_nearest_point_under_the_pointer():
    places = np.array([[2.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.5, 0.5, 0.0], [-1.0, 0.0, 0.0]])
    ahead = np.array([1.0, 0.0, 0.0])
    assert nearest_to_ray(places, np.zeros(3), ahead) == (1.0, 1)
    aside = places[2] / np.linalg.norm(places[2])
    assert nearest_to_ray(places, np.zeros(3), aside)[1] == 2
    assert nearest_to_ray(places, np.zeros(3), np.array([0.0, 0.0, 1.0])) is None
