"""Diagnose virtual arms whose effects nobody declared, and print what was named for what.

    python tests/benchmarks/confusion.py --seeds 0:30                      # tuning
    python tests/benchmarks/confusion.py --seeds 1000000:1000100 --check   # judging

Arms and effects are those of `tests/diagnosis/arms.py`, one arm a seed in turn; what is right is said in
`tests/diagnosis/judge.py`. Results on judging seeds must change nothing in the program.
"""

import argparse
import importlib
import json
import multiprocessing
import os
import sys
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
TESTS = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TESTS.parent), str(TESTS), str(TESTS / "diagnosis")]

from arms import ARMS, make
from cases import CASES
from conditions import CONDITIONS, under
from counts import NOTHING, by_kind, confusion, share, shares
from judge import judge
from rich.console import Console
from rich.progress import track
from rich.table import Column, Table

from workbench.arm.effects import EFFECTS

WITHOUT = ("none", "misseated")
"""Kinds without an effect."""
NAMELESS = ("dent", "kinked-gear", "dragging-hose", "wobbling-mount")
ALL, EACH, GOOD, ALARMS = 0.95, 0.90, 0.95, 0.05
"""Least share that is right over all and of each, least share of good models, greatest of false alarms."""
WIDTH = 160
"""Characters that the tables need."""
DIAGNOSE = "workbench.diagnosis.diagnose:diagnose"


def options(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", default=",".join(CASES), help="kinds, commas between")
    parser.add_argument("--arms", default=",".join(ARMS), help="arms, commas between")
    parser.add_argument("--seeds", default="0:30", help="first and end, a colon between; for every kind")
    parser.add_argument("--poses", type=int, default=120)
    parser.add_argument("--noise-scale", type=float, default=1.0, help="times 0.05 mm and 0.01°")
    parser.add_argument("--point", action="store_true", help="positions without orientation")
    parser.add_argument("--free-frames", action="store_true", help="base and tool unknown")
    parser.add_argument(
        "--conditions",
        choices=CONDITIONS,
        help="what the arms break of the model's assumptions; replaces the above",
    )
    parser.add_argument("--held-out", type=float, default=0.0, help="share kept from the diagnosis")
    parser.add_argument("--processes", type=int, default=2, help="0: in this one, for a debugger")
    parser.add_argument("--diagnose", default=DIAGNOSE, help="module:function that takes robot and data")
    parser.add_argument("--wrong", action="store_true", help="list the cases that are not right")
    parser.add_argument("--json", type=Path, help="write every judged case to this file")
    parser.add_argument("--check", action="store_true", help="exit status 1 if a bound is broken")
    return parser.parse_args(arguments)


def one(kind, arm, seed, given):
    """Make and judge one case."""
    module, function = given.diagnose.split(":")
    case = (
        under(CONDITIONS[given.conditions], kind, seed, arm)
        if given.conditions
        else make(
            kind,
            seed,
            arm,
            poses=given.poses,
            noise=given.noise_scale,
            observation="point" if given.point else "pose",
            free_frames=given.free_frames,
        )
    )
    return judge(case, getattr(importlib.import_module(module), function), held_out=given.held_out)


def run(given):
    """All judged cases, in the order of kinds and seeds."""
    first, end = (int(s) for s in given.seeds.split(":"))
    arms, kinds = given.arms.split(","), given.cases.split(",")
    wanted = [(kind, arms[seed % len(arms)], seed) for kind in kinds for seed in range(first, end)]
    shown = {"description": "diagnosing", "total": len(wanted), "console": Console(stderr=True)}
    if not given.processes:
        return [one(*case, given) for case in track(wanted, **shown)]
    with ProcessPoolExecutor(given.processes, multiprocessing.get_context("spawn")) as pool:
        futures = {pool.submit(one, *case, given): i for i, case in enumerate(wanted)}
        found = {futures[f]: f.result() for f in track(as_completed(futures), **shown)}
    return [found[i] for i in range(len(wanted))]


def percent(part, whole):
    return f"{100 * part / whole:.0f} %" if whole else ""


def matrix(judged):
    """True kinds by names given: cases with the right joint, and after + those with another."""
    names = [*EFFECTS, NOTHING]
    table = Table(
        Column("true \\ named", no_wrap=True), *(n.replace("-", "\n") for n in names), title="confusion"
    )
    for kind, row in confusion(judged).items():
        cells = (row.get(name, (0, 0)) for name in names)
        table.add_row(kind, *(f"{a or ''}{f'+{b}' if b else ''}" for a, b in cells))
    return table


def summary(judged, arms):
    """How every kind came out."""
    heads = ("kind", "cases", "right", *arms, "missed", "extra", "failed")
    table = Table(*heads, "rows right", "model good", "error / σ", "seconds", title="shares")
    rows = shares(judged) | {"all": share(judged)}
    for kind, s in rows.items():
        each = (percent(s.by_arm[a], 1) if a in s.by_arm else "" for a in arms)
        counts = (str(n or "") for n in (s.missed, s.extra, s.failed))
        table.add_row(
            kind,
            str(s.cases),
            percent(s.right, s.cases),
            *each,
            *counts,
            percent(s.rows, s.cases),
            percent(s.good, s.cases),
            f"{s.error:.2f}",
            f"{s.seconds[0]:.2f} … {s.seconds[1]:.2f}",
            end_section=kind == list(rows)[-2],
        )
    return table


def bounds(judged):
    """Sentences, values, and whether they hold."""
    kinds = by_kind(judged)
    named = [j for k, ones in kinds.items() if k not in (*WITHOUT, *NAMELESS) for j in ones]
    none = [j for k in WITHOUT for j in kinds.get(k, ())]
    off = [j for j in judged if j.misseated]
    every = {k: share(ones) for k, ones in kinds.items() if k not in WITHOUT}
    worst = min(every, key=lambda k: every[k].right / every[k].cases, default=None)
    if named:
        right, good = (sum(getattr(j, a) for j in named) for a in ("right", "good"))
        yield f"right over all named ≥ {ALL:.0%}", percent(right, len(named)), right >= ALL * len(named)
        text = f"saved model within half of the noise ≥ {GOOD:.0%}"
        yield text, percent(good, len(named)), good >= GOOD * len(named)
    if worst:
        low = every[worst]
        text = f"right of each kind ≥ {EACH:.0%}"
        yield text, f"{percent(low.right, low.cases)} ({worst})", low.right >= EACH * low.cases
    if none:
        alarms = sum(bool(j.found) for j in none)
        text = f"false alarms ≤ {ALARMS:.0%}"
        yield text, f"{alarms} of {len(none)}", alarms <= ALARMS * len(none)
    if off:
        rows = sum(j.rows_right for j in off)
        yield "misplaced rows found, ≤ 1 false", f"{rows} of {len(off)}", rows == len(off)


def wrong(judged):
    """One line a case that is not right."""
    for j in (j for j in judged if not (j.right and j.rows_right)):
        spoken = (", ".join(_word(n) for n in group) or NOTHING for group in (j.truth, j.found))
        rows = f"; rows −{j.overlooked} +{j.accused}" if j.overlooked or j.accused else ""
        yield f"{j.kind} {j.arm} {j.seed}: {' → '.join(spoken)}{rows} ({j.verdict}, error {j.error:.2f} σ)"


def _word(named):
    joints = "/".join(str(j + 1) for j in named.joints)
    return " ".join(str(w) for w in (named.name, joints, named.detail) if w not in ("", None))


def main(arguments=None):
    given = options(arguments)
    judged = run(given)
    if given.json:
        given.json.write_text(json.dumps([j.as_json() for j in judged]))
    console = Console(width=max(Console().width, WIDTH))
    console.print(matrix(judged), summary(judged, given.arms.split(",")))
    for line in wrong(judged) if given.wrong else ():
        console.print(line, highlight=False)
    checks = list(bounds(judged))
    for text, value, holds in checks:
        console.print(f"{'✓' if holds else '✗'} {text}: {value}", highlight=False)
    return int(given.check and not all(holds for *_, holds in checks))


if __name__ == "__main__":
    sys.exit(main())
