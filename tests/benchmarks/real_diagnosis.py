"""Diagnose measured arms, and print what was found and the errors on rows that took no part.

    python tests/benchmarks/real_diagnosis.py                         # five folds of every set
    python tests/benchmarks/real_diagnosis.py --sets ur5,wam --seeds 0:3
    python tests/benchmarks/real_diagnosis.py --x-plane 0.8           # the UR10 without one plane of its grid

Folds are drawn over whole groups where the data have them (the UR10: grid points). Every fold is a diagnosis
of its own, so causes may differ from fold to fold; errors are means over the held-out rows of all folds.
Every fold is printed on standard error as it ends, with its verdict, map and scatter of joints.
"""

import argparse
import sys
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import beside
import numpy as np
from claims import claims, map_gain
from real_arms import SETS, load, plane, set_names, splits

from workbench.diagnosis.diagnose import diagnose


@dataclass(frozen=True)
class Part:
    """One diagnosis of a part of the rows.

    Args:
        position: Mean held-out position error of the nominal arm, geometry alone and the final model [mm].
        turned: Likewise of orientations [deg]; NaN where none was measured.
        rows: Fitted rows, held-out rows, and how many of these the model can't speak of.
        causes: Kind and joints of every claim.
        sentences: What people read of each.
        map_mm: What the residual map takes off the held-out error [mm]; NaN where there is none.
        verdict: What the rows allow to be said.
        joint_noise: Of joint readings, the greatest, if the rows show any [mrad].
        seconds: What it took.
    """

    position: tuple[float, float, float]
    turned: tuple[float, float, float]
    rows: tuple[int, int, int]
    causes: tuple[str, ...]
    sentences: tuple[str, ...]
    map_mm: float
    verdict: str
    joint_noise: float | None
    seconds: float


def options(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sets", type=set_names, default=list(SETS), help="sets, commas between")
    parser.add_argument("--seeds", default="0:1", help="first and end of the seeds that draw folds")
    parser.add_argument("--folds", type=int, default=5)
    parser.add_argument("--first", type=int, help="only so many of the folds")
    parser.add_argument(
        "--x-plane", type=float, nargs="+", help="hold these planes of the UR10's grid out [m]"
    )
    parser.add_argument("--data", type=Path, default=beside.DATA, help="folder of the measurements")
    return parser.parse_args(arguments)


def one(robot, train, held) -> Part:
    """Diagnose the one part, judged on the other."""
    start = time.perf_counter()
    result = diagnose(robot, train, held_out=held)
    seconds = time.perf_counter() - start
    errors = [v.held_out for v in (result.nominal, result.before, result.after)]
    turned = [e.orientation_deg for e in errors]
    found = claims(result)
    return Part(
        position=tuple(e.position_mm.mean for e in errors),
        turned=tuple(float("nan") if t is None else t.mean for t in turned),
        rows=(len(train), len(held), len(held) - len(result.after.held_out)),
        causes=tuple(word(claim) for claim in found),
        sentences=tuple(claim.sentence for claim in found),
        map_mm=map_gain(result),
        verdict=str(result.verdict),
        joint_noise=None if (noise := result.remaining.joint_noise) is None else 1e3 * max(noise.sigma),
        seconds=seconds,
    )


def word(claim) -> str:
    """Kinds and joints of a claim; a band of orders by its ends."""
    joints = "/".join(map(str, sorted({j + 1 for n in claim.names for j in n.joints})))
    details = sorted({n.detail for n in claim.names if n.detail is not None}, key=str)
    numbers = [d for d in details if isinstance(d, int)]
    detail = f"{min(numbers)}–{max(numbers)}" if len(numbers) > 1 else "/".join(map(str, details))
    kinds = "/".join(dict.fromkeys(n.name for n in claim.names))
    return " ".join(w for w in (kinds, joints and f"joint {joints}", detail, claim.confidence) if w)


def tasks(given) -> Iterator[tuple[str, str, object, object, object]]:
    """Set, which part of it, arm, rows to fit and rows held out, one diagnosis after the other."""
    if given.x_plane:
        robot, data = load(given.data, "ur10")
        for x in given.x_plane:
            yield ("ur10 without a plane", f"x {x}", robot, *plane(data, given.data, x))
        return
    first, end = map(int, given.seeds.split(":"))
    for name in given.sets:
        robot, data = load(given.data, name)
        for seed in range(first, end):
            for k, rows in enumerate(list(splits(data, seed, given.folds))[: given.first]):
                yield (name, f"fold {seed}.{k}", robot, *rows)


def main(arguments=None):
    given = options(arguments)
    folds: dict[str, list[Part]] = {}
    for name, part, robot, train, held in tasks(given):
        done = one(robot, train, held)
        print(f"{name}, {part}: {done}", file=sys.stderr, flush=True)
        folds.setdefault(name, []).append(done)
    for name, parts in folds.items():
        errors = (np.mean([getattr(p, key) for p in parts], axis=0) for key in ("position", "turned"))
        mm, deg = (" → ".join(f"{e:.4f}" for e in own) for own in errors)
        seconds = np.mean([p.seconds for p in parts])
        print(f"{name}, nominal → geometry → final over {len(parts)} folds: {mm} mm, {deg}°; {seconds:.1f} s")
        result = [pair for p in parts for pair in zip(p.causes, p.sentences, strict=True)]
        for cause, times in Counter(cause for cause, _ in result).most_common():
            print(f"  {times} of {len(parts)}: {next(text for other, text in result if other == cause)}")


if __name__ == "__main__":
    main()
