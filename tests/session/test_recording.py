"""A session in a folder: written line by line, read, gone on with, branched; and what can go wrong."""

import fcntl
import itertools
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from refusals import mentions, refuses

from recordings import Run, rewrite
from workbench import load_robot, write_toml
from workbench.base.errors import FileError, OptionError
from workbench.base.types import frozen
from workbench.session.command import UnknownCommand
from workbench.session.commands.arm import ChooseRobot
from workbench.session.commands.compare import SetOverlay, ShowRow
from workbench.session.commands.data import LoadData, MeasureVirtualArm
from workbench.session.commands.drag import DropTarget, GrabTarget, MoveTarget, SelectTarget
from workbench.session.commands.identify import Identify
from workbench.session.commands.plate import ImprovePlate, SetNoise
from workbench.session.commands.undo import Undo
from workbench.session.comparison import Overlay
from workbench.session.journal import codec, replay
from workbench.session.journal.folder import begin, branch, go_on, resume
from workbench.session.journal.reader import JOURNAL, ROBOT, read_recording
from workbench.session.journal.replay import restore
from workbench.session.next_step import next_step
from workbench.session.view import Ending

RPY = (-2.6, 0.0, 0.0)
check = partial(restore, is_computed=True)


@pytest.fixture
def record(tmp_path, first):
    """Begins recorded sessions, and ends them."""
    running = []

    def make(begun=None, **where) -> Run:
        begun = begun or begin(first.robot, first.plate, **({"root": tmp_path / "recordings"} | where))
        running.append(Run(begun))
        return running[-1]

    yield make
    for run in running:
        run.worker.close()


@pytest.fixture
def resumed(record):
    """Goes on with the session in a folder."""

    def make(folder) -> Run:
        recording = read_recording(folder)
        return record(resume(recording, replay(recording.first, recording.entries)))

    return make


def moves(first, count=8, target=2):
    """A drag."""
    x, y, z = first.plate.targets[target].xyz.tolist()
    yield GrabTarget(target, 1)
    for k in range(count):
        yield MoveTarget(target, (x + 0.002 * k, y, z), RPY, 1)
    yield DropTarget(1)


@pytest.fixture(scope="module")
def whole(first, tmp_path_factory):
    """A session of every kind of command, closed; with its last snapshot."""
    run = Run(begin(first.robot, first.plate, folder=tmp_path_factory.mktemp("whole")))
    csv = b"q1[deg],q2[deg],q3[deg],q4[deg],q5[deg],q6[deg],x[mm],y[mm],z[mm]\n1,2,3,4,5,6,700,8,9\n"
    run(*moves(first), *moves(first, target=4), Undo(), LoadData("my data.csv", csv))
    run(MeasureVirtualArm(3), Identify(("ols",)))
    session = run(ShowRow(3), SetNoise(2e-4, 1e-3), SetOverlay(Overlay(arrows=False)), Identify(("opt9",)))
    run.worker.close()
    return run.folder, session, run.worker.journal


def test_the_recording_is_the_journal(whole):
    folder, _, journal = whole
    recording = read_recording(folder)
    assert recording.notes == ()
    assert recording.header["schema"] == "workbench.journal/1"
    assert [(e.command, e.ending, e.basis) for e in recording.entries] == [
        (e.command, e.ending, e.basis) for e in journal
    ]
    assert recording.lines[-1].entry.ending is Ending.REFUSED
    assert mentions(recording.lines[-1].messages[-1], "OLS, OPT1, OPT2, INFLUENCE")
    assert sorted(p.name for p in (folder / "inputs").iterdir() if p.suffix == ".csv")
    times = [e.at for e in recording.entries]
    assert times == sorted(times)


def test_a_replay_comes_to_the_same_numbers(whole):
    folder, session, _ = whole
    replayed = check(read_recording(folder))
    assert replayed.differences == ()
    assert replayed.compared > 200
    again = replayed.session
    fits = [each.results.identification.runs["ols"].fit.x for each in (again, session)]
    assert np.array_equal(*fits)
    assert (again.results.row, again.noise) == (session.results.row, session.noise)
    assert again.choices.overlay == session.choices.overlay


@pytest.mark.parametrize("is_earlier", [False, True])  # recordings of November 2026 hold it in the line
def test_plates_that_were_searched_for_are_read(record, first, tmp_path, monkeypatch, is_earlier):
    found, *others = first.plate.targets
    better = replace(first.plate, targets=(replace(found, xyz=frozen(found.xyz + 0.01)), *others))
    monkeypatch.setattr(ImprovePlate, "compute", lambda self, session: (session.plate, better, "narrow"))
    run = record()
    session = run(ImprovePlate(3))
    run.worker.close()
    plate = json.loads(json.dumps(codec._record(better, {}, "")))
    rewrite(run.folder, 1, lambda line: line.update(result={"plate": plate, "note": ""}) if is_earlier else 0)
    monkeypatch.setattr(ImprovePlate, "compute", lambda self, session: 1 / 0)
    restored = restore(read_recording(run.folder))
    assert restored.differences == ()
    assert [s.q.tolist() for s in restored.session.states] == [s.q.tolist() for s in session.states]
    with refuses(OptionError, "step 1", "ZeroDivisionError"):
        check(read_recording(run.folder))


def test_a_session_goes_on(record, resumed, first):
    run = record()
    before = run(*moves(first), SelectTarget(4))
    run.worker.close()
    again = resumed(run.folder)
    assert again.folder == run.folder
    assert again.worker.session.score.indices == before.score.indices
    again(Undo(), MeasureVirtualArm(2), Identify(("ols",)))
    again.worker.close()
    whole = read_recording(run.folder)
    assert [e.command for e in whole.entries[-3:]] == [Undo(), MeasureVirtualArm(2), Identify(("ols",))]
    assert [e.at for e in whole.entries] == sorted(e.at for e in whole.entries)
    assert check(whole).differences == ()


def test_a_branch_leaves_the_first_session_alone(record, whole, tmp_path):
    folder = whole[0]
    content = (folder / JOURNAL).read_bytes()
    recording = read_recording(folder, to=6)
    now = replay(recording.first, recording.entries)
    run = record(branch(recording, now, root=tmp_path / "b"))
    run(SelectTarget(7))
    run.worker.close()
    assert (folder / JOURNAL).read_bytes() == content
    new = read_recording(run.folder)
    assert new.header["branched"] == {"from": folder.name, "step": 6}
    assert len(new.lines) == 7
    assert check(new).differences == ()
    with refuses(OptionError, option="step", found=99):
        read_recording(folder, to=99)


@pytest.mark.parametrize(
    "spoil",
    [lambda content: content[:-40], lambda content: content[:-200] + bytes(199) + b"\n"],
    ids=["torn", "power lost"],
)
def test_a_last_line_that_is_not_whole_is_left_out_said_and_written_over(record, resumed, spoil):
    run = record()
    run(SelectTarget(1), SelectTarget(2))
    run.worker.close()
    path = run.folder / JOURNAL
    path.write_bytes(spoil(path.read_bytes()))
    recording = read_recording(run.folder)
    assert len(recording.lines) == 1
    assert "incomplete" in recording.notes[0]
    again = resumed(run.folder)
    again(SelectTarget(3))
    again.worker.close()
    assert [e.command for e in read_recording(run.folder).entries] == [SelectTarget(1), SelectTarget(3)]


def test_a_line_that_changed_since_is_never_replayed(whole, tmp_path):
    """Two places of a drag mixed within a page: it is JSON, and its checksum denies it."""
    folder = shutil.copytree(whole[0], tmp_path / "copy")
    path = folder / JOURNAL
    lines = path.read_bytes().splitlines(keepends=True)
    assert b'"MoveTarget"' in lines[2]
    mixed = lines[2].replace(b'"xyz": [0.', b'"xyz": [1.', 1)
    assert json.loads(mixed)["fields"]["xyz"] != json.loads(lines[2])["fields"]["xyz"]
    path.write_bytes(b"".join([*lines[:2], mixed, *lines[3:]]))
    with refuses(FileError, "step 2", "--step 1", line=3):
        read_recording(folder)
    path.write_bytes(b"".join([*lines[:2], mixed]))  # the last one: the program was stopped there
    recording = read_recording(folder)
    assert len(recording.lines) == 1
    assert "incomplete" in recording.notes[0]


@pytest.fixture(scope="module")
def dragging(first, tmp_path_factory):
    """Folders as a kill leaves them after each command of a drag; the last place of each in the session."""
    run = Run(begin(first.robot, first.plate, folder=tmp_path_factory.mktemp("dragging") / "now"))
    left = []
    for k, command in enumerate(moves(first, 5)):
        session = run(command)
        folder = shutil.copytree(run.folder, run.folder.parent / str(k))
        left.append((folder, session.plate.targets[2].xyz.tolist(), len(run.worker.journal)))
    run.worker.close()
    assert sorted(path.name for path in run.folder.iterdir()) == [".lock", "inputs", JOURNAL]
    return left


def test_a_kill_between_the_places_of_a_drag_loses_none(dragging):
    for folder, xyz, count in dragging:
        recording = read_recording(folder)
        replayed = check(recording)
        assert len(recording.lines) == count
        assert replayed.session.plate.targets[2].xyz.tolist() == xyz
        assert replayed.differences == ()


def test_a_kill_while_the_places_of_a_drag_become_one_loses_none(dragging, tmp_path):
    """Wherever it is cut: the last place over the first, the rest of that one, and the others behind it."""
    (four, _, _), (five, after, count) = dragging[4], dragging[5]
    places = (four / JOURNAL).read_bytes().splitlines(keepends=True)[2:]
    *kept, new = (five / JOURNAL).read_bytes().splitlines(keepends=True)
    begin, old = b"".join(kept[:2]), b"".join([*places, new])
    folder = shutil.copytree(five, tmp_path / "copy")
    for cut in range(1, len(new) + 1, 7):
        (folder / JOURNAL).write_bytes(begin + new[:cut] + old[cut:])
        recording = read_recording(folder)
        assert len(recording.lines) == count
        assert recording.entries[-1].command.xyz == tuple(after)


def test_a_session_killed_in_a_drag_goes_on_from_its_last_place(dragging, resumed, tmp_path):
    folder = shutil.copytree(dragging[5][0], tmp_path / "copy")
    again = resumed(folder)
    again(*moves(again.worker.session, 3, target=4))
    again.worker.close()
    whole = read_recording(folder)
    kinds_ = [type(e.command) for e in whole.entries]
    assert kinds_ == [GrabTarget, MoveTarget, DropTarget, GrabTarget, MoveTarget, DropTarget]
    assert list(whole.entries[1].command.xyz) == dragging[5][1]
    assert check(whole).differences == ()


def test_every_line_but_the_places_of_a_drag_is_on_the_disk(record, first, monkeypatch):
    """What was confirmed outlives a loss of power; the places of a drag come with its end."""
    synced, really = [], os.fdatasync
    run = record()
    monkeypatch.setattr(os, "fdatasync", lambda file: synced.append(really(file)))
    run(*moves(first, 8))
    assert len(synced) == len(run.lines) - 1
    run(SelectTarget(1))
    assert len(synced) == len(run.lines) - 1


def changed(line: bytes, pattern: bytes, new: bytes) -> bytes:
    """With the checksum of what it says now."""
    return codec.sealed(codec.CHECKSUM.sub(b"}", re.sub(pattern, new, line)).decode()).encode()


@pytest.mark.parametrize(
    ("spoil", "text"),
    [
        (lambda lines: [*lines[:3], b"{oops", *lines[4:]], "step 3"),
        (lambda lines: lines[:3] + lines[4:], "it says step 4"),
        (lambda lines: [lines[0].replace(b"journal/1", b"journal/2"), *lines[1:]], "newer"),
        (lambda lines: [lines[0].replace(b'"ARIA"', b'"Aria"', 1), *lines[1:]], "first line was changed"),
        (lambda lines: [changed(lines[0], b'"inputs"', b'"outputs"'), *lines[1:]], "was changed"),
        (lambda lines: [b'{"schema": "workbench.journal/1", "numbers": null}', *lines[1:]], "no table"),
        (lambda lines: [b"{}", *lines[1:]], "no schema"),
        (lambda lines: [b"[" * 5000, *lines[1:]], "no schema"),
        (lambda lines: [*lines[:3], b"[" * 5000, *lines[4:]], "step 3"),
        (lambda lines: [*lines[:3], codec.CHECKSUM.sub(b"}", lines[3]), *lines[4:]], "step 3"),
        (lambda lines: [*lines[:3], changed(lines[3], rb'"fields": {[^}]*}', b'"fields": []')], "step 3"),
        (lambda lines: [*lines[:3], changed(lines[3], rb'"basis": \d+', b'"basis": Infinity')], "step 3"),
        (lambda lines: [b"\xff\xfe"], "no schema"),
    ],
)
def test_damage_is_one_clear_sentence(whole, tmp_path, spoil, text):
    folder = shutil.copytree(whole[0], tmp_path / "copy")
    path = folder / JOURNAL
    path.write_bytes(b"\n".join(spoil(path.read_bytes().splitlines())) + b"\n")
    with pytest.raises(FileError, match=text) as found:
        read_recording(folder)
    assert "\n" not in str(found.value)


def test_a_recording_whose_first_line_has_no_checksum_yet_is_shown(whole, tmp_path):
    folder = shutil.copytree(whole[0], tmp_path / "copy")
    head, rest = (folder / JOURNAL).read_text().split("\n", 1)
    early = {k: v for k, v in json.loads(head).items() if k not in (codec.CHECK, "inputs", "origin")}
    (folder / JOURNAL).write_text(f"{json.dumps(early)}\n{rest}")
    assert not read_recording(folder).is_own


@pytest.mark.parametrize("name", ["*.csv", "robot.toml", "plate.toml"])
def test_an_input_that_was_changed_or_is_missing_is_refused(whole, tmp_path, name):
    folder = shutil.copytree(whole[0], tmp_path / "copy")
    file = max((folder / "inputs").glob(name), key=lambda file: file.stat().st_size)
    file.write_bytes(file.read_bytes() + b"\n")
    with pytest.raises(FileError, match="changed"):
        read_recording(folder)
    file.unlink()
    with pytest.raises(FileError, match=r"missing|can't be opened"):
        read_recording(folder)


def test_an_input_that_lies_elsewhere_is_refused(whole, tmp_path):
    folder = shutil.copytree(whole[0], tmp_path / "copy")
    rewrite(folder, 8, lambda line: line["fields"]["content"].update(file="inputs/../../../etc/passwd"))
    with refuses(FileError, "'inputs/../../../etc/passwd'", line=9):
        read_recording(folder)


# -- a recording that somebody else has made -------------------------------------------------------


MADE = {
    "link": lambda path, precious: path.symlink_to(precious),
    "dangling": lambda path, precious: path.symlink_to(precious.with_name("new")),
    "pipe": lambda path, precious: os.mkfifo(path),
}


@pytest.mark.parametrize("make", MADE)
@pytest.mark.parametrize("name", [".lock", JOURNAL, str(ROBOT), f"{codec.INPUTS}/*.csv", codec.INPUTS])
def test_what_is_no_regular_file_of_a_recording_is_never_opened(whole, tmp_path, name, make):
    """Nothing outside is read or written, and nothing waits for the other end of a pipe."""
    folder, precious = shutil.copytree(whole[0], tmp_path / "copy"), tmp_path / "precious"
    path = max(folder.glob(name), key=lambda file: file.stat().st_size, default=folder / name)
    if path.is_dir():
        shutil.copytree(path, precious)
        shutil.rmtree(path)
    else:
        precious.write_bytes(path.read_bytes() if path.exists() else b"precious")
        path.unlink(missing_ok=True)
    MADE[make](path, precious)
    before = {file: file.read_bytes() for file in (precious.rglob("*") if precious.is_dir() else [precious])}
    try:
        run = Run(go_on(restore(read_recording(folder)), root=tmp_path / "others"))
    except FileError:
        assert name != ".lock"
    else:
        session = run(*moves(run.worker.session, 3))
        run.worker.close()
        assert session.page.messages
    assert {file: file.read_bytes() for file in before} == before
    assert not (tmp_path / "new").exists()


def test_a_recording_from_another_machine_is_only_shown_unless_a_copy_is_asked_for(
    whole, tmp_path, monkeypatch
):
    folder, root = shutil.copytree(whole[0], tmp_path / "copy"), tmp_path / "mine"
    monkeypatch.setattr(codec, "_machine", lambda: b"another")
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    recording = read_recording(folder)
    run = Run(go_on(restore(recording), root=root))
    first = run.worker.session
    assert mentions(first.page.only_shown, folder.name, str(root), f"--step {len(recording.lines)}")
    assert next_step(first).sentence == f"{first.page.only_shown}."
    refused = run(*moves(first, 3), Identify(("ols",)), Undo())
    run.worker.close()
    assert refused.plate is first.plate
    assert refused.results is first.results
    assert [m.text for m in refused.page.messages].count(first.page.only_shown) == 1
    assert not root.exists()
    run = Run(go_on(restore(recording), is_branch=True, root=root))
    after = run(*moves(first, 3))
    run.worker.close()
    assert after.plate is not first.plate
    (made,) = root.iterdir()
    copy = read_recording(made)
    assert copy.is_own
    assert not read_recording(folder).is_own
    assert len(copy.lines) == len(recording.lines) + 3
    assert not restore(copy).warning
    assert {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()} == before


FAR = {str(k): {"q": [9e9] * 6} for k in range(10)}


@pytest.mark.parametrize("states", [{"1": "x"}, {"1": {}}, [], None, {"1": {"q": None, "reached": 1}}, FAR])
def test_a_first_line_that_says_nonsense_of_the_targets_is_not_believed(whole, first, tmp_path, states):
    folder = shutil.copytree(whole[0], tmp_path / "copy")
    rewrite(folder, 0, lambda header: header["numbers"].update(targets=states))
    session = read_recording(folder).first
    assert [s.q.tolist() for s in session.states] == [s.q.tolist() for s in first.states]


def test_a_journal_names_built_in_arms_alone(record, tmp_path):
    """Whatever else it names may be anywhere on this machine."""
    path = write_toml(load_robot("ur5"), tmp_path / "elsewhere.toml")
    run = record()
    session = run(ChooseRobot(str(path)))
    assert session.robot.name == "ARIA"
    assert mentions(session.page.messages[-1].text, "unknown arm", "ur5e")
    run(ChooseRobot("ur5"))
    run.worker.close()
    rewrite(run.folder, 2, lambda line: line["fields"].update(name=str(path)))
    with refuses(OptionError, "step 2", "--step 1"):
        restore(read_recording(run.folder))


def test_a_lock_that_was_removed_admits_no_second_writer(record, resumed, first):
    run = record()
    run(SelectTarget(1))
    (run.folder / ".lock").unlink()
    run(SelectTarget(2))  # nobody else came: it goes on
    assert len(run.lines) == 3
    (run.folder / ".lock").unlink()
    second = resumed(run.folder)
    second(SelectTarget(3), *list(moves(first, 2))[:-1])
    message = run(SelectTarget(4)).page.messages[-1].text
    assert mentions(message, "can't be recorded", f"process {os.getpid()}")
    second.worker.close()
    run(*moves(first, 2))
    run.worker.close()
    kept = [e.command for e in read_recording(run.folder).entries]
    assert kept[:3] == [SelectTarget(1), SelectTarget(2), SelectTarget(3)]
    assert SelectTarget(4) not in kept


@pytest.mark.parametrize("name", ["nothing", "empty"])
def test_no_recording_is_said(tmp_path, name):
    (tmp_path / "empty").mkdir()
    with refuses(FileError, "journal.jsonl", path=str(tmp_path / name)):
        read_recording(tmp_path / name)


# -- trouble with the disk ------------------------------------------------------------------------


def test_two_at_once_on_one_folder(record, first, whole, tmp_path):
    run = record()
    run(SelectTarget(2))
    with refuses(OptionError, option="folder", found=str(os.getpid())):
        resume(read_recording(run.folder), first)
    run(SelectTarget(3))
    assert len(run.lines) == 3


def test_no_place_for_recordings(record, first, tmp_path):
    """Where recordings should go is a file: the session goes on, and its user is told."""
    (tmp_path / "file").write_text("")
    run = record(root=tmp_path / "file")
    session = run(SelectTarget(3))
    assert run.folder is None
    assert session.selected == 3
    assert "not recorded" in session.page.messages[0].text


def test_the_wall_clock_may_jump(record, monkeypatch):
    run = record()
    run(SelectTarget(1))
    monkeypatch.setattr(time, "time", lambda: 86_400.0)
    run(SelectTarget(2))
    monkeypatch.setattr(time, "time", lambda: 4e9)
    run(SelectTarget(3))
    run.worker.close()
    entries = read_recording(run.folder).entries
    assert entries[0].at < entries[1].at < entries[2].at < 60.0
    assert entries[1].time == 86_400.0


SCRIPT = """
import itertools, os, sys, time
from pathlib import Path
from workbench.plate.measured_plate import load_plate
from workbench.arm.built_in_arms import load_robot
from workbench.session import Worker
from workbench.session.commands.drag import DropTarget, GrabTarget, MoveTarget
from workbench.session.journal.folder import begin

def torn(file, content, at):
    half = len(content) // 2
    written = whole(file, content[:half], at)
    time.sleep(0.003)
    return written + whole(file, content[half:], at + half)

begun = begin(load_robot("aria"), load_plate("table2"), folder=Path(sys.argv[1]))
whole, os.pwrite = os.pwrite, torn
worker = Worker(begun.session, keepers=begun.keepers)
for k in itertools.count():
    moves = (MoveTarget(k % 10, (0.4, 0.2 + 0.001 * j, 0.25), (-2.6, 0.0, 0.0), 1) for j in range(4))
    for command in (GrabTarget(k % 10, 1), *moves, DropTarget(1)):
        worker.submit(command)
        worker.wait()
        y = worker.session.plate.targets[k % 10].xyz[1]
        print(len(worker.journal), k % 10, y, flush=True)
"""
KILLS = int(os.environ.get("KILLS", 1))
"""How many there are; `KILLS=200` takes some minutes."""


@pytest.mark.parametrize("seed", range(KILLS))
def test_a_kill_loses_at_most_the_last_command(tmp_path, seed):
    """Wherever it comes, in the middle of a write above all: what was confirmed is there afterwards."""
    folder = tmp_path / "killed"
    process = subprocess.Popen([sys.executable, "-c", SCRIPT, folder], stdout=subprocess.PIPE, text=True)
    message = list(itertools.islice(process.stdout, 5))
    time.sleep(np.random.default_rng(seed).uniform(0.0, 0.5))
    os.kill(process.pid, signal.SIGKILL)
    message += process.stdout.readlines()
    process.wait()
    process.stdout.close()
    restored = restore(read_recording(folder))
    count, target, y = [line for line in message if line.endswith("\n")][-1].split()
    assert int(count) <= len(restored.recording.lines) <= int(count) + 1
    if len(restored.recording.lines) == int(count):  # a further place may have come
        assert restored.session.plate.targets[int(target)].xyz[1] == pytest.approx(float(y), abs=1.1e-3)
    assert restored.differences == ()
    lock = os.open(folder / ".lock", os.O_RDWR)
    fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)  # the dead process holds nothing
    os.close(lock)


# -- commands as plain data -----------------------------------------------------------------------


def test_a_field_of_another_version_is_left_out_of_how_things_look_alone():
    """What a command itself would do with it is not known here."""
    former = {"arrows": False, "bent": True, "bending": 7.0}
    assert codec.decode("SetOverlay", {"overlay": former}, bytes).overlay == Overlay(arrows=False)
    region = {"low": [0, 0, 0], "high": [1, 1, 1], "cube": 0.1}
    assert codec.decode("SetRegion", region, bytes).high == (1, 1, 1)
    assert isinstance(codec.decode("SetRegion", region | {"turned": 0.1}, bytes), UnknownCommand)
