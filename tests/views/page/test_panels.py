"""Panels without a browser: every control explains itself, and strange text stays text."""

import io
import re
import tempfile
import warnings
import zipfile
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from threading import Event
from time import monotonic, sleep
from types import SimpleNamespace

import imageio.v3
import numpy as np
import pytest
from refusals import refuses
from viser import GuiHtmlHandle
from viser._assignable_props_api import AssignablePropsBase
from viser._messages import GuiUpdateMessage

from workbench.arm.built_in_arms import load_robot
from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.base.errors import OptionError
from workbench.data.readers import read_measurements
from workbench.data.readers.layouts import LAYOUTS
from workbench.data.readers.layouts.layout import AbstractFileLayout
from workbench.data.readers.preview import Preview
from workbench.data.simulation.instruments import instrument_named
from workbench.data.simulation.simulate import simulate
from workbench.data.writer import write_measurements
from workbench.identification.algorithms import ALGORITHMS, AbstractIdentifier
from workbench.identification.algorithms.ols import Ols
from workbench.identification.checks.arm_match import ArmMatch
from workbench.plate.export import ExportedPlate
from workbench.plate.plate_toml import load_plate, read_plate
from workbench.plate.region import Region
from workbench.report.result_page import page_of
from workbench.session.commands.arm import ChooseRobot, LoadModel
from workbench.session.commands.compare import SetUnits, ShowFit
from workbench.session.commands.data import LoadData, MeasureVirtualArm
from workbench.session.commands.drag import DropTarget, GrabTarget, MoveTarget, SelectTarget
from workbench.session.commands.identify import Identify
from workbench.session.commands.messages import OpenTab, Tell
from workbench.session.commands.plate import SetNoise
from workbench.session.export import (
    calibrated_toml,
    calibrated_urdf,
    fixture_zip,
    measurements_csv,
    plate_toml,
    report_zip,
)
from workbench.session.journal.codec import decode
from workbench.session.loaded_measurements import MeasurementFile
from workbench.session.next_step import next_step
from workbench.session.page_state import Severity, Tab, Units
from workbench.session.state import Focus
from workbench.session.worker import Worker
from workbench.views.appearance.colours import SKY
from workbench.views.drawables.drawable import Cubes, Points
from workbench.views.drawables.sink import Item
from workbench.views.page import app as page_app
from workbench.views.page import html
from workbench.views.page.local_server import local_server
from workbench.views.page.panels import PANELS, fit
from workbench.views.page.panels.files import FilesPanel
from workbench.views.page.panels.fit import read_rows
from workbench.views.page.panels.header import Header
from workbench.views.page.panels.history import HistoryPanel
from workbench.views.page.panels.start_card import StartCard, load
from workbench.views.page.render import BrowserView
from workbench.views.page.style import RULES
from workbench.views.page.tabs import Tabs
from workbench.views.page.viser_internals import controls


def test_every_control_has_a_tooltip(app):
    controls = list(app.server.gui._gui_input_handle_from_uuid.values())
    assert len(controls) > 60
    assert [c.label for c in controls if hasattr(c, "label") and not c.hint] == []


def test_text_from_outside_is_escaped(app):
    app.worker.submit(Tell("<script>alert(1)</script>"))
    app.worker.wait()
    assert "&lt;script&gt;" in html_of(app, "message")
    assert "<script>" not in html_of(app, "message")


def test_what_a_reader_is_added_for_can_be_chosen_on_the_page(request):
    class Ninth(AbstractFileLayout):
        name, endings = "ninth", (".ninth",)

        def matches(self, path, head):
            return path.suffix == ".ninth"

        def read(self, path, naming):
            raise NotImplementedError

    LAYOUTS.register(Ninth())
    request.addfinalizer(lambda: LAYOUTS.remove("ninth"))
    made = page_app.App(load_robot("aria"), load_plate("table2"))
    request.addfinalizer(made.close)
    taken = [h.mime_type.split(",") for h in controls(made.server.gui).values() if hasattr(h, "mime_type")]
    offered = [endings for endings in taken if ".parquet" in endings]
    assert offered
    assert all({".ninth", ".csv", ".xlsx"} <= {*endings} for endings in offered)


def test_a_page_is_lit_before_it_has_anything_and_gets_the_arm_before_the_panels(untouched):
    server = local_server()
    try:
        server._websock_server.queue_message, sent = (messages := []).append, []
        server.flush = lambda: sent.append(len(messages))
        worker = Worker(untouched)
        BrowserView(server, worker)
        worker.close()
    finally:
        server.stop()
    kinds = [type(message).__name__ for message in messages]
    assert {"MeshMessage", "GuiButtonMessage"} & {*kinds[: sent[0]]} == {"MeshMessage"}
    assert {"EnvironmentMapMessage", "EnableLightsMessage"} & {*kinds} == set()


def test_in_a_drag_the_numbers_that_count_go_ahead_of_the_scene(app, monkeypatch):
    messages, flushed = [], []
    queue = type(app.server._websock_server).queue_message
    monkeypatch.setattr(
        type(app.server._websock_server),
        "queue_message",
        lambda server, message: (messages.append(message), queue(server, message)),
    )
    monkeypatch.setattr(app.server, "flush", lambda: flushed.append(len(messages)))
    app.worker.submit(GrabTarget(0, 1))
    app.worker.wait()
    messages.clear(), flushed.clear()
    app.worker.submit(MoveTarget(0, (0.55, 0.35, 0.24), (-2.6, 0.0, 0.0), client=1))
    app.worker.wait()
    ahead = messages[: flushed[0]]
    assert len(flushed) == 2
    assert len(messages) > len(ahead)
    assert {type(m) for m in ahead} == {GuiUpdateMessage}
    assert html.number(1e3 * app.worker.session.score.position) in ahead[0].updates["content"]
    app.worker.submit(DropTarget(1))
    app.worker.wait()


def test_what_is_put_off_in_a_drag_comes_once_the_hand_is_still(app):
    app.worker.submit(GrabTarget(0, 1))
    for x in (0.56, 0.55, 0.54):
        app.worker.submit(MoveTarget(0, (x, 0.35, 0.24), (-2.6, 0.0, 0.0), client=1))
        app.worker.wait()
    end = monotonic() + 60.0
    while control(app, "x, y, z [mm]").value[0] != 540.0 and monotonic() < end:
        sleep(0.05)
    assert control(app, "x, y, z [mm]").value[0] == 540.0
    assert app.worker.session.drag is not None
    app.worker.submit(DropTarget(1))
    app.worker.wait()


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
    region = Region(min=place - 0.2, max=place + 0.2, cube=0.4)
    one = np.ones(1, bool)
    cube = Cubes(region=region, shown=one, known=one, colours=np.zeros((1, 3), np.uint8), picked=None)
    inward = np.mean([target.xyz for target in session.plate.targets], axis=0) - place
    aside = ray.ray_origin + 0.1 * inward / np.linalg.norm(inward)
    for origin, clicked in ((ray.ray_origin, None), (aside, 0)):
        with scene._lock:
            scene._sink.update([Item("region/cubes", lambda *given: cube, (object(),))])
        scene._clicked(SimpleNamespace(ray_origin=origin, ray_direction=down))
        app.worker.wait()
        assert app.worker.session.selected == 3
        assert app.worker.session.region.view.picked == clicked


def test_no_selector_makes_a_browser_search_the_page_at_every_change():
    rules = RULES.partition("@media")[0]  # the others are for phones
    rare = r"(?:> )?(?:\[data-(?!testid)[\w-]+=\"1\"\]|\[accept\]|\.[\w-]+)"
    assert rules.count(":has(") > 5
    assert re.findall(rf":has\((?!{rare}\))", rules) == []


def test_a_saved_picture_has_the_sky_of_the_page(app):
    saved = []
    nothing = np.zeros((4, 6, 4), np.uint8)
    client = SimpleNamespace(
        get_render=lambda *size, **options: nothing,
        send_file_download=lambda name, content, **options: saved.append(content),
    )
    panel = next(p for p in app.view._panels if isinstance(p, FilesPanel))
    panel._picture(SimpleNamespace(client=client))
    assert (imageio.v3.imread(saved[0]) == SKY).all()


def test_the_first_hint_is_there(app):
    assert "Drag an arrow" in next_step(app.worker.session).sentence


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        (0.0, "0"),
        (0.19702, "0.197"),
        (4339.9, "4 340"),
        (12.286, "12.3"),
        (np.nan, "–"),
        (np.inf, "∞"),
        (-0.5, "-0.500"),
    ],
)
def test_numbers(value, shown):
    assert html.number(value) == shown


def test_changes_are_green_where_better():
    assert html.GOOD in html.change(2.0, 1.0, larger_is_better=True)
    assert html.BAD in html.change(2.0, 1.0, larger_is_better=False)
    assert html.change(np.inf, 1.0, larger_is_better=True) == ""


def test_coordinates_are_shown_and_typed_in_metres_and_radians_too(app):
    plate = app.worker.session.plate
    assert control(app, "x, y, z [mm]").value == (566.0, 354.0, 235.0)
    app.worker.submit(SetUnits(Units.METRES))
    assert app.worker.wait()
    assert control(app, "x, y, z [m]").value == (0.566, 0.354, 0.235)
    assert control(app, "Angles [rad]").value == (-2.61799, 0.0, 0.0)
    change(app, "x, y, z [m]", (0.6, 0.354, 0.235))
    assert app.worker.wait()
    moved = app.worker.session.plate.targets[0]
    assert tuple(moved.xyz) == (0.6, *plate.targets[0].xyz[1:])
    assert tuple(moved.rpy) == tuple(plate.targets[0].rpy)


def test_row_numbers_are_read_as_people_write_them():
    assert read_rows(" 3, 17;20-22 ") == (3, 17, 20, 21, 22)
    assert read_rows("") == ()
    with refuses(OptionError, option="rows", found="seven"):
        read_rows("seven")


def test_the_card_opens_again_beside_a_file_of_another_arm_and_closes_at_the_next(app):
    """It closed at once while such a file was there: its button seemed dead."""
    match = ArmMatch(robot="ARIA", rival="panda", joints=(7, 6))
    file, sent = MeasurementFile("seven.csv", b"", Preview(path="seven.csv"), match=match), []
    session = replace(app.worker.session, measurements=replace(app.worker.session.measurements, unread=file))
    card = StartCard(SimpleNamespace(session=session, submit=sent.append), lambda: None)
    card._open(app.server.gui)
    card.show(replace(session, page=replace(session.page, message_count=session.page.message_count + 1)))
    assert not sent
    card.show(
        replace(session, measurements=replace(session.measurements, unread=replace(file, name="eight.csv")))
    )
    assert [command.tab for command in sent] == [Tab.CALIBRATE]


def test_a_file_on_the_wrong_button_of_the_card_is_taken_for_what_it_is():
    assert [type(load(name, b"")) for name in ("Arm.URDF", "arm.xacro", "rows.csv", "rows.XLSX")] == [
        LoadModel,
        LoadModel,
        LoadData,
        LoadData,
    ]


def test_what_needs_data_is_off_or_not_there_until_there_are_some(app):
    def is_off(label):
        return control(app, label).disabled or not control(app, label).visible

    labels = ("Measurements (CSV)", "Calculate", "Pose", "Exclude this row")
    assert all(is_off(label) for label in labels)
    assert not is_off("Plate (TOML)")
    app.worker.submit(MeasureVirtualArm(2))
    app.worker.submit(Identify(("ols",)))
    assert app.worker.wait(60.0)
    app.worker.submit(Identify(("ols",)))
    assert app.worker.wait(60.0)
    assert not any(is_off(label) for label in labels)


def test_another_robot_rebuilds_scene_and_panels(app):
    app.worker.submit(ChooseRobot("panda"))
    assert app.worker.wait(60.0)
    labels = [getattr(c, "label", "") for c in app.server.gui._gui_input_handle_from_uuid.values()]
    assert "Joint 7 [°]" in labels
    names = list(app.server.scene._handle_from_node_name)
    assert "/arm/nominal/body7" in names
    assert sum(name.startswith("/plate/targets/") and name.endswith("/number") for name in names) == len(
        app.worker.session.plate
    )


def _waited(app):
    sleep(0.05)
    return app.worker.wait(60.0)


@pytest.mark.extra("reports")
def test_exports_are_files_that_can_be_read_again(app, tmp_path, monkeypatch):
    def write_report(page, found, folder, *, wanted):
        assert (found, wanted) == (session.results.identification, session.choices.wanted)
        folder.mkdir()
        (folder / "report.html").write_text("")

    monkeypatch.setattr(type(page_of("Identification")), "write", write_report)
    app.worker.submit(MeasureVirtualArm(2))
    app.worker.wait(60.0)
    app.worker.submit(Identify(("opt2",)))
    app.worker.wait(60.0)
    session = app.worker.session
    made = {}
    for make in (plate_toml, measurements_csv, calibrated_toml, calibrated_urdf, report_zip):
        name, content = make(session)
        (tmp_path / name).write_bytes(content)
        made[make] = tmp_path / name
    assert len(read_plate(made[plate_toml])) == 10
    assert len(read_measurements(made[measurements_csv], joints=6)) == 10
    q = session.results.comparison.q[:5]
    wanted = tool_poses(session.results.identification.runs["opt2"].calibrated, Motion(q))
    for path in (made[calibrated_toml], made[calibrated_urdf]):
        assert np.abs(tool_poses(load_robot(path), Motion(q)) - wanted).max() < 1e-9
    assert zipfile.ZipFile(made[report_zip]).namelist() == ["report/report.html"]


def test_the_plate_to_make_is_packed_with_all_that_is_made_of_it(app, monkeypatch):
    session, made = app.worker.session, []

    def export(plate, folder, **options):
        made.append((plate, options))
        folder.mkdir()
        (folder / "plate.stl").write_text("")
        return ExportedPlate((), {"pdf": "no ezdxf"}, ("no mounting holes",))

    monkeypatch.setattr("workbench.plate.export.export_plate", export)
    name, content, notes = fixture_zip(session)
    assert name.endswith("-fixture.zip")
    assert zipfile.ZipFile(io.BytesIO(content)).namelist() == ["fixture/plate.stl"]
    noise = session.noise.position, session.noise.rotation
    options = {"robot": session.robot, "sigma": noise, "evaluation_poses": session.region.q}
    ((plate, given),) = made
    assert given == options  # of the usual files
    assert plate.region is session.plate.region
    assert all(target.q is state.q for target, state in zip(plate.targets, session.states, strict=True))
    assert len(notes) == 2


def test_what_must_be_known_before_a_plate_is_made_is_told_on_the_page(app):
    noted = ("plate.zip", b"", ("no mounting holes", "no drawings"))
    panel = app.view._panels[0]
    panel.save(SimpleNamespace(client=None), lambda session: noted)
    assert app.worker.wait(10.0)
    (told,) = (m for m in app.worker.session.page.messages if "plate.zip" in m.text)
    assert told.severity is Severity.WARNING
    assert all(note in told.text for note in noted[2])


def test_a_few_poses_tell_whether_the_robot_as_opened_still_holds(app):
    app.worker.submit(MeasureVirtualArm(2))
    assert app.worker.wait(60.0)
    rows = app.worker.session.results.comparison
    mean = 1e3 * np.linalg.norm(rows.measured - rows.nominal[:, :3, 3], axis=1).mean()
    assert f"{html.number(mean)} mm" in html_of(app, "row")


def control(app, label):
    """The control of this label."""
    return next(c for c in controls(app.server.gui).values() if getattr(c, "label", "") == label)


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


def test_every_algorithm_can_be_chosen_on_the_page(app):
    assert all(control(app, algorithm.title).hint for algorithm in ALGORITHMS.values())
    for command in (MeasureVirtualArm(2), Identify(("influence", "opt2"))):
        app.worker.submit(command)
        assert app.worker.wait(60.0)
    assert tuple(control(app, "Shown fit").options) == ("INFLUENCE", "OPT2")
    app.worker.submit(ShowFit("influence"))
    assert app.worker.wait(60.0)
    assert control(app, "Shown fit").value == "INFLUENCE"


def test_a_move_sets_only_what_it_changes(app, monkeypatch):
    """Of the panels, the selected target and its indices are drawn at every move; the others wait."""
    assigned = []
    real = AssignablePropsBase.__setattr__
    session = GrabTarget(0, 1).apply(app.worker.session)
    x, y, z = session.plate.targets[0].xyz
    for panel in app.view._panels:
        panel.update(session)

    def count(handle, name, value):
        assigned.append((type(handle).__name__, name))
        real(handle, name, value)

    monkeypatch.setattr(AssignablePropsBase, "__setattr__", count)
    for k in range(1, 6):
        session = MoveTarget(0, (x, y, z + 1e-3 * k), (-2.6, 0.0, 0.0), 1).apply(session)
        for panel in app.view._panels:
            panel.update(session)
    assert len(assigned) <= 5 * 15
    monkeypatch.undo()
    jog = control(app, "Joint 2 [°]")
    before = jog.value
    app.view.draw(DropTarget(1).apply(session))
    assert jog.value != before


def test_a_refused_entry_goes_back_and_a_typed_pose_stays(app):
    place, tool = control(app, "x, y, z [mm]"), control(app, "Tool [mm]")
    before = place.value
    tool.value = (1.0, 2.0, 3.0)
    change(app, "x, y, z [mm]", (1e6, 0.0, 0.0))
    assert app.worker.wait(60.0)
    assert app.worker.session.page.messages[-1].severity is Severity.ERROR
    assert place.value == before
    assert tuple(tool.value) == (1.0, 2.0, 3.0)


def test_a_message_draws_no_figure_again(app, monkeypatch):
    drawn = []
    real = fit.constant_bars
    monkeypatch.setattr(fit, "constant_bars", lambda found: drawn.append(1) or real(found))
    for command in (MeasureVirtualArm(2), Identify(("opt2",)), Tell("one"), Tell("two")):
        app.worker.submit(command)
        assert app.worker.wait(60.0)
    assert len(drawn) == 1


def test_a_panel_that_raises_stops_no_other_and_is_named_once(app, monkeypatch):
    """All panels behind it stood still without a word."""

    def raises(self, session):
        raise RuntimeError("no humidity")

    monkeypatch.setattr(app.view, "_failed", set())
    monkeypatch.setattr(HistoryPanel, "show", raises)
    with warnings.catch_warnings(record=True) as reported:
        warnings.simplefilter("always")
        for number, position in ((3, 2e-4), (4, 3e-4)):
            app.worker.submit(SelectTarget(number))
            app.worker.submit(SetNoise(position, 1e-3))
            assert app.worker.wait()
    (reported,) = map(str, (w.message for w in reported))
    assert "test_panels.py" in reported
    assert control(app, "Noise [mm]").value == 0.3
    (message,) = [m for m in app.worker.session.page.messages if "humidity" in m.text]
    assert message.severity is Severity.WARNING
    assert "HistoryPanel" in message.text


def test_a_scene_that_raises_stops_no_panel(app, monkeypatch):
    def raises(session):
        raise RuntimeError("no light")

    monkeypatch.setattr(app.view, "_failed", set())
    monkeypatch.setattr(app.view._scene, "show", raises)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        app.worker.submit(SetNoise(4e-4, 1e-3))
        assert app.worker.wait()
    assert control(app, "Noise [mm]").value == 0.4
    assert any("no light" in message.text for message in app.worker.session.page.messages)


def test_an_algorithm_that_was_registered_later_is_shown_like_the_others(app):
    class Late(AbstractIdentifier):
        name, title, summary = "late", "LATE", "Gauss-Newton under another name."

        def search(self, problem):
            return Ols().search(problem)

    ALGORITHMS.register(Late())
    try:
        for command in (MeasureVirtualArm(2), Identify(("late", "opt2"))):
            app.worker.submit(command)
            assert app.worker.wait(60.0)
        app.worker.submit(ShowFit("late"))
        assert app.worker.wait(60.0)
        assert app.worker.session.results.fit == "late"
        assert tuple(control(app, "Shown fit").options) == ("LATE", "OPT2")
        assert control(app, "Shown fit").value == "LATE"
    finally:
        ALGORITHMS.remove("late")


def test_targets_that_are_not_in_the_scene_cannot_be_edited_until_the_plate_is_shown(app):
    """Their fields moved blocks that nobody saw."""
    rows = simulate(
        app.worker.session.robot,
        Motion(np.random.default_rng(4).uniform(-1.5, 1.5, (30, 6))),
        instrument=instrument_named("tracker-6d"),
        rng=np.random.default_rng(4),
    )
    with tempfile.TemporaryDirectory() as folder:
        file = write_measurements(rows, Path(folder) / "rows.csv").read_bytes()
    app.worker.submit(LoadData("rows.csv", file))
    assert app.worker.wait(60.0)
    edits = [control(app, label) for label in ("x, y, z [mm]", "Angles [°]", "Branch", "Locked")]
    (group,) = (c for c in controls(app.server.gui).values() if "Copy" in getattr(c, "options", ()))
    show = control(app, "Show the plate")
    assert not app.worker.session.shows_plate
    assert (show.visible, group.visible) == (True, False)
    assert all(edit.disabled for edit in edits)
    app.worker.submit(SelectTarget(3))
    assert app.worker.wait(60.0)
    assert app.worker.session.shows_plate
    assert (show.visible, group.visible) == (False, True)
    assert not any(edit.disabled for edit in edits)


def test_a_page_that_comes_before_the_tabs_opens_the_first_one_once_they_are_there():
    """After a restart the pages that were open come while the panel is made: no such tab was found."""
    sent, group = [], SimpleNamespace(_tab_labels=(), _tab_icons_html=(), _tab_container_ids=())

    def add_tab(tab):
        for name in names:
            setattr(group, name, (*getattr(group, name), tab))

    names = (*vars(group),)
    group.add_tab, group._impl = add_tab, SimpleNamespace(uuid="tabs")
    interface = SimpleNamespace(queue_message=lambda message: sent.append(message.updates["_tab_labels"]))
    shown = SimpleNamespace(remove=lambda: None)
    gui = SimpleNamespace(_websock_interface=interface, add_html=lambda sign: shown)
    client = SimpleNamespace(client_id=7, gui=gui)
    server = SimpleNamespace(
        gui=SimpleNamespace(add_tab_group=lambda: group),
        get_clients=lambda: {7: client},
        on_client_connect=lambda call: call(client),  # one is there already
    )
    drawn = Event()
    drawn.set()
    messages = SimpleNamespace(drawn=lambda text: ("", drawn))
    tabs = Tabs(server, messages, first=Tab.ROBOT)
    assert sent == []
    for tab in Tab:
        tabs.add(tab)
    tabs.ready()
    end = monotonic() + 60.0
    while len(sent) < 2 and monotonic() < end:
        sleep(0.01)
    assert sent == [(Tab.ROBOT,), tuple(Tab)]


def test_panels_stand_in_the_order_of_their_numbers(app):
    """An extra's panel finds its place among ours by one number."""
    for tab in Tab:
        orders = [
            panel.order for panel in app.view._panels if panel.tab is tab and type(panel) in PANELS.values()
        ]
        assert orders
        assert orders == sorted(set(orders))


@pytest.mark.parametrize(
    ("former", "tab"),
    [("Region", Tab.PLATE), ("Identify", Tab.CALIBRATE), ("Diagnose", Tab.CALIBRATE), ("More", Tab.ROBOT)],
)
def test_tabs_of_earlier_recordings_open_those_that_took_their_panels(former, tab):
    assert decode("OpenTab", {"tab": former}, bytes) == OpenTab(tab)


def test_a_note_for_the_recording_alone_is_not_on_the_page_and_ends_what_only_informs(app):
    header = next(p for p in app.view._panels if isinstance(p, Header))
    session = app.worker.session
    clean = replace(session, page=replace(session.page, messages=()))
    warnings = clean.with_message(Severity.WARNING, "one").with_message(Severity.INFO, "two")
    for session, shown in (
        (warnings, "Two."),
        (warnings.with_message(Severity.LOG, "three"), "One."),
        (warnings.with_message(Severity.LOG, "three").without_info_messages(), "One."),
    ):
        header.show_fields(session)
        assert shown in html_of(app, "message")
    header.show_fields(
        replace(warnings, page=replace(warnings.page, messages=warnings.page.messages[1:])).with_message(
            Severity.LOG, "three"
        )
    )
    assert not html_of(app, "message")


def test_the_map_of_the_plate_is_worked_out_once_the_page_is_made(monkeypatch):
    """The first picture doesn't wait for it."""
    known = []

    class Noting(BrowserView):
        def __init__(self, server, worker, **options):
            super().__init__(server, worker, **options)
            known.append((worker.session.page.chore, worker.session.region.cubes))

    monkeypatch.setattr(page_app, "BrowserView", Noting)
    running = page_app.App(load_robot("aria"), load_plate("table2"))
    try:
        assert running.worker.wait(60.0)
        assert known == [("", None)]
        assert len(running.worker.session.region.cubes) == running.worker.session.plate.region.cubes
    finally:
        running.close()
