"""Mutated inputs for every parser: each must end in success or in one sentence, soon and in little memory.

    python tests/benchmarks/hostile.py --inputs 100000
    python tests/benchmarks/hostile.py --seconds 60 --parsers csv,urdf

prints one row a parser for the table in README.md. Many inputs go through one forked process with a bound of
memory, so that a reader that crashes is counted. Formats with a star are read in a child of the program: what
kills the reader here goes through `read_measurements` too, and what comes of that is counted. The seeds of
whatever else came are told on standard error. With `--json` an interrupted run goes on.
"""

import argparse
import os
import pickle
import random
import re
import resource
import shutil
import signal
import sys
import time
import warnings
from collections import Counter
from collections.abc import Callable
from pathlib import Path

sys.path[:0] = [str(Path(__file__).resolve().parents[2]), str(Path(__file__).resolve().parent)]

from ledger import Ledger
from parsers import Made, Parse, made_rooms, parsers

from workbench.base.errors import WorkbenchError
from workbench.base.wording import MAX_SENTENCE

BATCH = 4000
SLOW, LARGE, LONGEST_WAIT = 2.0, 500 * 2**20, 60
"""Seconds of the processor and bytes that one input may take at most, and seconds on the clock."""
FINE = {"success", "sentence"}
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


def outcome(parse: Parse, content: bytes, kept: bool) -> tuple[str, float]:
    """What became of an input, and the processor's time that it took [s]."""
    begin, result = used(), "success"
    try:
        parse(content)
    except WorkbenchError as error:
        text = str(error)
        result = "sentence" if len(text) <= MAX_SENTENCE and "\n" not in text else "long sentence"
    except Exception as error:
        result = "sentence" if kept else f"bare {type(error).__name__}"
    took = used() - begin
    return (result if took <= SLOW else "slow"), took


def used() -> float:
    """The processor's time of this process and of its ended children [s]."""
    return sum(os.times()[:4])


def batch(name: str, sound: bytes, parse: Parse, seeds: range) -> list[tuple[str, float]]:
    """Outcomes of some seeds, from a process of their own; fewer if it died, the last for what killed it."""
    kept = name.endswith("*")
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(read)
        _bound()
        with os.fdopen(write, "wb") as pipe:
            for seed in seeds:
                signal.alarm(LONGEST_WAIT)
                signal.setitimer(signal.ITIMER_PROF, SLOW)
                pickle.dump(outcome(parse, mutated(sound, random.Random(f"{name} {seed}")), kept), pipe)
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
        found.append((f"killed by signal {os.WTERMSIG(status)}", 0.0))
    return found


def _bound() -> None:
    """No core, no words, and no more memory than one input may take: whatever asks for more is told so."""
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    maximum = pages * resource.getpagesize() + LARGE
    resource.setrlimit(resource.RLIMIT_AS, (maximum, maximum))
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 1)
    os.dup2(null, 2)


def tried(
    name: str, make: Callable[[], Made], *, inputs: int, seconds: float, ledger: Ledger
) -> tuple[Counter, float, int]:
    """Outcomes of mutated inputs, the slowest of them [s of the processor], and how many killed a child."""
    sound, parse, *door = make()
    parse(sound)  # what is built on first use is there, and the sound input is one
    counts: Counter[str] = Counter()
    slowest, deaths, at, end = 0.0, 0, 0, time.monotonic() + seconds
    while at < inputs and (f"{name} {at}" in ledger or time.monotonic() < end):
        key = f"{name} {at}"
        if key not in ledger:
            found = batch(name, sound, parse, range(at, min(at + BATCH, inputs)))
            seed = at + len(found) - 1
            died = bool(door) and found[-1][0].startswith("killed")
            if died:
                found[-1] = outcome(door[0], mutated(sound, random.Random(f"{name} {seed}")), False)
            for seed, (result, _) in enumerate(found, at):
                if result not in FINE:
                    print(f"{name} {seed}: {result}", file=sys.stderr, flush=True)
            record = {"counts": Counter(result for result, _ in found), "slowest": max(t for _, t in found)}
            ledger.add(key, record | {"died": died})
        counts.update(ledger.records[key]["counts"])
        slowest = max(slowest, ledger.records[key]["slowest"])
        deaths += ledger.records[key]["died"]
        at = counts.total()
    return counts, slowest, deaths


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--inputs", type=int, default=100_000)
    options.add_argument("--seconds", type=float, default=float("inf"), help="longest time for each parser")
    options.add_argument("--parsers", default="")
    options.add_argument("--json", type=Path, help="keep what was tried here")
    options.add_argument("--check", action="store_true", help="exit status 1 if anything else came")
    given = options.parse_args()
    wanted = set(filter(None, given.parsers.split(",")))
    warnings.simplefilter("ignore")
    ledger, good = Ledger(given.json, about="hostile"), True
    print("| parser | inputs | success | one sentence | anything else | slowest [s] | killed a child |")
    print("|---|---|---|---|---|---|---|", flush=True)
    for name, make in parsers().items():
        if wanted and name.rstrip(" *") not in wanted:
            continue
        counts, slowest, deaths = tried(name, make, inputs=given.inputs, seconds=given.seconds, ledger=ledger)
        others = ", ".join(f"{n} {what}" for what, n in counts.items() if what not in {"success", "sentence"})
        good &= set(counts) <= FINE
        row = (name, counts.total(), counts["success"], counts["sentence"], others or "0")
        row += (f"{slowest:.2f}", deaths if name.endswith("*") else "")
        print("| " + " | ".join(map(str, row)) + " |", flush=True)
        for folder in made_rooms:
            shutil.rmtree(folder, ignore_errors=True)
    sys.exit(0 if good or not given.check else 1)


if __name__ == "__main__":
    main()
