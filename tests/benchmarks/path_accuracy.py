"""How much better hidden arms follow a circle and a line once they are calibrated and corrected.

    python tests/benchmarks/path_accuracy.py 30

The arms are those of `tests/extras/trajectories/followed.py`, from seeds that no test uses.
"""

import os
import sys
from pathlib import Path

import numpy as np

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
TESTS = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TESTS.parent), str(TESTS), str(TESTS / "diagnosis")]
sys.path.insert(0, str(TESTS / "extras" / "trajectories"))

import arms
from followed import CURVES, followed, paths


def main(count: int) -> None:
    """Print reductions over many arms, of seeds that no test uses."""
    for kind in CURVES:
        planned = paths(kind)
        found = [followed(kind, arms.JUDGING[0] + k, planned) for k in range(count)]
        for name, runs in zip(("circle", "line"), zip(*found, strict=True), strict=True):
            before = np.array([r.before.mean() for r in runs])
            text = [f"{kind} {name}: before {1e3 * np.median(before):.2f} mm"]
            for step in ("one_step", "iterated"):
                after = np.array([getattr(r, step).mean() for r in runs])
                low, mid, high = np.percentile(before / after, [0, 50, 100])
                worse = max(1e3 * (getattr(r, step) - r.before).max() for r in runs)
                text.append(
                    f"{step} {1e3 * np.median(after):.3f} mm, {mid:.0f}x [{low:.1f} … {high:.0f}], "
                    f"worst change {worse:+.3f} mm"
                )
            print("; ".join(text))


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 30)
