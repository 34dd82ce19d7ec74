"""A recording opened again where its numbers come out differently: told, and gone on with elsewhere."""

import json
import shutil

import pytest
from gear_sag import GearSag
from refusals import mentions, refuses

from workbench.arm.built_in_arms import load_robot
from workbench.base.errors import FileError
from workbench.data.writer import write_measurements
from workbench.parts import Parts, register
from workbench.plate.plate_toml import load_plate
from workbench.plate.simulated_measurement import measure_poses
from workbench.session import Worker
from workbench.session.command import UnknownCommand
from workbench.session.commands.data import LoadData, MeasureVirtualArm
from workbench.session.commands.diagnose import AddEffects, Diagnose
from workbench.session.commands.drag import GrabTarget, MoveTarget, SelectTarget
from workbench.session.commands.edit import CopyTarget, LockTarget
from workbench.session.commands.identify import Identify
from workbench.session.journal import codec
from workbench.session.journal.compare_numbers import check
from workbench.session.journal.folder import begin, go_on, go_on_unrecorded
from workbench.session.journal.reader import JOURNAL, read_recording
from workbench.session.journal.restore import restore
from workbench.session.page_state import Severity


def run(begun, *commands):
    """A worker that has carried these out."""
    worker = Worker(begun.session, keepers=begun.keepers, journal=begun.entries, opening=begun.opening)
    for command in commands:
        worker.submit(command)
        assert worker.wait(120.0)
    return worker


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
        worker = run(begun, *tasks, GrabTarget(2, 1), *drag)
        left = shutil.copytree(folder, folder.parent / "killed")
        worker.close()
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
    for part in ("step 3 ", f"{then:.4g} → {now:.4g} mm", "'gear-sag' is not installed"):
        assert part in restored.warning


def test_it_goes_on_in_a_new_recording_and_the_old_one_stays(killed, restored, tmp_path):
    before = {path.name: path.read_bytes() for path in killed.glob("*.jsonl")}
    begun = go_on(restored, root=tmp_path)
    assert begun.folder.parent == tmp_path
    warnings = [m.text for m in begun.session.page.messages if m.severity is Severity.WARNING]
    assert warnings == [begun.trouble]
    assert restored.warning in begun.trouble
    run(begun, SelectTarget(5)).close()
    assert {path.name: path.read_bytes() for path in killed.glob("*.jsonl")} == before
    assert [line["command"] for line in lines(begun.folder)[-3:]] == [
        "MoveTarget",
        "DropTarget",
        "SelectTarget",
    ]
    branched = read_recording(begun.folder)
    assert branched.header["branched"] == {"from": killed.name, "step": 6}
    assert restore(branched).differences == ()  # it was told once
    assert check(branched).differences == ()


def test_without_a_recording_it_is_told_all_the_same(restored):
    begun = go_on_unrecorded(restored)
    assert begun.folder is None
    warnings = [m.text for m in begun.session.page.messages if m.severity is Severity.WARNING]
    assert warnings == [restored.warning] == [begun.trouble]


@pytest.fixture
def plain(tmp_path):
    """A short recording; how to change its lines, as another version would have written them."""
    folder = tmp_path / "session"
    begun = begin(load_robot("aria"), load_plate("table2"), folder=folder)
    run(begun, MeasureVirtualArm(3), Identify(("ols",))).close()

    def change(step, spoil):
        found = (folder / JOURNAL).read_text().splitlines()
        line = json.loads(found[step])
        line.pop(codec.CHECK, None)
        spoil(line)
        found[step] = json.dumps(line, ensure_ascii=False)
        (folder / JOURNAL).write_text("\n".join(found) + "\n")
        return read_recording(folder)

    return change


def spoil_error(line):
    line["numbers"]["identification"]["algorithms"]["ols"]["held_out"]["position_mm"]["mean"] *= 1.001


def test_a_number_that_differs_in_the_fourth_digit_is_told(plain):
    found = restore(plain(2, spoil_error))
    assert [(d.step, d.name.rsplit("ols.")[-1]) for d in found.differences] == [
        (2, "held_out.position_mm.mean")
    ]
    assert mentions(found.warning, "step 2")


def test_another_version_is_named(plain):
    plain(2, spoil_error)
    found = restore(plain(0, lambda header: header.update(workbench="0.0.9")))
    assert mentions(found.warning, "0.0.9")


def test_a_command_of_an_extra_that_is_not_installed_is_named_and_left_out(plain):
    recording = plain(1, lambda line: line.update(command="WeighGears", title="Weigh the gears"))
    assert recording.entries[0].command == UnknownCommand("WeighGears", "Weigh the gears")
    found = restore(plain(2, lambda line: line.update(ending="refused")))
    assert found.session.measurements.loaded is None
    assert {d.step for d in found.differences} == {1}
    assert "WeighGears" in found.warning
    assert any("WeighGears" in message.text for message in found.session.page.messages)


def test_what_needs_a_command_that_is_unknown_is_left_out_and_the_rest_is_done(tmp_path):
    """As older versions arranged targets in patterns, and then moved them."""
    folder, plate = tmp_path / "session", load_plate("table2")
    last = plate.targets[-1]
    commands = (
        CopyTarget(0),
        MoveTarget(len(plate), tuple(last.xyz + 0.01), tuple(last.rpy)),
        LockTarget(0, True),
    )
    run(begin(load_robot("aria"), plate, folder=folder), *commands).close()
    journal = folder / JOURNAL
    header, line, *rest = journal.read_text().splitlines()
    without_sum = {name: value for name, value in json.loads(line).items() if name != codec.CHECK}
    line = json.dumps(without_sum | {"command": "ApplyPattern"})
    journal.write_text("\n".join((header, line, *rest)) + "\n")
    recording = read_recording(folder)
    (note,) = recording.notes
    assert "ApplyPattern" in note
    for session in (restore(recording).session, check(recording).session):
        assert [target.locked for target in session.plate.targets] == [True, *[False] * (len(plate) - 1)]
        assert [m.text for m in session.page.messages if m.severity is Severity.WARNING] == list(
            recording.notes
        )


def test_the_same_numbers_go_on_in_the_same_folder(plain):
    recording = plain(2, lambda line: None)
    begun = go_on(restore(recording))
    assert (begun.folder, begun.trouble) == (recording.folder, "")
    assert not [m for m in begun.session.page.messages if m.severity is Severity.WARNING]
    begun.keepers[0].close()


# -- places of a drag that an earlier version mixed ------------------------------------------------


@pytest.fixture
def mixed(tmp_path):
    """Mixes a line of a drag of an earlier version: two places are written over one another up to a byte."""
    folder = tmp_path / "earlier"
    begun = begin(load_robot("aria"), load_plate("table2"), folder=folder)
    x, y, z = begun.session.plate.targets[2].xyz.tolist()
    drag = (MoveTarget(2, (x + 0.004 * k, y, z), (-2.6, 0.1 * k, 0.0)) for k in range(2))
    run(begun, *drag, SelectTarget(1)).close()
    path = folder / JOURNAL
    whole = [json.loads(line) for line in path.read_text().splitlines()]
    for line in whole[1:]:
        del line[codec.CHECK]
    texts = [json.dumps(line, ensure_ascii=False) for line in whole]
    one, two = (json.dumps(line | {"step": 2}, ensure_ascii=False) for line in whole[1:3])

    def mix(after):
        cut = two.index(after) + len(after)
        assert one[: one.index(after)].count("{") == two[: cut - len(after)].count("{")
        line = two[:cut] + one[one.index(after) + len(after) :]
        path.write_text("\n".join([*texts[:2], line, *texts[3:]]) + "\n")
        return folder

    return mix


@pytest.mark.parametrize("after", ['"rpy": ', '"title": "', '"numbers": {'])
def test_a_place_that_an_earlier_version_mixed_is_not_replayed(mixed, after):
    folder = mixed(after)
    with refuses(FileError, "step 2", "--step 1", line=3):
        read_recording(folder)
    path = folder / JOURNAL
    path.write_bytes(b"".join(path.read_bytes().splitlines(keepends=True)[:3]))
    recording = read_recording(folder)  # the last line: the program was stopped there
    assert len(recording.lines) == 1
    assert "incomplete" in recording.notes[0]


def test_a_posture_of_another_place_is_computed_again(mixed):
    """The line is cut between its place and the arm's posture: the place is the one that was chosen."""
    found = restore(read_recording(mixed('"q": ')))
    assert {(d.step, d.name.split(".")[2]) for d in found.differences if "targets" in d.name} == {(2, "q")}
    assert found.warning
