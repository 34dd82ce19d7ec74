"""Diagnose virtual arms whose effects nobody declared, and print what was named for what.

    python tests/benchmarks/zoo.py --arms 10                                     # tuning seeds
    python tests/benchmarks/zoo.py --seeds judging --arms 100 --check
    python tests/benchmarks/zoo.py --cases compliance,two --conditions ideal,masses10 --on six

Arms and effects are those of `tests/diagnosis/arms.py`, seed by seed on one morphology after the other; what
is right is said in `tests/diagnosis/judge.py`. Arms with an effect are diagnosed under `--conditions`, arms
without one under `--alarms`. Results on judging seeds must change nothing in the program.
"""

import argparse
import multiprocessing
import sys
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from typing import NamedTuple

import beside  # noqa: F401
import numpy as np
from arms import UnseenError, make
from calibration import bins, expected_error
from cases import CASES, WITHOUT, Case
from conditions import CONDITIONS, Conditions, under
from judge import Judged, judge
from morphologies import ARMS, MORPHOLOGIES, SIX
from options import ended, run_options, some_of
from rich.console import Console
from rich.progress import track
from scipy.stats import binomtest

from workbench.diagnosis.diagnose import diagnose
from workbench.report.blocks import ResultTable
from workbench.report.result_display import as_text

GROUPS = {"all": tuple(MORPHOLOGIES), "six": SIX, "classic": tuple(ARMS)}
"""Morphologies by one word."""
EACH, THREE, GOOD, ALARMS, FALSE, ODDS = 0.95, 0.85, 0.95, 0.02, 0.05, 0.05
"""Least share right of each kind, of three at once, and of good models; greatest share of arms without an
effect that are accused under a condition, of false causes per arm, and expected error of stated odds."""
HEADS = (
    "case", "arms", "right", "or in a class", "missed", "false", "failed", "good", "error / σ", "seconds"
)  # fmt: skip


class Task(NamedTuple):
    """One case to make and judge."""

    kind: str
    condition: str
    seed: int


def options(arguments=None):
    own = argparse.ArgumentParser(add_help=False)
    where, conditions = some_of(MORPHOLOGIES, **GROUPS), some_of(CONDITIONS, all=CONDITIONS)
    own.add_argument("--on", type=where, default="all", help=f"morphologies, or {', '.join(GROUPS)}")
    own.add_argument("--conditions", type=conditions, default="ideal", help="of arms with an effect, or all")
    own.add_argument("--alarms", type=conditions, default="all", help="of arms without an effect, likewise")
    own.add_argument("--held-out", type=float, default=0.0, help="share kept from the diagnosis")
    own.add_argument("--jobs", type=int, default=2, help="processes; 0: this one, for a debugger")
    return run_options(__doc__.splitlines()[0], "cases", CASES, arms=10, arguments=arguments, own=[own])


def tasks(given) -> Iterator[Task]:
    """What is to be judged."""
    for kind in given.kinds:
        for condition in given.alarms if kind in WITHOUT else given.conditions:
            if not CASES[kind].misseated or condition == "ideal":
                yield from (Task(kind, condition, seed) for seed in given.seeds)


def one(task: Task, given) -> Judged | None:
    """Make and judge one case; None where no arm can show it."""
    case = drawn(task, given.on)
    return None if case is None else judge(case, diagnose, held_out=given.held_out)


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
    wanted, work = list(tasks(given)), partial(one, given=given)
    shown = {"description": "diagnosing", "total": len(wanted), "console": Console(stderr=True)}
    if given.jobs:
        with ProcessPoolExecutor(given.jobs, multiprocessing.get_context("spawn")) as pool:
            found = list(track(pool.map(work, wanted), **shown))
    else:
        found = list(track(map(work, wanted), **shown))
    return {task: judged for task, judged in zip(wanted, found, strict=True) if judged is not None}


def by_kind(judged: Iterable[Judged]) -> dict[str, list[Judged]]:
    """Judged diagnoses per kind, in order of appearance."""
    out = defaultdict(list)
    for one in judged:
        out[one.kind].append(one)
    return out


def bounded(part: int, whole: int) -> str:
    """A share with its 95 % bounds (Wilson's)."""
    if not whole:
        return ""
    low, high = binomtest(part, whole).proportion_ci(method="wilson")
    return f"{100 * part / whole:.0f} % ({100 * low:.0f}–{100 * high:.0f})"


def cells(name: str, ones: Sequence[Judged]) -> tuple[str, ...]:
    """How some diagnoses came out; what the rows can't show is left out of all but the number of arms."""
    asked = [j for j in ones if j.seen]
    whole, unseen = len(asked), len(ones) - len(asked)
    errors = [j.error for j in asked if np.isfinite(j.error)] or [np.nan]
    seconds = [j.seconds for j in asked if not j.failed] or [np.nan]
    right, good = (bounded(sum(bool(getattr(j, name)) for j in asked), whole) for name in ("right", "good"))
    in_class, missed, false = (
        sum(map(count, asked))
        for count in (lambda j: j.right_or_class, lambda j: bool(j.missed), lambda j: len(j.extra))
    )
    return (
        name, f"{whole}{f' (+{unseen})' if unseen else ''}", right, str(in_class), str(missed), str(false),
        str(sum(j.failed for j in asked)), good, f"{np.median(errors):.2f}", f"{np.median(seconds):.1f}",
    )  # fmt: skip


def bounds(
    hidden: Sequence[Judged], calm: Mapping[str, Sequence[Judged]], every: Sequence[Judged]
) -> Iterator[tuple[str, bool]]:
    """Sentences and whether they hold: of arms with an effect under ideal conditions, of those without by
    condition, of all."""
    for kind, ones in by_kind(j for j in hidden if j.seen).items():
        minimum, right = THREE if kind == "three" else EACH, sum(j.right for j in ones)
        yield f"{kind}: right ≥ {minimum:.0%}: {bounded(right, len(ones))}", right >= minimum * len(ones)
    if named := [j for j in hidden if j.seen and not j.nameless]:
        good = sum(bool(j.good) for j in named)
        text = f"saved model within half of the noise ≥ {GOOD:.0%}: {bounded(good, len(named))}"
        yield text, good >= GOOD * len(named)
    for condition, ones in calm.items():
        alarms = sum(bool(j.found or j.extra) for j in ones)
        text = f"no effect, {condition}: accused ≤ {ALARMS:.0%}: {alarms} of {len(ones)}"
        yield text, alarms <= ALARMS * len(ones)
    rate = sum(len(j.extra) for j in every) / max(len(every), 1)
    yield f"false causes per arm ≤ {FALSE}: {rate:.3f}", rate <= FALSE
    if off := [j for j in every if j.misseated]:
        rows = sum(j.rows_right for j in off)
        yield f"misplaced rows found, ≤ 1 false: {rows} of {len(off)}", rows == len(off)
    if stated := bins([pair for j in every for pair in j.odds]):
        error = expected_error(stated)
        yield f"expected error of stated odds ≤ {ODDS:.0%}: {error:.1%}", error <= ODDS


def wrong(task: Task, j: Judged) -> str:
    """One line on a case that is not right."""
    truth, found = (
        ", ".join(
            " ".join(str(w) for w in (n.name, *(k + 1 for k in n.joints), n.detail or "")) for n in names
        )
        for names in (j.truth, dict.fromkeys((*j.found, *j.extra)))
    )
    rows = f"; rows −{j.overlooked} +{j.accused}" if j.overlooked or j.accused else ""
    errors = f"error {j.before:.2f} → {j.error:.2f} σ{'' if j.seen else ', hardly shown'}"
    return f"{task.condition}: {j.kind} {j.arm} {j.seed}: {truth} → {found}{rows} ({j.verdict}, {errors})"


def main(arguments=None):
    given = options(arguments)
    judged = run(given)
    hidden = {task: j for task, j in judged.items() if task.kind not in WITHOUT}
    for condition in given.conditions:
        kinds = by_kind(j for task, j in judged.items() if task.condition == condition)
        rows = [cells(kind, ones) for kind, ones in kinds.items()]
        print(as_text([ResultTable(condition, HEADS, rows)], 150))
    calm = {c: [j for t, j in judged.items() if t.kind in WITHOUT and t.condition == c] for c in CONDITIONS}
    calm = {condition: ones for condition, ones in calm.items() if ones}
    rows = [cells(condition, ones) for condition, ones in calm.items()]
    print(as_text([ResultTable("no effect", HEADS, rows)], 150))
    for task, j in judged.items():
        if given.wrong and not (j.right and j.rows_right):
            print(wrong(task, j))
    for b in bins([pair for j in judged.values() for pair in j.odds]):
        print(f"stated {100 * b.stated:.4g} %: {b.true} of {b.claims} claims true")
    ideal = [j for task, j in hidden.items() if task.condition == "ideal"]
    return ended(given, bounds(ideal, calm, list(judged.values())))


if __name__ == "__main__":
    sys.exit(main())
