"""Diagnose measured arms, and print what was found and the errors on rows that took no part.

    python tests/benchmarks/real_diagnosis.py                         # five folds of every set
    python tests/benchmarks/real_diagnosis.py --sets ur5,wam --seeds 0:3
    python tests/benchmarks/real_diagnosis.py --x-plane 0.8           # the UR10 without one plane of its grid

Folds are drawn over whole groups where the data have them (the UR10: grid points). Every fold is a diagnosis
of its own, so effects may differ from fold to fold; errors are means over the held-out rows of all folds.
"""

import argparse
import json
import os
import sys
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
TESTS = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TESTS.parent), str(TESTS)]

import numpy as np
from real_arms import SETS, load, plane, splits
from rich.console import Console
from rich.table import Table

from workbench.diagnosis.diagnose import diagnose

DATA = TESTS.parents[1] / "shared" / "data"
BOUNDS = {
    "ur10": (0.090, 0.017),
    "ur10 without a plane": (0.17, None),
    "ur5": (0.058, None),
    "wam": (None, None),
    "panda_1": (0.36, None),
    "panda_3": (0.16, None),
    "iiwa14": (0.19, None),
}
"""Greatest held-out errors with effects [mm], [deg]; None of the WAM: no worse than its geometry."""
MARGIN = 1.02
"""How much worse than geometry the mean may be by chance and count as no worse."""


class Fold(NamedTuple):
    """One diagnosis.

    Args:
        before, after: Mean held-out position errors of geometry alone and with effects [mm].
        turned: Likewise of orientations [deg]; NaN where none was measured.
        rows: Held-out rows, and how many of them the model can't speak of.
        effects: What was found.
        verdict: What the rows allow to be said.
        joint_noise: Of joint readings, the greatest, if the rows show any [mrad].
        seconds: What it took.
    """

    before: float
    after: float
    turned: tuple[float, float]
    rows: tuple[int, int]
    effects: tuple[str, ...]
    verdict: str
    joint_noise: float | None
    seconds: float


def options(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sets", default=",".join(SETS), help="sets, commas between")
    parser.add_argument("--seeds", default="0:1", help="first and end of the seeds that draw folds")
    parser.add_argument("--folds", type=int, default=5)
    parser.add_argument("--first", type=int, help="only so many of the folds")
    parser.add_argument(
        "--x-plane", type=float, nargs="+", help="hold these planes of the UR10's grid out [m]"
    )
    parser.add_argument("--data", type=Path, default=DATA, help="folder of the measurements")
    parser.add_argument("--json", type=Path, help="write every fold to this file")
    parser.add_argument("--check", action="store_true", help="exit status 1 if a bound is broken")
    return parser.parse_args(arguments)


def one(robot, train, held) -> Fold:
    """Diagnose the one part, judged on the other."""
    start = time.perf_counter()
    said = diagnose(robot, train, held_out=held)
    seconds = time.perf_counter() - start
    (_, before), (_, after) = said.before_rows, said.after_rows
    return Fold(
        before=1e3 * float(before.position.mean()),
        after=1e3 * float(after.position.mean()),
        turned=tuple(float(np.rad2deg(rows.rotation.mean())) for rows in (before, after)),
        rows=(len(held), len(held) - len(after.position)),
        effects=tuple(a.effect.label for a in said.effects),
        verdict=str(said.verdict),
        joint_noise=None if said.joint_noise is None else 1e3 * max(said.joint_noise.sigma),
        seconds=seconds,
    )


def tasks(given) -> Iterator[tuple[str, object, object, object]]:
    """Set, arm, rows to fit and rows held out, one diagnosis after the other."""
    if given.x_plane:
        robot, data = load(given.data, "ur10")
        for x in given.x_plane:
            yield ("ur10 without a plane", robot, *plane(data, given.data, x))
        return
    first, end = map(int, given.seeds.split(":"))
    for name in given.sets.split(","):
        robot, data = load(given.data, name)
        for seed in range(first, end):
            for train, held in list(splits(data, seed, given.folds))[: given.first]:
                yield name, robot, train, held


def row(name, folds: list[Fold]):
    """Cells of a set."""
    mean = {key: np.mean([getattr(f, key) for f in folds], axis=0) for key in ("before", "after", "turned")}
    found = Counter(effect for f in folds for effect in f.effects)
    noises = [f.joint_noise for f in folds if f.joint_noise is not None]
    yield name
    yield str(len(folds))
    yield f"{mean['before']:.4f} → {mean['after']:.4f}"
    yield "" if np.isnan(mean["turned"]).any() else "{:.4f} → {:.4f}".format(*mean["turned"])
    yield " ".join(str(f.rows[1]) for f in folds) if any(f.rows[1] for f in folds) else ""
    yield ", ".join(f"{effect} ({times})" for effect, times in found.most_common()) or "nothing"
    yield ", ".join(f"{verdict} ({times})" for verdict, times in Counter(f.verdict for f in folds).items())
    yield f"{np.mean(noises):.2g} mrad ({len(noises)})" if noises else ""
    yield f"{np.mean([f.seconds for f in folds]):.1f}"


def bounds(done: dict[str, list[Fold]]) -> Iterator[tuple[str, bool]]:
    """Sentences and whether they hold."""
    for name, folds in done.items():
        position, rotation = BOUNDS[name]
        before, after = (float(np.mean([getattr(f, key) for f in folds])) for key in ("before", "after"))
        if position is None:
            yield f"{name}: {after:.4f} mm, no worse than geometry {before:.4f} mm", after <= MARGIN * before
        else:
            yield f"{name}: {after:.4f} mm ≤ {position} mm", after <= position
        if rotation is not None:
            turned = float(np.mean([f.turned[1] for f in folds]))
            yield f"{name}: {turned:.4f}° ≤ {rotation}°", turned <= rotation


HEADS = ("set", "folds", "held out [mm]", "held out [°]", "unspoken", "found", "verdict", "joint noise", "s")


def main(arguments=None):
    given = options(arguments)
    done: dict[str, list[Fold]] = {}
    for name, robot, train, held in tasks(given):
        fold = one(robot, train, held)
        done.setdefault(name, []).append(fold)
        print(name, json.dumps(fold._asdict(), ensure_ascii=False), file=sys.stderr, flush=True)
    table = Table(*HEADS, title="diagnosis of measured arms")
    for name, folds in done.items():
        table.add_row(*row(name, folds))
    console = Console(width=max(Console().width, 200))
    console.print(table)
    checks = list(bounds(done))
    for text, holds in checks:
        console.print(f"{'✓' if holds else '✗'} {text}", highlight=False)
    if given.json:
        given.json.write_text(json.dumps({n: [f._asdict() for f in fs] for n, fs in done.items()}))
    return int(given.check and not all(holds for _, holds in checks))


if __name__ == "__main__":
    sys.exit(main())
