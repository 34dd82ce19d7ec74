"""Panels without a browser: every control explains itself, and strange text stays text."""

from contextlib import suppress
from dataclasses import replace
from time import monotonic, sleep
from types import SimpleNamespace

import numpy as np
from driven_effects import tracked_file
from session_at_work import carry_out
from viser import GuiHtmlHandle
from viser._messages import GuiUpdateMessage

from workbench.report.numbers import compared
from workbench.session.commands.data import LoadData, MeasureVirtualArm
from workbench.session.commands.drag import DropTarget, GrabTarget, MoveTarget, SelectTarget
from workbench.session.commands.identify import Identify, LeaveRowsOut
from workbench.session.commands.messages import OpenTab, Tell
from workbench.session.page_state import Severity, Tab
from workbench.session.stages import stages
from workbench.session.state import Focus
from workbench.views.drawables.drawable import Points
from workbench.views.drawables.sink import Item
from workbench.views.page.html import sparkline
from workbench.views.page.panels.index import OTHERWISE, headline


def done(app, *commands):
    """Carry commands out, one after the other."""
    carry_out(app.worker, *commands)


def test_every_control_has_a_tooltip(app):
    assert len(controls(app)) > 60
    assert [c.label for c in controls(app) if hasattr(c, "label") and not c.hint] == []


def test_text_from_outside_is_escaped(app):
    done(app, Tell("<script>alert(1)</script>"))
    assert "&lt;script&gt;" in html_of(app, "message")
    assert "<script>" not in html_of(app, "message")


def test_typed_coordinates_keep_all_digits_of_those_not_touched(app):
    plate = app.worker.session.plate
    assert control(app, "x, y, z [mm]").value == (566.0, 354.0, 235.0)
    assert control(app, "Angles [°]").value == (-150.0, 0.0, 0.0)
    change(app, "x, y, z [mm]", (600.0, 354.0, 235.0))
    assert app.worker.wait()
    moved = app.worker.session.plate.targets[0]
    assert tuple(moved.xyz) == (0.6, *plate.targets[0].xyz[1:])
    assert tuple(moved.rpy) == tuple(plate.targets[0].rpy)


def test_in_a_drag_the_numbers_that_count_go_ahead_of_the_scene(app, monkeypatch):
    messages, flushed = [], []
    queue = type(app.server._websock_server).queue_message
    monkeypatch.setattr(
        type(app.server._websock_server),
        "queue_message",
        lambda server, message: (messages.append(message), queue(server, message)),
    )
    monkeypatch.setattr(app.server, "flush", lambda: flushed.append(len(messages)))
    done(app, GrabTarget(0, 1))
    messages.clear(), flushed.clear()
    done(app, MoveTarget(0, (0.55, 0.35, 0.24), (-2.6, 0.0, 0.0), client=1))
    ahead = messages[: flushed[0]]
    assert len(flushed) == 2
    assert len(messages) > len(ahead)
    assert {type(m) for m in ahead} == {GuiUpdateMessage}
    assert compared(1e3 * app.worker.session.score.position) in ahead[0].updates["content"]
    done(app, DropTarget(1))


def test_what_is_put_off_in_a_drag_comes_once_the_hand_is_still(app):
    app.worker.submit(GrabTarget(0, 1))
    for x in (0.56, 0.55, 0.54):
        done(app, MoveTarget(0, (x, 0.35, 0.24), (-2.6, 0.0, 0.0), client=1))
    end = monotonic() + 60.0
    while control(app, "x, y, z [mm]").value[0] != 540.0 and monotonic() < end:
        sleep(0.05)
    assert control(app, "x, y, z [mm]").value[0] == 540.0
    assert app.worker.session.drag is not None
    assert html_of(app, "index").count("<polyline") == 2
    assert "<polyline" in sparkline([1.0, np.inf, 2.0])
    done(app, DropTarget(1))


def test_a_click_means_a_target_before_its_points_and_both_before_a_cube_in_front_of_them(app):
    session, scene = app.worker.session, app.view._scene
    place, down = session.plate.targets[3].xyz, np.array([0.0, 0.0, -1.0])
    ray = SimpleNamespace(ray_origin=place - down, ray_direction=down)
    point = Points(
        places=place[None] + [0.0, 0.0, 5e-5],
        colours=np.zeros((1, 3), np.uint8),
        radius=1e-3,
        numbers=np.arange(1),
    )
    with scene._lock:
        scene._sink.update([Item("measured/fitted", lambda: point, ())])
    scene._clicked(ray)
    app.worker.wait()
    assert app.worker.session.playback.focus is Focus.TARGET
    assert app.worker.session.selected == 3


def test_what_needs_data_is_off_or_not_there_until_there_are_some(app):
    def is_off(label):
        return control(app, label).disabled or not control(app, label).visible

    labels = ("Measurements (CSV)", "Calculate", "Data row")
    assert all(is_off(label) for label in labels)
    assert not is_off("Plate (TOML)")
    done(app, MeasureVirtualArm(2), LeaveRowsOut((0,)), Identify(("ols",)))
    assert "not fitted: data row 0 (excluded manually)" in html_of(app, "warnings")
    results = app.worker.session.results
    assert results.row == np.nanargmax(results.comparison.stage_errors[:, 1])
    assert "Excluded by hand: rows" in html_of(app, "row-chart")
    mean, _, most, _ = map(compared, stages(app.worker.session)[1].errors.position_mm)
    assert all(f">{size}</td>" in html_of(app, "comparison") for size in (mean, most))
    for row, does in ((1, "Exclude data row 1<"), (0, "Use data row 0 again")):
        change(app, "Data row", row)
        assert app.worker.wait()
        assert f"Data row {row}</b> (from 0; {'' if row else 'excluded'}" in html_of(app, "residuals")
        assert does in html_of(app, "row-chart")
        assert not any(is_off(label) for label in labels)


def test_where_the_index_says_otherwise_the_error_judges(app):
    first = app.worker.session
    for worse, judges in ((1.1, True), (0.9, False)):
        indices = {name: worse * value for name, value in first.score.indices.items()}
        score = replace(first.score, position=1.1 * first.score.position, indices=indices)
        assert (OTHERWISE in headline(replace(first, plate=replace(first.plate), score=score), ())) is judges


def controls(app):
    return list(app.server.gui._gui_input_handle_from_uuid.values())


def control(app, label):
    """The control of this label."""
    return next(c for c in controls(app) if getattr(c, "label", "") == label)


def change(app, label, value):
    """What a user types into the control of this label."""
    changed = control(app, label)
    changed.value = value
    for callback in changed._impl.update_cb:
        with suppress(StopIteration):
            callback(SimpleNamespace(client_id=1, target=changed)).send(None)


def html_of(app, testid):
    """What a panel shows by this name; empty while it is not there."""
    each = (f.control for p in app.view._panels for f in p._controls)
    shown = (control for control in each if isinstance(control, GuiHtmlHandle))
    return next((c.content for c in shown if c.visible and f'data-testid="{testid}"' in c.content), "")


def test_a_refused_entry_goes_back_and_a_typed_pose_stays(app):
    place, tool = control(app, "x, y, z [mm]"), control(app, "Tool x, y, z [mm]")
    before = place.value
    tool.value = (1.0, 2.0, 3.0)
    change(app, "x, y, z [mm]", (1e6, 0.0, 0.0))
    assert app.worker.wait(60.0)
    assert app.worker.session.page.messages[-1].severity is Severity.ERROR
    assert place.value == before
    assert tuple(tool.value) == (1.0, 2.0, 3.0)


def test_targets_that_are_not_in_the_scene_cannot_be_edited_until_the_plate_is_shown(app, tmp_path):
    """Their fields moved blocks that nobody saw."""
    arm, rng = app.worker.session.robot, np.random.default_rng(4)
    file = tracked_file(arm, tmp_path / "rows.csv", rng, rows=30, reach=1.5)
    done(app, LoadData("rows.csv", file.read_bytes()))
    edits = [control(app, label) for label in ("x, y, z [mm]", "Angles [°]", "Branch", "Locked")]
    (group,) = (c for c in controls(app) if "Delete" in getattr(c, "options", ()))
    done(app, OpenTab(Tab.PLATE))
    assert (app.worker.session.shows_plate, group.visible) == (False, False)
    assert control(app, "Show the plate").visible
    assert all(edit.disabled for edit in edits)
    done(app, SelectTarget(3))
    assert app.worker.session.shows_plate
    assert group.visible
    assert not any(edit.disabled for edit in edits)
