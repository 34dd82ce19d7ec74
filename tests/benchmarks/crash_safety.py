"""Kills at random moments: what was confirmed is in the journal, and the same session opens again.

    python tests/benchmarks/crash_safety.py 200

In turn they die in a drag, while a task is computed, between the writing of a line and the moment at which
the disk has it, and while places of a drag are written one straight after the other, each longer than a page:
a write that is cut off would leave a line that begins with one place and ends with another.
"""

import itertools
import json
import os
import random
import signal
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

sys.path[:0] = [str(Path(__file__).resolve().parents[2])]

from tests.benchmarks.recording import PLACES, places
from workbench.arm.built_in_arms import load_robot
from workbench.plate.plate_toml import load_plate
from workbench.session import Session
from workbench.session.command import AbstractChange
from workbench.session.commands.data import MeasureVirtualArm
from workbench.session.commands.drag import SelectTarget
from workbench.session.commands.identify import Identify
from workbench.session.journal import codec
from workbench.session.journal.compare_numbers import check
from workbench.session.journal.folder import StartedSession, begin
from workbench.session.journal.reader import JOURNAL, read_recording
from workbench.session.journal.writer import Appender
from workbench.session.worker import Worker

KINDS = ("drag", "task", "write", "place")
LONG = 8000
"""Bytes that a place's line has more than it would."""
LONGEST = 1.5
"""Time after the first confirmed command in which a kill comes [s]."""


def endless(first: Session) -> Iterator[AbstractChange]:
    """One drag after the other."""
    for turn in itertools.count():
        yield from places(first, PLACES, target=turn % 10, turn=turn)


def session(folder: Path, kind: str, messages: int) -> None:
    """Commands without end; the number of those that are confirmed is written to a pipe."""
    if kind == "write":
        real = os.fdatasync

        def slowly(descriptor):
            time.sleep(0.01)
            real(descriptor)

        os.fdatasync = slowly
    begun = begin(load_robot("aria"), load_plate("table2"), folder=folder)
    worker = Worker(begun.session, keepers=begun.keepers)
    if kind == "place":
        only_places(begun, messages)
    if kind == "task":
        tasks = itertools.cycle([MeasureVirtualArm(seed=1), Identify(), SelectTarget(2)])
    for command in tasks if kind == "task" else endless(begun.session):
        worker.submit(command)
        worker.wait()
        os.write(messages, f"{len(worker.journal)}\n".encode())


def only_places(begun: StartedSession, messages: int) -> None:
    """The places of one drag, each longer than a page, written without end and nothing computed meanwhile."""
    worker, texts = Worker(begun.session, keepers=begun.keepers), []
    for command in itertools.islice(places(begun.session, PLACES), PLACES + 1):
        worker.submit(command)
        worker.wait()
        line = json.loads(read_recording(begun.folder).lines[-1].text)
        del line[codec.CHECK]
        texts.append(codec.sealed(json.dumps(line | {"text": "." * LONG})))
    worker.close()
    path = begun.folder / JOURNAL
    before = path.read_bytes().splitlines(keepends=True)[:-1]
    file = Appender(path, length=len(b"".join(before)))
    file.add(texts[1])
    for text in itertools.cycle(texts[1:]):
        file.add(text, instead=True)
        os.write(messages, b"2\n")


def killed(folder: Path, kind: str, rng: random.Random) -> str:
    """What is wrong with a session that was killed; empty if nothing is."""
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(read)
        os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
        session(folder, kind, write)
    os.close(write)
    with os.fdopen(read) as pipe:
        message = [pipe.readline()]
        time.sleep(rng.uniform(0.0, LONGEST))
        os.kill(child, signal.SIGKILL)
        message += pipe.readlines()
    os.waitpid(child, 0)
    confirmed = int([line for line in message if line.endswith("\n")][-1])
    recording = read_recording(folder)
    if not confirmed <= len(recording.lines) <= confirmed + 1:
        return f"{confirmed} confirmed, {len(recording.lines)} lines"
    if check(recording).differences:
        return "another session"
    stray = {path.name for path in folder.rglob(".*")} - {".lock"}
    return f"left {', '.join(stray)}" if stray else ""


def main(times: int) -> None:
    rng, found = random.Random(1), Counter()
    for k in range(times):
        kind = KINDS[k % len(KINDS)]
        with tempfile.TemporaryDirectory() as folder:
            wrong = killed(Path(folder) / "session", kind, rng)
        found[kind, wrong or "nothing lost"] += 1
        print(f"{k + 1}: {kind}: {wrong or 'nothing lost'}", file=sys.stderr, flush=True)
    print("| killed in a | times | result |\n|---|---|---|")
    for (kind, result), number in sorted(found.items()):
        print(f"| {kind} | {number} | {result} |")


if __name__ == "__main__":
    main(int(sys.argv[1]))
