"""A recording opened again where its numbers come out differently: told, and gone on with elsewhere."""

import io
import json
import shutil

import numpy as np
import pytest
from gear_sag import GearSag
from refusals import mentions

from recordings import Run, rewrite
from workbench import Parts, load_plate, load_robot, measure_poses, register, write_measurements
from workbench.arm.robot_toml import robot_text
from workbench.session.command import UnknownCommand
from workbench.session.commands.data import LoadData, MeasureVirtualArm
from workbench.session.commands.diagnose import AddEffects, Diagnose
from workbench.session.commands.drag import GrabTarget, MoveTarget, SelectTarget
from workbench.session.commands.identify import Identify
from workbench.session.journal import records
from workbench.session.journal.folder import begin, go_on
from workbench.session.journal.reader import JOURNAL, read_recording
from workbench.session.journal.replay import restore
from workbench.session.page_state import Severity


def lines(folder):
    return [json.loads(line) for line in (folder / JOURNAL).read_text().splitlines()]


@pytest.fixture(scope="module")
def killed(tmp_path_factory):
    """A session with a foreign effect, as a kill in a later drag leaves it."""
    folder = tmp_path_factory.mktemp("foreign") / "session"
    forget = register(Parts(effects=(GearSag,)))
    try:
        _, rows = measure_poses(load_robot("aria"), 90, effects=("gear-sag:2:4e-4",), seed=2)
        path = write_measurements(rows, folder.parent / "sag.csv")
        begun = begin(load_robot("aria"), load_plate("table2"), folder=folder)
        x, y, z = begun.session.plate.targets[2].xyz.tolist()
        drag = (MoveTarget(2, (x + 0.002 * k, y, z), (-2.6, 0.0, 0.0), 1) for k in range(4))
        tasks = (LoadData(path.name, path.read_bytes()), Identify(), Diagnose(), AddEffects())
        run = Run(begun)
        run(*tasks, GrabTarget(2, 1), *drag)
        left = shutil.copytree(folder, folder.parent / "killed")
        run.worker.close()
        assert restore(read_recording(left)).differences == ()
    finally:
        forget()
    return left


@pytest.fixture(scope="module")
def restored(killed):
    """Opened again where the effect is not installed."""
    return restore(read_recording(killed))


def test_a_missing_plug_in_is_named_with_the_numbers_then_and_now(killed, restored):
    then = lines(killed)[3]["numbers"]["diagnosis"]["after"]["held_out"]["position_mm"]["mean"]
    now = restored.session.results.diagnosis.after.held_out.position_mm.mean
    found = {d.name: d for d in restored.differences if d.step == 3}
    worst = found["diagnosis.after.held_out.position_mm.mean"]
    assert (worst.then, worst.now) == (then, pytest.approx(now))
    assert now > 1.05 * then
    assert f"{worst.name} {then:.4g} → {now:.4g}" == worst.text
    assert any(mentions(restored.warning, other.text, "extra") for other in restored.differences)


def test_it_goes_on_in_a_new_recording_and_the_old_one_stays(killed, restored, tmp_path):
    before = {path.name: path.read_bytes() for path in killed.glob("*.jsonl")}
    begun = go_on(restored, root=tmp_path)
    assert begun.folder.parent == tmp_path
    warnings = [m.text for m in begun.session.page.messages if m.severity is Severity.WARNING]
    assert warnings == [begun.trouble]
    assert restored.warning in begun.trouble
    run = Run(begun)
    run(SelectTarget(5))
    run.worker.close()
    assert {path.name: path.read_bytes() for path in killed.glob("*.jsonl")} == before
    last = [line["command"] for line in lines(begun.folder)[-3:]]
    assert last == ["MoveTarget", "DropTarget", "SelectTarget"]
    branched = read_recording(begun.folder)
    assert branched.header["branched"] == {"from": killed.name, "step": 6}
    assert restore(branched, is_computed=True).differences == ()  # it was told once


@pytest.fixture
def plain(tmp_path):
    """A short recording; how to change its lines, as another version would have written them."""
    folder = tmp_path / "session"
    begun = begin(load_robot("aria"), load_plate("table2"), folder=folder)
    run = Run(begun)
    run(MeasureVirtualArm(3), Identify(("ols",)))
    run.worker.close()

    def change(step, spoil):
        return read_recording(rewrite(folder, step, spoil))

    return change


def test_a_number_that_differs_in_the_fourth_digit_is_told(plain):
    def spoil_error(line):
        line["numbers"]["identification"]["algorithms"]["ols"]["held_out"]["position_mm"]["mean"] *= 1.001

    found = restore(plain(2, spoil_error))
    assert [(d.step, d.name.rsplit("ols.")[-1]) for d in found.differences] == [
        (2, "held_out.position_mm.mean")
    ]
    assert mentions(found.warning, "step 2")


@pytest.mark.parametrize(
    "change",
    [{"command": "WeighGears"}, {"fields": {"seed": 3, "gears": 2}}, {"fields": {"seed": "three"}}],
    ids=["command", "field", "value"],
)
def test_a_command_of_another_version_is_named_and_skipped(plain, change):
    recording = plain(1, lambda line: line.update(title="Weigh the gears", **change))
    name = change.get("command", "MeasureVirtualArm")
    assert recording.entries[0].command == UnknownCommand(name, "Weigh the gears")
    (note,) = recording.notes
    assert mentions(note, f"{name} (step 1)")
    for found in (restore(recording), restore(recording, is_computed=True)):
        assert found.session.measurements.loaded is None
        assert {d.step for d in found.differences} == {2}
        assert [m.text for m in found.session.page.messages] == [note]


def test_the_same_numbers_go_on_in_the_same_folder(plain):
    recording = plain(2, lambda line: None)
    begun = go_on(restore(recording))
    assert (begun.folder, begun.trouble) == (recording.folder, "")
    assert not [m for m in begun.session.page.messages if m.severity is Severity.WARNING]
    begun.keepers[0].close()


def test_a_refusal_was_told_at_the_time(tmp_path):
    begun = begin(load_robot("aria"), load_plate("table2"), folder=tmp_path / "session")
    run = Run(begun)
    run(LoadData("words.csv", b"hello, world\nthis, is no table\n"))
    run.worker.close()
    assert run.worker.session.page.messages
    assert not restore(read_recording(run.folder)).session.page.messages


def test_fits_are_read_where_they_were_recorded_and_computed_where_they_come_from_elsewhere(
    tmp_path, monkeypatch
):
    begun = begin(load_robot("aria"), load_plate("table2"), folder=tmp_path / "own")
    run = Run(begun)
    run(
        MeasureVirtualArm(3, more=60, effects=("joint-harmonic:2:2e-3",)),
        Identify(),
        Diagnose(),
        AddEffects(),
    )
    run.worker.close()
    then, computed = run.worker.session.results, []
    for kind in (Identify, Diagnose, AddEffects):
        compute = lambda self, session, own=kind.compute: computed.append(self) or own(self, session)  # noqa: E731
        monkeypatch.setattr(kind, "compute", compute)
    opened = restore(read_recording(run.folder))
    now = opened.session.results
    assert (opened.differences, computed) == ((), [])
    assert now.accepted
    assert now.identification.data.row.tolist() == then.identification.data.row.tolist()
    assert robot_text(now.run.saved.robot) == robot_text(then.run.saved.robot)
    assert list(map(str, now.diagnosis.blocks())) == list(map(str, then.diagnosis.blocks()))
    again = AddEffects().compute(opened.session)[1][1].best
    assert robot_text(again.calibrated) == robot_text(then.run.calibrated)
    computed.clear()
    monkeypatch.setattr("workbench.session.journal.codec._machine", lambda: b"another one")
    elsewhere = restore(read_recording(run.folder, to=2))
    copy = go_on(elsewhere, is_branch=True, root=tmp_path / "copies")
    for keeper in copy.keepers:
        keeper.close()
    for differences in (elsewhere.differences, restore(read_recording(copy.folder)).differences):
        assert differences == ()
    assert [type(task) for task in computed] == [Identify] * 2  # a copy takes no results from elsewhere


def test_a_file_of_a_result_makes_records_alone():
    foreign = np.frombuffer(b'[["record", "os:system", {"command": "x"}]]', np.uint8)
    for given in (foreign, np.array([object()], object)):
        content = io.BytesIO()
        np.savez(content, objects=given)
        with pytest.raises((TypeError, ValueError)):
            records.unpack(content.getvalue(), {})
    with pytest.raises(TypeError):
        records.pack((object(),), {})
    robot = load_robot("aria")
    again, same = records.unpack(records.pack((robot, robot), {}), {})
    assert again is same
    assert [vars(e) for e in again.elements] == [vars(e) for e in robot.elements]
