"""Mutated inputs for every parser: each must end in success or in one sentence, soon and in little memory.

    python tests/benchmarks/hostile.py --inputs 100000
    python tests/benchmarks/hostile.py --seconds 60 --parsers csv,urdf

prints one row a parser for the table in README.md. Inputs go through forked processes, so that a reader that
crashes is counted (formats that are read in a child of the program: as kept there).
"""

import argparse
import io
import json
import os
import pickle
import random
import re
import resource
import signal
import sys
import tempfile
import time
import zipfile
from collections import Counter
from collections.abc import Callable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from workbench.base.errors import WorkbenchError
from workbench.base.wording import LONGEST

BATCH = 500
SLOW, LARGE = 2.0, 500 * 1024
"""Seconds and KiB that one input may take at most."""
NASTY = [
    b"", b"\0", b"\n", b",", b";", b"'", b'"', b"[", b"]", b"{", b"}", b"<", b">", b"=", b"#", b"\xff",
    b"nan", b"inf", b"-1", b"1e999", b"9" * 30, b"9" * 5000, b"null", b"true", b"[" * 2000, b"\xe2\x88\x92",
    b"q1[deg]", b"x[mm]", b"joint", b"../", b"&a;", b"[[joint]]\n", b"\x7f\xff\xff\xff", b"\xff\xff\xff\xff",
]  # fmt: skip


def mutated(content: bytes, rng: random.Random) -> bytes:
    """Some bytes changed, cut, doubled or replaced; mostly few."""
    made = bytearray(content)
    for _ in range(1 if rng.random() < 0.6 else rng.randint(2, 8)):
        place, length = rng.randrange(len(made) + 1), int(rng.expovariate(0.1)) + 1
        kind = rng.randrange(5)
        if kind == 0 and made:
            made[min(place, len(made) - 1)] = rng.randrange(256)
        elif kind == 1:
            del made[place : place + length]
        elif kind == 2:
            made[place:place] = made[place : place + length * 5]
        elif kind == 3:
            made[place : place + length] = rng.choice(NASTY)
        elif numbers := list(re.finditer(rb"\d+", made)):
            number = rng.choice(numbers)
            made[number.start() : number.end()] = rng.choice(
                [b"0", b"-1", b"99999999999", b"1e400", b"x", b""]
            )
    return bytes(made)


def in_file(name: str, read: Callable[[Path], object]) -> Callable[[bytes], object]:
    """A parser of bytes from one of a file."""
    path = Path(tempfile.mkdtemp(prefix="hostile-")) / name

    def parse(content: bytes) -> object:
        path.write_bytes(content)
        return read(path)

    return parse


def table() -> bytes:
    head = "q1[deg],q2[deg],x[mm],y[mm],z[mm],qw,qx,qy,qz,session,exclude,time[s]\n"
    rows = "".join(f"{i}.5,2e1,3,4,-5.25,1,0,0,0,a,false,{i}\n" for i in range(6))
    return (head + rows).encode()


def parsers() -> dict[str, tuple[bytes, Callable[[bytes], object]]]:
    """A sound input and a function of bytes for each format."""
    import numpy as np
    import openpyxl
    import pyarrow as pa
    import pyarrow.parquet as parquet
    from scipy.io import savemat

    from workbench.arm.built_in_arms import load_robot
    from workbench.arm.robot_toml import read_toml
    from workbench.arm.urdf import read_urdf
    from workbench.data import native_formats
    from workbench.data.live.sample import parse_sample
    from workbench.data.readers import preview, read_measurements, read_trajectory
    from workbench.plate.plate_toml import built_in_plates, read_plate
    from workbench.session.commands.drag import SelectTarget
    from workbench.session.journal.folder import begin
    from workbench.session.journal.reader import JOURNAL, read_recording
    from workbench.session.worker import Worker

    room = Path(tempfile.mkdtemp(prefix="hostile-"))
    arm = load_robot("aria")
    begun = begin(arm, read_plate(built_in_plates()["table2"]), folder=room / "recording")
    worker = Worker(begun.session, keepers=begun.keepers)
    for target in (1, 2, 3):
        worker.submit(SelectTarget(target))
    worker.wait()
    worker.close()
    journal = room / "recording" / JOURNAL

    def read_csv(path: Path) -> object:
        shown = preview(path, joints=2)
        data = read_measurements(path, joints=2)
        assert shown.ok
        return data

    def read_journal(content: bytes) -> object:
        journal.write_bytes(content)
        return read_recording(journal.parent)

    book, sheet_file, mat, frame = openpyxl.Workbook(), io.BytesIO(), io.BytesIO(), io.BytesIO()
    for line in table().decode().splitlines():
        book.active.append(line.split(","))
    book.save(sheet_file)
    whole, place = zipfile.ZipFile(sheet_file), "xl/worksheets/sheet1.xml"
    sheet, rest = whole.read(place), {n: whole.read(n) for n in whole.namelist() if n != place}

    def packed(content: bytes) -> bytes:
        """A workbook with this sheet."""
        file = io.BytesIO()
        with zipfile.ZipFile(file, "w") as archive:
            for name, part in {**rest, place: content}.items():
                archive.writestr(name, part)
        return file.getvalue()

    savemat(mat, {"Q": np.ones((6, 2)), "P": np.ones((6, 3)), "s": {"a": np.eye(2), "n": "text"}})
    parquet.write_table(pa.table({"q1[rad]": [0.1, 0.2], "x[m]": [1.0, 2.0], "session": ["a", "b"]}), frame)
    pose = {"xyz": [0.4, 0.1, 0.3], "quat": [1, 0, 0, 0]}
    line = json.dumps({"time": 1.5, "q": [0.1] * 6, "capture": True} | pose)
    return {
        "csv": (table(), in_file("rows.csv", read_csv)),
        "trajectory": (table(), in_file("path.csv", read_trajectory)),
        "robot toml": (arm.save(room / "arm.toml").read_bytes(), in_file("arm.toml", read_toml)),
        "plate toml": (built_in_plates()["table2"].read_bytes(), in_file("plate.toml", read_plate)),
        "urdf": (arm.save(room / "arm.urdf").read_bytes(), in_file("arm.urdf", read_urdf)),
        "journal": (journal.read_bytes(), read_journal),
        "stream": (line.encode(), lambda b: parse_sample(b.decode(errors="replace"), line=1)),
        "xlsx *": (sheet, lambda b: native_formats.workbook_cells(packed(b))),
        "mat *": (mat.getvalue(), native_formats.matlab_arrays),
        "parquet *": (frame.getvalue(), native_formats.parquet_columns),
    }


def outcome(parse: Callable[[bytes], object], content: bytes, kept: bool) -> tuple[str, float]:
    """What became of an input, and the processor's time that it took [s]."""
    begin, result = time.process_time(), "success"
    try:
        parse(content)
    except WorkbenchError as error:
        text = str(error)
        result = "sentence" if len(text) <= LONGEST and "\n" not in text else "long sentence"
    except Exception as error:
        result = "sentence" if kept else f"bare {type(error).__name__}"
    took = time.process_time() - begin
    return (result if took <= SLOW else "slow"), took


def batch(name: str, sound: bytes, parse, seeds: range) -> list[tuple[str, float]]:
    """Outcomes of some seeds, from a process of their own; fewer if it died, the last for what killed it."""
    kept = name.endswith("*")
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(read)
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        null = os.open(os.devnull, os.O_WRONLY)
        os.dup2(null, 2)
        with os.fdopen(write, "wb") as pipe:
            for seed in seeds:
                signal.alarm(60)
                found = outcome(parse, mutated(sound, random.Random(f"{name} {seed}")), kept)
                if resource.getrusage(resource.RUSAGE_SELF).ru_maxrss > before + LARGE:
                    before, found = 10**12, ("large", found[1])
                pickle.dump(found, pipe)
                pipe.flush()
        os._exit(0)
    os.close(write)
    found: list[tuple[str, float]] = []
    with os.fdopen(read, "rb") as pipe:
        while True:
            try:
                found.append(pickle.load(pipe))
            except EOFError:
                break
    _, status = os.waitpid(child, 0)
    if os.WIFSIGNALED(status):
        found.append(("crash, kept in the child" if kept else f"killed by signal {os.WTERMSIG(status)}", 0.0))
    return found


def tried(name: str, sound: bytes, parse, *, inputs: int, seconds: float) -> tuple[Counter, float, int]:
    """Outcomes of mutated inputs, the slowest of them [s], and how many there were."""
    counts: Counter[str] = Counter()
    slowest, at, end = 0.0, 0, time.monotonic() + seconds
    while at < inputs and time.monotonic() < end:
        found = batch(name, sound, parse, range(at, min(at + BATCH, inputs)))
        counts.update(result for result, _ in found)
        slowest = max([slowest, *(took for _, took in found)])
        at += len(found)
    return counts, slowest, at


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--inputs", type=int, default=100_000)
    options.add_argument("--seconds", type=float, default=float("inf"), help="longest time for each parser")
    options.add_argument("--parsers", default="")
    options.add_argument("--check", action="store_true", help="exit status 1 if anything else came")
    given = options.parse_args()
    wanted = set(filter(None, given.parsers.split(",")))
    good = True
    print("| parser | inputs | success | one sentence | anything else | slowest [s] |")
    print("|---|---|---|---|---|---|")
    for name, (sound, parse) in parsers().items():
        if wanted and name.rstrip(" *") not in wanted:
            continue
        counts, slowest, total = tried(name, sound, parse, inputs=given.inputs, seconds=given.seconds)
        fine = {"success", "sentence", "crash, kept in the child"}
        others = ", ".join(f"{n} {what}" for what, n in counts.items() if what not in {"success", "sentence"})
        good &= set(counts) <= fine
        row = (name, total, counts["success"], counts["sentence"], others or "0", f"{slowest:.2f}")
        print("| " + " | ".join(map(str, row)) + " |", flush=True)
    sys.exit(0 if good or not given.check else 1)


if __name__ == "__main__":
    main()
