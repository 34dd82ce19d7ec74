"""Compare workbench with its peers, and time it alone: `python tests/benchmarks/run.py`.

Every package gets the same task (task.py) in its own process with the same number of threads; what is
fair about it is said in README.md beside this file.
"""

import argparse
import json
import os
import statistics
import sys
import tempfile
import time
from pathlib import Path

import environments
import numpy as np
import task
from environments import Failed
from table import Table, compared, count, seconds, show

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
REFERENCE = "OPT2"
FASTER, RATE, LARGE, HELP, STATIC = 20.0, 1e6, 2.0, 0.3, 0.1
STEADY = 1.5
"""A pose may take this many times longer among a million than among ten thousand: growth is linear."""
MEMORY = 64.0
"""MB beyond the input that a million poses may take."""


def options():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--cache", type=Path, default=environments.default_cache(), help="peers' environments"
    )
    parser.add_argument("--python", help="Python that makes the peers' environments")
    parser.add_argument("--peers", default=",".join(environments.REQUIREMENTS), help="names, commas between")
    parser.add_argument("--repeats", type=int, default=7, help="timed repetitions of a peer's identification")
    parser.add_argument("--poses", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--threads", type=int, default=1, help="threads of every process")
    parser.add_argument("--limit", type=float, default=900.0, help="seconds until a worker is given up")
    parser.add_argument("--json", type=Path, help="write everything that was measured to this file")
    parser.add_argument("--check", action="store_true", help="exit status 1 if a bound is broken")
    return parser.parse_args()


def ours(command, given, **more):
    """Run this environment's Python on workbench."""
    env = environments.environment(given.threads, PYTHONPATH=str(ROOT), **more)
    return environments.run([sys.executable, *command], limit=given.limit, env=env)


def parsed(printed):
    """The JSON that a worker printed, or why there is none."""
    if isinstance(printed, Failed):
        return {"failed": printed.reason}
    return json.loads(printed.strip().splitlines()[-1])


def worked(package, given, folder):
    """One package's report."""
    script, rest = HERE / f"worker_{package}.py", (folder, str(given.repeats))
    print(f"{package} …", file=sys.stderr, flush=True)
    if package == "workbench":
        return parsed(ours((script, *rest), given))
    python = environments.interpreter(package, given.cache, given.python)
    if isinstance(python, Failed):
        return {"failed": python.reason}
    env = environments.environment(given.threads, MPLBACKEND="Agg")
    return parsed(environments.run([python, script, *rest], limit=given.limit, env=env))


def first_calls(given):
    """The first calls with an empty folder of compiled code, then with the folder that they left."""
    with tempfile.TemporaryDirectory() as folder:
        first = (HERE / "single_process.py", "first")
        runs = [parsed(ours(first, given, NUMBA_CACHE_DIR=folder)) for _ in range(2)]
    return dict(zip(("cold", "warm"), runs, strict=True))


def help_time(given):
    """Median wall time of `workbench --help`, or why there is none."""
    beside = Path(sys.executable).with_name("workbench")
    if not any((ROOT / "workbench" / place).exists() for place in ("cli.py", "cli/__init__.py")):
        return {"failed": "no command line yet"}
    env = environments.environment(given.threads, PYTHONPATH=str(ROOT))
    command = [beside, "--help"] if beside.exists() else [sys.executable, "-m", "workbench", "--help"]
    times = []
    for _ in range(6):
        began = time.perf_counter()
        printed = environments.run(command, limit=60, env=env)
        times.append(time.perf_counter() - began)
        if isinstance(printed, Failed):
            return {"failed": printed.reason}
    return {"seconds": statistics.median(times[1:])}


def alone(table, measured):
    """Rows and bounds of workbench alone."""
    table.heading("workbench alone")
    growth, first, large, static, shown = (
        measured[k] for k in ("growth", "first", "large", "wrenches", "help")
    )
    if isinstance(growth, list):
        for part in growth:
            rate = f"{count(part['rows'] / part['seconds'])} poses/s"
            memory = f"{part['beyond_input']:.1f} MB beyond the input"
            table.add(
                f"{count(part['rows'])} poses, 24 columns",
                "24",
                seconds(part["seconds"]),
                "",
                rate,
                "",
                memory,
            )
        each = {p["rows"]: p["seconds"] / p["rows"] for p in growth}
        ratio, memory = each[1_000_000] / each[10_000], growth[-1]["beyond_input"]
        value = f"{ratio:.2f}× the time per pose of ten thousand, {memory:.0f} MB beyond the input"
        table.check("linear growth to 1 M poses in bounded memory", value, ratio < STEADY and memory < MEMORY)
    for state, part in first.items():
        if "failed" in part:
            table.add(f"first calls, {state} cache", "", "not measured", "", "", "", part["failed"])
            continue
        text = f"then identification {seconds(part['identification'])}; imports {seconds(part['imports'])}"
        table.add(f"first Jacobian, {state} cache", "24", seconds(part["jacobian"]), "", "", "", text)
    if "failed" in large:
        table.add("11 911 poses", "", "not measured", "", "", "", large["failed"])
    else:
        parameters = str(large["parameters"])
        table.add("11 911 poses, search", parameters, seconds(large["search"]), "", "", "", "OPT2")
        more = f"OPT2, all checks; with three algorithms {seconds(large['all_three'])}"
        error = f"{large['held_out_mm']:.3f} mm (noise included)"
        whole = str(large["whole_parameters"])
        table.add("11 911 poses, whole run", whole, seconds(large["whole"]), "", error, "", more)
        slowest = max(large["search"], large["whole"])
        table.check("11 911 poses with 40 parameters in under 2 s", seconds(slowest), slowest < LARGE)
    bound = "joint loads of 12 000 poses in under 0.1 s"
    value = seconds(static["seconds"]) if "seconds" in static else f"not measured: {static['failed']}"
    table.check(bound, value, static["seconds"] < STATIC if "seconds" in static else None)
    value = seconds(shown["seconds"]) if "seconds" in shown else f"not measured: {shown['failed']}"
    table.add("workbench --help", "", value)
    table.check(
        "workbench --help in under 0.3 s", value, shown["seconds"] < HELP if "seconds" in shown else None
    )
    table.add("one drag step", "", "by drag.py")


def bounds(table, reports, mine, rate):
    """The bounds on the comparison."""
    paths = [p for name, r in reports.items() if name != "workbench" for p in r.get("paths", ())]
    bound = "identification at least 20× faster than the fastest peer"
    if mine and paths:
        fastest = min(statistics.median(p["arms"]["plain"]["seconds"]) for p in paths)
        table.check(bound, f"{fastest / mine:.0f}×", fastest >= FASTER * mine)
        errors = [p["arms"]["plain"]["error"][0] for p in paths]
        own = next(p for p in reports["workbench"]["paths"] if p["name"] == REFERENCE)
        reached = own["arms"]["plain"]["error"][0]
        value = f"{reached:.3f} mm, best peer {min(errors):.3f} mm"
        table.check("held-out error not above the best peer's", value, reached <= 1.05 * min(errors))
    else:
        table.check(bound, "not measured", None)
    bound = "poses with Jacobian at 1 M/s on one core"
    table.check(bound, f"{count(rate)}/s" if rate else "not measured", rate >= RATE if rate else None)


def main():
    given = options()
    table, load = Table(), os.getloadavg()[0]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        arrays = task.make(given.seed, given.poses, 2 * given.poses)
        np.savez(folder / "task.npz", **arrays)
        (folder / "arm.urdf").write_text(task.urdf())
        packages = ["workbench", *(p for p in environments.REQUIREMENTS if p in given.peers.split(","))]
        reports = {package: worked(package, given, folder) for package in packages}
    print("workbench alone …", file=sys.stderr, flush=True)
    measured = {
        k: parsed(ours((HERE / "single_process.py", k), given)) for k in ("growth", "large", "wrenches")
    }
    measured |= {"first": first_calls(given), "help": help_time(given)}
    mine, rate = compared(table, reports, arrays, REFERENCE)
    bounds(table, reports, mine, rate)
    alone(table, measured)
    threads = f"{given.threads} thread{'s' if given.threads > 1 else ''} a process"
    show(table, f"6R arm, 0.1 mm and 0.02° noise, medians of {given.repeats} repeats, {threads}")
    busy = max(load, os.getloadavg()[0] - given.threads)
    if busy > 0.5:
        print(
            f"The machine was busy with other work (load {busy:.1f}, {os.cpu_count()} cores): measure again."
        )
    if given.json:
        given.json.write_text(json.dumps({"reports": reports, "alone": measured, "checks": table.checks}))
    return int(given.check and not table.good)


if __name__ == "__main__":
    sys.exit(main())
