"""Each call that changes the disk fails in turn, a write half-way: nothing is lost, mixed, or left behind.

As sqlite is tested with an error at the n-th call for every n.
"""

import errno
import io
import itertools
import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from session_at_work import carry_out

from workbench.base.errors import FileError
from workbench.base.files import write_folder
from workbench.exports import FORMS, Job, export_robot
from workbench.plate.plate_toml import write_plate
from workbench.session import AbstractCommand, Worker
from workbench.session.commands.drag import DropTarget, GrabTarget, MoveTarget, SelectTarget
from workbench.session.commands.plate import SetNoise
from workbench.session.journal.folder import begin
from workbench.session.journal.reader import read_recording
from workbench.session.journal.replay import restore

CALLS = ("open", "mkdir", "fsync", "fdatasync", "ftruncate", "chmod", "replace", "pwrite")
COMMANDS = (
    *(SelectTarget(1), GrabTarget(2, 1), MoveTarget(2, (0.4, 0.2, 0.25), (-2.6, 0.0, 0.0), 1)),
    *(MoveTarget(2, (0.4, 0.21, 0.25), (-2.6, 0.0, 0.0), 1), DropTarget(1), SetNoise(2e-4, 1e-3)),
    *(MoveTarget(1, (0.4, 0.3, 0.25), (-2.6, 0.0, 0.0), 1), SelectTarget(3)),
)
PAGES = ("only new.html", "b.html", "c.json")
WRITES = {
    "robot": lambda arm, plate, folder: arm.save(folder / "out.toml"),
    "URDF": lambda arm, plate, folder: arm.save(folder / "out.urdf"),
    "plate": lambda arm, plate, folder: write_plate(plate, folder / "out.toml"),
    "form": lambda arm, plate, folder: export_robot(
        FORMS["dh-csv"], folder / "out.csv", Job(robot=arm), rows=3
    ),
    "folder": lambda arm, plate, folder: write_folder(
        folder / "out", dict.fromkeys(PAGES[arm.reach > 1.3 :], arm.chain.values.tobytes())
    ),
}


@pytest.fixture
def failing(monkeypatch):
    """Does some work while its n-th call that changes the disk fails; tells whether it came so far."""

    def call(at: int, work: Callable[[], object]) -> bool:
        count = itertools.count(1)

        def fails() -> bool:
            return next(count) == at

        def no_room() -> OSError:
            return OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

        class Torn(io.FileIO):
            def write(self, content) -> int:
                if fails():
                    super().write(content[: len(content) // 2])
                    raise no_room()
                return super().write(content)

        def write_bytes(path: Path, content: bytes) -> None:
            with Torn(path, "wb") as file:
                file.write(content)

        def faulty(name: str, whole: Callable) -> Callable:
            def instead(*given, **options):
                is_reading = name == "open" and not given[1] & (os.O_WRONLY | os.O_RDWR)
                if is_reading or not fails():
                    return whole(*given, **options)
                if name == "pwrite":  # tells how much there was room for
                    return whole(given[0], given[1][: len(given[1]) // 2], given[2])
                raise no_room()

            return instead

        with monkeypatch.context() as patch:
            for name in CALLS:
                patch.setattr(os, name, faulty(name, getattr(os, name)))
            patch.setattr(os, "fdopen", Torn)
            patch.setattr(Path, "write_bytes", write_bytes)
            work()
        return next(count) > at

    return call


def files_of(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


@pytest.mark.parametrize("kind", WRITES)
def test_a_file_is_the_old_or_the_new_one_whichever_call_fails(kind, failing, first, tmp_path):
    other = first.robot.with_values({"joint2.a": 0.5})
    (tmp_path / "new").mkdir()
    WRITES[kind](first.robot, first.plate, tmp_path / "new")
    new = files_of(tmp_path / "new")
    for n in itertools.count(1):
        folder = tmp_path / str(n)
        (folder / "out").mkdir(parents=True) if kind == "folder" else folder.mkdir()
        WRITES[kind](other, first.plate, folder)
        old = files_of(folder)
        error, came = "", True
        try:
            came = failing(n, lambda folder=folder: WRITES[kind](first.robot, first.plate, folder))
        except FileError as raised:
            error = str(raised)
        assert not error or (str(folder / "out") in error and "No space left on device" in error)
        assert files_of(folder) == (old if error else new)
        if not came:
            break
    assert n > 5


def test_a_session_goes_on_and_catches_up_whichever_call_of_its_journal_fails(failing, first, tmp_path):
    for n in itertools.count(1):
        begun = begin(first.robot, first.plate, folder=tmp_path / str(n))
        worker = Worker(begun.session, keepers=begun.keepers)

        def said(*commands: AbstractCommand, worker: Worker = worker) -> set[str]:
            sessions = (carry_out(worker, command) for command in commands)
            return {message.text for session in sessions for message in session.page.messages}

        texts = set[str]()
        came = failing(n, lambda said=said, texts=texts: texts.update(said(*COMMANDS)))
        texts |= said(SelectTarget(4))  # there is room again
        for part in ("can't be recorded at present", "is recorded again"):
            assert any(part in text for text in texts) is came
        session = worker.session
        worker.close()
        found = restore(read_recording(begun.folder))
        assert [e.command for e in found.recording.entries] == [e.command for e in worker.journal]
        assert np.array_equal(found.session.plate.poses, session.plate.poses)
        assert found.session.selected == 4
        if not came:
            break
    assert n > 10
