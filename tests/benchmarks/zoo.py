"""Diagnose virtual arms with effects that nobody declared, or with gaps in their files; print what was named.

    python tests/benchmarks/zoo.py --arms 10                                     # tuning seeds
    python tests/benchmarks/zoo.py --seeds judging --arms 100 --check
    python tests/benchmarks/zoo.py --cases compliance,two --conditions ideal,masses10 --on six
    python tests/benchmarks/zoo.py --gaps all --seeds judging --arms 1000 --check

Arms and effects are those of `tests/diagnosis/arms.py`, seed by seed on one morphology after the other; what
is right is said in `tests/diagnosis/judge.py`. Arms with an effect are diagnosed under `--conditions`, arms
without one under `--alarms`. With `--gaps` every seed draws one of `tests/diagnosis/gaps.py`, what is hidden,
the morphology, 60 to 120 rows, whether base and tool are known and whether orientations are measured. Results
on judging seeds must change nothing in the program.
"""

import argparse
import multiprocessing
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from typing import NamedTuple

import beside  # noqa: F401
import numpy as np
from arms import UnseenError, make
from calibration import bins, expected_error
from cases import CASES, WITHOUT
from conditions import CONDITIONS, Conditions, under
from gaps import GAPS, judge_gap
from judge import Judged, judge
from morphologies import ARMS, MORPHOLOGIES, SIX
from options import ended, run_options, some_of

from workbench.diagnosis.diagnose import diagnose
from workbench.report.blocks import ResultTable
from workbench.report.result_display import as_text

GROUPS = {"all": tuple(MORPHOLOGIES), "six": SIX, "classic": tuple(ARMS)}
"""Morphologies by one word."""
EACH, THREE, GOOD, ALARMS, FALSE, ODDS, KEPT = 0.95, 0.85, 0.95, 0.02, 0.05, 0.05, 0.03
"""Least share right of each kind, of three at once, and of good models; greatest share of arms without an
effect that are accused under a condition, of false causes per arm, and expected errors of stated odds: of
whole files, and of those with gaps."""
CLAIMED = (("certain", True), ("certain", False), ("probable", False))
HEADS = (
    *("", "arms", "right", "or in a class", "missed", "certain, true", "certain, false", "probable, false"),
    *("failed", "good", "error / σ", "seconds"),
)


class Task(NamedTuple):
    """One case to make and judge: what is hidden, or else a gap."""

    kind: str
    condition: str
    seed: int


def options(arguments=None):
    own = argparse.ArgumentParser(add_help=False)
    where, conditions = some_of(MORPHOLOGIES, **GROUPS), some_of(CONDITIONS, all=CONDITIONS)
    own.add_argument("--on", type=where, default="all", help=f"morphologies, or {', '.join(GROUPS)}")
    own.add_argument("--conditions", type=conditions, default="ideal", help="of arms with an effect, or all")
    own.add_argument("--alarms", type=conditions, default="all", help="of arms without an effect, likewise")
    own.add_argument("--gaps", type=some_of(GAPS, all=GAPS), help="of files, in place of conditions; or all")
    own.add_argument("--jobs", type=int, default=2, help="processes; 0: this one, for a debugger")
    return run_options(__doc__.splitlines()[0], "cases", CASES, arms=10, arguments=arguments, own=[own])


def tasks(given) -> Iterator[Task]:
    """What is to be judged."""
    if given.gaps:
        yield from (Task("", given.gaps[seed % len(given.gaps)], seed) for seed in given.seeds)
        return
    for kind in given.kinds:
        for condition in given.alarms if kind in WITHOUT else given.conditions:
            if not CASES[kind].misseated or condition == "ideal":
                yield from (Task(kind, condition, seed) for seed in given.seeds)


def one(task: Task, arms: Sequence[str]) -> Judged | None:
    """Make and judge one case on the morphology whose turn it is, or on the next one that can show it."""
    if not task.kind:
        return judge_gap(task.condition, task.seed)
    condition = CONDITIONS[task.condition]
    for k in range(len(arms)):
        about = task.kind, task.seed, arms[(task.seed + k) % len(arms)]
        try:
            case = make(*about) if condition == Conditions() else under(condition, *about)
        except UnseenError:
            continue
        return judge(case, diagnose, held_out=0.0)
    return None


def run(given) -> dict[Task, Judged]:
    """All judged cases, in the order of tasks."""
    wanted, work = list(tasks(given)), partial(one, arms=given.on)
    if given.jobs:
        with ProcessPoolExecutor(given.jobs, multiprocessing.get_context("spawn")) as pool:
            found = list(pool.map(work, wanted))
    else:
        found = list(map(work, wanted))
    return {task: judged for task, judged in zip(wanted, found, strict=True) if judged is not None}


def cells(name: str, ones: Sequence[Judged]) -> tuple[str, ...]:
    """How some diagnoses came out; what the rows can't show is left out of all but arms and claims."""
    asked = [j for j in ones if j.seen]
    whole, unseen = len(asked), len(ones) - len(asked)
    errors = [j.error for j in asked if np.isfinite(j.error)] or [np.nan]
    seconds = [j.seconds for j in asked if not j.failed] or [np.nan]
    counts = [sum(bool(getattr(j, name)) for j in asked) for name in ("right_or_class", "missed")]
    counts += [sum(j.claimed(*how) for j in ones) for how in CLAIMED]
    return (
        name, f"{whole}{f' (+{unseen})' if unseen else ''}", str(sum(j.right for j in asked)),
        *map(str, [*counts, sum(j.failed for j in asked)]), str(sum(j.good for j in asked)),
        f"{np.median(errors):.2f}", f"{np.median(seconds):.1f}",
    )  # fmt: skip


def table(title: str, groups: Mapping[str, Sequence[Judged]]) -> None:
    """One line for each group that has any."""
    rows = [cells(name, ones) for name, ones in groups.items() if ones]
    print(as_text([ResultTable(title, HEADS, rows)], 160))


def bounds(given, judged: Mapping[Task, Judged]) -> Iterator[tuple[str, bool]]:
    """Sentences and whether they hold: of arms with an effect under ideal conditions, of those without by
    condition, of files with gaps, of all."""
    every = list(judged.values())
    if given.gaps:
        certain = sum(j.claimed("certain", False) for j in every)
        yield f"certain and false: {certain} of {len(every)}", not certain
    else:
        hidden = [j for t, j in judged.items() if t.kind not in WITHOUT and t.condition == "ideal" and j.seen]
        for kind, ones in grouped((j.kind, j) for j in hidden).items():
            minimum, right = THREE if kind == "three" else EACH, sum(j.right for j in ones)
            yield f"{kind}: right ≥ {minimum:.0%}: {right} of {len(ones)}", right >= minimum * len(ones)
        if named := [j for j in hidden if not j.nameless]:
            good = sum(j.good for j in named)
            text = f"saved model within half of the noise ≥ {GOOD:.0%}: {good} of {len(named)}"
            yield text, good >= GOOD * len(named)
        for condition, ones in grouped(
            (t.condition, j) for t, j in judged.items() if t.kind in WITHOUT
        ).items():
            alarms = sum(bool(j.found or j.extra) for j in ones)
            text = f"no effect, {condition}: accused ≤ {ALARMS:.0%}: {alarms} of {len(ones)}"
            yield text, alarms <= ALARMS * len(ones)
        rate = sum(len(j.extra) for j in every) / max(len(every), 1)
        yield f"false causes per arm ≤ {FALSE}: {rate:.3f}", rate <= FALSE
    if off := [j for j in every if j.misseated]:
        rows = sum(j.rows_right for j in off)
        yield f"misplaced rows found, ≤ 1 false: {rows} of {len(off)}", rows == len(off)
    if stated := bins([pair for j in every for pair in j.odds]):
        error, most = expected_error(stated), KEPT if given.gaps else ODDS
        yield f"expected error of stated odds ≤ {most:.0%}: {error:.1%}", error <= most


def grouped(pairs: Iterable[tuple[str, Judged]]) -> dict[str, list[Judged]]:
    """Judged diagnoses by a word, in order of appearance."""
    out: dict[str, list[Judged]] = {}
    for name, one in pairs:
        out.setdefault(name, []).append(one)
    return out


def wrong(task: Task, j: Judged) -> str:
    """One line on a case that is not right, and what was falsely claimed."""
    truth, found = (
        ", ".join(
            " ".join(str(w) for w in (n.name, *(k + 1 for k in n.joints), n.detail or "")) for n in names
        )
        for names in (j.truth, dict.fromkeys((*j.found, *j.extra)))
    )
    rows = f"; rows −{j.overlooked} +{j.accused}" if j.overlooked or j.accused else ""
    errors = f"error {j.before:.2f} → {j.error:.2f} σ{'' if j.seen else ', hardly shown'}"
    false = "".join(f"\n    {text} ({how}, {p:.4f})" for text, how, p, true in j.claims if not true)
    return (
        f"{task.condition}: {j.kind} {j.arm} {j.seed}: {truth} → {found}{rows} ({j.verdict}, {errors}){false}"
    )


def main(arguments=None):
    given = options(arguments)
    judged = run(given)
    if given.gaps:
        by_gap = grouped((task.condition, j) for task, j in judged.items())
        table("files with gaps", by_gap | {"all": list(judged.values())})
    else:
        for condition in given.conditions:
            table(
                condition, grouped((j.kind, j) for task, j in judged.items() if task.condition == condition)
            )
        table("no effect", grouped((t.condition, j) for t, j in judged.items() if t.kind in WITHOUT))
    for task, j in judged.items():
        if given.wrong and not (
            all(true for *_, true in j.claims) if given.gaps else j.right and j.rows_right
        ):
            print(wrong(task, j))
    for b in bins([pair for j in judged.values() for pair in j.odds]):
        print(f"stated {100 * b.stated:.4g} %: {b.true} of {b.claims} claims true")
    return ended(given, bounds(given, judged))


if __name__ == "__main__":
    sys.exit(main())
