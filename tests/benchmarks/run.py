"""Compare workbench with its peers on one task (`task.py`): `python tests/benchmarks/run.py`.

Every package gets the same files in its own process with the same number of threads; a peer gets a virtual
environment in the user's cache folder, made once (about 1.8 GB in all). What is fair about it: README.md.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import task

from workbench.report.blocks import ResultTable
from workbench.report.result_display import as_text

HERE = Path(__file__).resolve().parent
PEERS = {
    "pybotics": ("pybotics==3.1.2",),
    "figaroh": ("figaroh==1.0.2", "pin>=3.7,<5"),
    "robotkinecal": ("robotkinecal==0.1.0", "setuptools<81"),
}
"""What pip is asked for. robotkinecal's toolbox still imports pkg_resources."""
PYTHONS = ((3, 10), (3, 12))
"""Oldest and newest that all peers accept."""
THREADS = ("OMP_NUM", "OPENBLAS_NUM", "MKL_NUM", "NUMEXPR_NUM", "NUMBA_NUM", "VECLIB_MAXIMUM", "BLIS_NUM")
FASTER, RATE = 20.0, 1e6
"""By how much a search beats the fastest peer's, and poses with Jacobian a second."""
HEADS = ("way", "parameters", "time [ms]", "evaluations", "held-out error", "… axes tilted")


def environment(threads: int) -> dict[str, str]:
    """Variables of every worker: threads limited alike, nothing of this environment's Python."""
    kept = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "PYTHONHOME", "VIRTUAL_ENV")}
    return {**kept, **{f"{name}_THREADS": str(threads) for name in THREADS}, "MPLBACKEND": "Agg"}


def call(*command, limit: float, env: dict[str, str]) -> str:
    """Standard output of a process; its last error in a RuntimeError."""
    ended = subprocess.run([*map(str, command)], capture_output=True, text=True, timeout=limit, env=env)
    if ended.returncode:
        raise RuntimeError((ended.stderr.strip() or f"exit status {ended.returncode}").splitlines()[-1])
    return ended.stdout


def interpreter(peer: str, cache: Path, env: dict[str, str]) -> Path:
    """The Python of a peer's environment, made if it is not there."""
    folder, wanted = cache / peer, "\n".join(PEERS[peer])
    python, done = folder / "bin" / "python", folder / "requirements.txt"
    if not done.exists() or done.read_text() != wanted:
        own = PYTHONS[0] <= sys.version_info[:2] <= PYTHONS[1]
        call(sys.executable if own else "python3.12", "-m", "venv", "--clear", folder, limit=600, env=env)
        call(python, "-m", "pip", "install", "--quiet", *PEERS[peer], limit=3600, env=env)
        done.write_text(wanted)
    return python


def report_of(package: str, given: argparse.Namespace, folder: Path) -> dict:
    """What a package's worker printed, or why there is nothing."""
    print(f"{package} …", file=sys.stderr, flush=True)
    env, script = environment(given.threads), HERE / f"worker_{package}.py"
    try:
        if package == "workbench":
            python, env["PYTHONPATH"] = Path(sys.executable), str(HERE.parents[1])
        else:
            python = interpreter(package, given.cache, env)
        printed = call(python, script, folder, given.repeats, limit=given.limit, env=env)
    except (RuntimeError, OSError, subprocess.TimeoutExpired) as error:
        return {"failed": str(error), "paths": [], "rates": []}
    return json.loads(printed.strip().splitlines()[-1])


def milliseconds(path: dict) -> float:
    return 1e3 * statistics.median(path["arms"]["plain"]["seconds"])


def rows(package: str, report: dict, arrays: dict) -> Iterator[tuple[str, ...]]:
    """Cells of a package's ways; its error on each arm is added to the report."""
    if "failed" in report:
        yield f"{package}: not measured, {report['failed']}", *[""] * (len(HEADS) - 1)
    for path in report["paths"]:
        cells = []
        for arm, entry in path["arms"].items():
            mm, deg = entry["error"] = task.errors(entry["predicted"], arrays[f"{arm}_held_out"])
            cells.append(f"{mm:.3f} mm" + (f", {deg:.4f}°" if path["rotation"] else ""))
        facts = (path["parameters"], f"{milliseconds(path):.3g}", path["arms"]["plain"]["evaluations"])
        yield f"{package}: {path['name']}", *map(str, facts), *cells
    for rate in report["rates"]:
        poses = f"{rate['poses_per_second']:.3g} poses with Jacobian a second"
        yield f"{package}: {rate['name']}", "", poses, *[""] * (len(HEADS) - 3)


def bounds(reports: dict[str, dict]) -> Iterator[tuple[str, bool]]:
    """Sentences and whether they hold."""
    ours = reports["workbench"]
    peers = [path for name, report in reports.items() if name != "workbench" for path in report["paths"]]
    if peers and ours["paths"]:
        mine = next(path for path in ours["paths"] if path["name"] == "OPT2")
        ratio = min(map(milliseconds, peers)) / milliseconds(mine)
        yield f"search {ratio:.0f} times as fast as the fastest peer's (≥ {FASTER:.0f})", ratio >= FASTER
        error, *others = (path["arms"]["plain"]["error"][0] for path in (mine, *peers))
        yield f"held-out error {error:.3f} mm, best peer's {min(others):.3f} mm", error <= 1.05 * min(others)
    for rate in ours["rates"]:
        found = rate["poses_per_second"]
        yield f"{found:.3g} poses with Jacobian a second (≥ {RATE:.0g})", found >= RATE


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "workbench-benchmarks"
    parser.add_argument("--cache", type=Path, default=cache, help="peers' environments")
    parser.add_argument(
        "--peers", default=",".join(PEERS), help="names, commas between; empty: workbench alone"
    )
    parser.add_argument("--repeats", type=int, default=7, help="timed repetitions of a peer's identification")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--threads", type=int, default=1, help="threads of every process")
    parser.add_argument("--limit", type=float, default=900.0, help="seconds until a worker is given up")
    parser.add_argument("--check", action="store_true", help="exit status 1 if a bound is broken")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder, arrays = Path(name), task.make(given.seed, 100, 200)
        np.savez(folder / "task.npz", **arrays)
        (folder / "arm.urdf").write_text(task.urdf())
        packages = ("workbench", *filter(None, given.peers.split(",")))
        reports = {package: report_of(package, given, folder) for package in packages}
    found = [cells for package, report in reports.items() for cells in rows(package, report, arrays)]
    print(as_text([ResultTable(f"6R arm, 100 poses, medians of {given.repeats}", HEADS, found)], 150))
    checks = list(bounds(reports))
    for text, holds in checks:
        print(f"{'✓' if holds else '✗'} {text}")
    return int(given.check and not all(holds for _, holds in checks))


if __name__ == "__main__":
    sys.exit(main())
