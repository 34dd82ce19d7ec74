"""Diagnose virtual arms whose effects nobody declared, and print what was named for what.

    python tests/benchmarks/zoo.py --arms 10 --json tuning.jsonl                 # tuning seeds
    python tests/benchmarks/zoo.py --seeds judging --arms 100 --json judged.jsonl --check
    python tests/benchmarks/zoo.py --cases compliance,two --conditions ideal,masses10 --on six
    python tests/benchmarks/zoo.py --ablation --arms 3 --conditions masses30     # each part switched off

Arms and effects are those of `tests/diagnosis/arms.py`, seed by seed on one morphology after the other; what
is right is said in `tests/diagnosis/judge.py`. Arms with an effect are diagnosed under `--conditions`, arms
without one under `--alarms`. All kinds get their first arm before any gets its second, and with `--json` an
interrupted run goes on where it stopped. Results on judging seeds must change nothing in the program.
"""

import argparse
import importlib
import multiprocessing
import os
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import NamedTuple

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
TESTS = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TESTS.parent), str(TESTS), str(TESTS / "diagnosis")]

from arms import UnseenError, make, seeds_of
from calibration import bins, expected_error
from cases import CASES, WITHOUT, Case
from conditions import CONDITIONS, Conditions, under
from judge import Judged, judge
from ledger import Ledger
from morphologies import ARMS, MORPHOLOGIES, SIX
from rich.console import Console
from rich.progress import track
from tally import bounds, compared, kept, matrix, morphologies, summary, under_conditions, wrong

WIDTH = 190
"""Characters that the tables need."""
DIAGNOSE = "workbench.diagnosis.diagnose:diagnose"
EFFECTS = "workbench.arm.effects.effect"
CAUSES = "workbench.diagnosis.claims.claimed_causes"
OFF: dict[str, tuple[tuple[str, str, object], ...]] = {
    "inertia": (("workbench.diagnosis.search.refit", "needs_inertia", lambda robot: False),),
    "together": ((EFFECTS, "separate_and_joint", list),),
    "size": ((CAUSES, "MIN_RESIDUAL_SHARE", 0.0), (CAUSES, "MIN_NOISE_SHARE", 0.0)),
    "readings": (("workbench.identification.joint_reading_noise", "MIN_GAIN", float("inf")),),
}
"""Parts of the diagnosis that an ablation switches off: module, name in it, and what it becomes."""
GROUPS = {"all": tuple(MORPHOLOGIES), "six": SIX, "classic": tuple(ARMS)}
"""Morphologies by one word."""


class Task(NamedTuple):
    """One case to make and judge."""

    kind: str
    condition: str
    seed: int

    @property
    def key(self) -> str:
        """Its name in the file of results."""
        return f"{self.kind}, {self.condition}, {self.seed}"


def options(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", default=",".join(CASES), help="kinds, commas between")
    parser.add_argument("--on", default="all", help=f"morphologies, commas between, or {', '.join(GROUPS)}")
    parser.add_argument("--arms", type=int, default=10, help="arms a kind and condition, one a seed")
    parser.add_argument(
        "--seeds", default="tuning", help="tuning, judging, or the first one and the end: 5:8"
    )
    parser.add_argument(
        "--conditions", default="ideal", help="of arms with an effect, commas between, or all"
    )
    parser.add_argument("--alarms", default="all", help="conditions of arms without an effect, likewise")
    parser.add_argument("--off", default="", help="parts to switch off, commas between")
    parser.add_argument("--ablation", action="store_true", help="switch each part off in turn, and compare")
    parser.add_argument("--held-out", type=float, default=0.0, help="share kept from the diagnosis")
    parser.add_argument("--jobs", type=int, default=2, help="processes; 0: this one, for a debugger")
    parser.add_argument("--diagnose", default=DIAGNOSE, help="module:function that takes robot and data")
    parser.add_argument("--wrong", action="store_true", help="list the cases that are not right")
    parser.add_argument("--json", type=Path, help="keep every judged case in this file, and go on from it")
    parser.add_argument("--check", action="store_true", help="exit status 1 if a bound is broken")
    given = parser.parse_args(arguments)
    for name, known in (("cases", CASES), ("conditions", CONDITIONS), ("alarms", CONDITIONS), ("off", OFF)):
        chosen = list(known) if getattr(given, name) == "all" else _names(getattr(given, name))
        if strange := set(chosen) - set(known):
            choice = ", ".join(known) or "nothing yet"
            parser.error(f"--{name} doesn't know {', '.join(sorted(strange))}; choose from {choice}")
        setattr(given, name, chosen)
    given.on = GROUPS.get(given.on) or tuple(_names(given.on))
    if strange := set(given.on) - set(MORPHOLOGIES):
        parser.error(f"--on doesn't know {', '.join(sorted(strange))}; choose from {', '.join(MORPHOLOGIES)}")
    given.seeds = seeds_of(given.seeds, given.arms)
    return given


def _names(text: str) -> list[str]:
    return [word for word in text.split(",") if word]


def tasks(given) -> Iterator[Task]:
    """What is to be judged."""
    for kind in given.cases:
        for condition in given.alarms if kind in WITHOUT else given.conditions:
            if CASES[kind].misseated and condition != "ideal":
                continue
            yield from (Task(kind, condition, seed) for seed in given.seeds)


def switch_off(names) -> None:
    """Replace what `OFF` names, in this process."""
    for module, name, value in (change for part in names for change in OFF[part]):
        found = importlib.import_module(module)
        if not hasattr(found, name):
            raise SystemExit(f"--off: {module} has no {name}")
        setattr(found, name, value)


def one(task: Task, given) -> dict:
    """Make and judge one case; empty where no arm can show it."""
    module, function = given.diagnose.split(":")
    case = drawn(task, given.on)
    if case is None:
        return {}
    return judge(case, getattr(importlib.import_module(module), function), held_out=given.held_out).as_json()


def drawn(task: Task, arms: Sequence[str]) -> Case | None:
    """The case on the morphology whose turn it is, or on the next one that can show it."""
    condition = CONDITIONS[task.condition]
    for k in range(len(arms)):
        arm = arms[(task.seed + k) % len(arms)]
        try:
            if condition == Conditions():
                return make(task.kind, task.seed, arm)
            return under(condition, task.kind, task.seed, arm)
        except UnseenError:
            continue
    return None


def run(given) -> dict[Task, Judged]:
    """All judged cases, in the order of tasks."""
    path = given.json
    if given.ablation and path is not None:
        path = path.with_stem("-".join([path.stem, *given.off]))
    ledger = Ledger(
        path, f"{given.diagnose} on {','.join(given.on)} held out {given.held_out} off {','.join(given.off)}"
    )
    wanted = list(tasks(given))
    new = sorted((task for task in wanted if task.key not in ledger), key=lambda task: task.seed)
    shown = {"description": "diagnosing", "total": len(new), "console": Console(stderr=True)}
    if given.jobs:
        context = multiprocessing.get_context("spawn")
        with ProcessPoolExecutor(given.jobs, context, switch_off, (given.off,)) as pool:
            futures = {pool.submit(one, task, given): task for task in new}
            for future in track(as_completed(futures), **shown):
                ledger.add(futures[future].key, future.result())
    else:
        switch_off(given.off)
        for task in track(new, **shown):
            ledger.add(task.key, one(task, given))
    records = {task: ledger.records[task.key] for task in wanted}
    return {task: Judged.from_json(record) for task, record in records.items() if record}


def ablation(given) -> Iterator[tuple[str, list[Judged]]]:
    """Every kind of arm, with the whole diagnosis and without each of its parts."""
    given.jobs = max(given.jobs, 1)  # a part is switched off in processes of its own
    for part in ("", *OFF):
        given.off = [part] if part else []
        yield f"without {part}" if part else "whole", list(run(given).values())


def main(arguments=None):
    given = options(arguments)
    console = Console(width=max(Console().width, WIDTH))
    if given.ablation:
        console.print(compared(dict(ablation(given))))
        return 0
    judged = run(given)
    by_condition: dict[str, list[Judged]] = {}
    for task, found in judged.items():
        if task.kind not in WITHOUT or task.condition == "ideal":
            by_condition.setdefault(task.condition, []).append(found)
    for condition, ones in by_condition.items():
        console.print(matrix(ones, condition), summary(ones, condition), morphologies(ones, condition))
    calm = {c: [j for t, j in judged.items() if t.kind in WITHOUT and t.condition == c] for c in CONDITIONS}
    console.print(under_conditions({c: ones for c, ones in calm.items() if ones}))
    for task, found in judged.items():
        if given.wrong and not (found.right and found.rows_right):
            console.print(f"{task.condition}: {wrong(found)}", highlight=False)
    stated = bins([pair for found in judged.values() for pair in found.odds])
    console.print(kept(stated))
    checks = list(bounds(by_condition, calm, expected_error(stated) if stated else None))
    for text, value, holds in checks:
        console.print(f"{'✓' if holds else '✗'} {text}: {value}", highlight=False)
    return int(given.check and not all(holds for *_, holds in checks))


if __name__ == "__main__":
    sys.exit(main())
