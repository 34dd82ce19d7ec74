"""Choosing 30 of 500 poses, beside figaroh's exchange.  Run: python tests/benchmarks/choosing.py

Both get the same information matrices of the same random poses of ARIA (24 constants, whitened and scaled),
figaroh's `Detmax` in its own process; both choices are judged by the same few lines of numpy, as O1. The
bound is that of the continuous (convex) design, which no choice exceeds. `--check`: exit status 1 if a bound
of the comparison breaks.
"""

import argparse
import json
import statistics
import sys
import tempfile
import time
from pathlib import Path

import environments
import numpy as np
from environments import Failed

from workbench.arm.built_in_arms import load_robot
from workbench.arm.linearisation import linearise
from workbench.plate.criterion import criterion_of
from workbench.plate.exchange import exchange
from workbench.plate.observability import INDICES, SetIndex
from workbench.plate.poses.d_optimal import d_bound, d_exchange
from workbench.plate.poses.sampling import random_poses

HERE = Path(__file__).resolve().parent
CANDIDATES, CHOSEN = 500, 30
FASTER, SHARE = 20.0, 0.01


def o1(grams, choice):
    """det(Σ AᵢᵀAᵢ)^(1/2p) / √m."""
    size = grams.shape[1]
    return float(np.exp(np.linalg.slogdet(grams[choice].sum(0))[1] / (2 * size)) / np.sqrt(len(choice)))


def timed(work):
    """Median seconds of five calls after one that is not counted, and the answer."""
    answer, seconds = work(), []
    for _ in range(5):
        began = time.perf_counter()
        answer = work()
        seconds.append(time.perf_counter() - began)
    return statistics.median(seconds), answer


def figaroh(grams, given):
    """The choice of its Detmax and how long it took, or why there is none."""
    python = environments.interpreter("figaroh", given.cache, given.python)
    if isinstance(python, Failed):
        return python
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "grams.npz"
        np.savez(file, grams=grams)
        command = [python, HERE / "worker_detmax.py", file, str(CHOSEN)]
        printed = environments.run(command, limit=600.0, env=environments.environment(1))
    return printed if isinstance(printed, Failed) else json.loads(printed.strip().splitlines()[-1])


def others(grams, start):
    """Seconds of an exchange for every other index, from the D-optimal choice."""
    for name, index in INDICES.items():
        if isinstance(index, SetIndex):
            allowed = np.ones((CHOSEN, len(grams)), bool)
            criterion = criterion_of(index, CHOSEN)
            began = time.perf_counter()
            found = exchange(grams, allowed, criterion, starts=start[None], distinct=True)
            yield name, time.perf_counter() - began, -found.history[0], -found.cost


def main():
    """Print the comparison and its bounds."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cache", type=Path, default=environments.default_cache(), help="environments")
    parser.add_argument("--python", help="Python that makes figaroh's environment")
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--check", action="store_true", help="exit status 1 if a bound is broken")
    given = parser.parse_args()
    arm, good = load_robot("aria"), True
    print("seed        figaroh's Detmax               workbench      faster   convex bound   missing")
    for seed in range(given.seeds):
        linearisation = linearise(arm, random_poses(arm, CANDIDATES, rng=np.random.default_rng(seed)))
        blocks = linearisation.scaled.reshape(CANDIDATES, 6, -1)
        grams = blocks.transpose(0, 2, 1) @ blocks
        seconds, found = timed(lambda b=blocks: d_exchange(b, CHOSEN))
        bound_seconds, bound = timed(lambda b=blocks: d_bound(b, CHOSEN))
        mine, peer = o1(grams, found.choice), figaroh(grams, given)
        missing = 1.0 - mine / bound
        good &= missing <= SHARE
        beside, ratio = "not measured: " + getattr(peer, "reason", ""), ""
        if not isinstance(peer, Failed):
            theirs, ratio = o1(grams, peer["choice"]), f"{peer['seconds'] / seconds:.0f}×"
            different = len(set(peer["choice"]))
            beside = f"{theirs:.1f} in {peer['seconds']:.2f} s ({different} different)"
            good &= mine >= theirs and peer["seconds"] >= FASTER * seconds
        print(
            f"{seed:>4}   {beside:<34} {mine:.1f} in {1e3 * seconds:.0f} ms {ratio:>7}   {bound:.1f} in "
            f"{1e3 * bound_seconds:.0f} ms   {100 * missing:.2f} %"
        )
    print("\nindex   D-optimal start   exchanged for it      time")
    for name, seconds, before, after in others(grams, found.choice):
        print(f"{name:<5} {before:>17.5g} {after:>18.5g} {1e3 * seconds:>7.0f} ms")
    print(
        f"\n{'✓' if good else '✗'} as good, {FASTER:.0f}× faster, at most {100 * SHARE:.0f} % below the bound"
    )
    return int(given.check and not good)


if __name__ == "__main__":
    sys.exit(main())
