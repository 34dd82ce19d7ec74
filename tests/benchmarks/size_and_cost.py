"""Size and cost of a checkout.  Run: python tests/benchmarks/size_and_cost.py [--tree PATH]

Prints lines, files and wings (top-level packages), the time of an import, how many files of the package a
drag step and a diagnosis run through, and the time of `identify` from Python and by the command. It knows the
layout with wings and the one before it, so that two checkouts can be compared. Every number comes from a
process of its own; times are the median of `--repeats`: seconds, and in brackets the processor's, which other
programs on the machine do not lengthen.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
COMMON = """
import json, sys, threading, time
from importlib import import_module
from pathlib import Path

def first(*places):
    for place in places:
        home, _, name = place.partition(":")
        try:
            return getattr(import_module(home), name)
        except (ImportError, AttributeError):
            pass
    raise ImportError(places)

def files(action):
    seen, home = set(), str(Path(import_module("workbench").__file__).parent)
    def profile(frame, event, argument):
        if event == "call":
            seen.add(frame.f_code.co_filename)
    threading.setprofile(profile)
    sys.setprofile(profile)
    action()
    sys.setprofile(None)
    threading.setprofile(None)
    return sum(name.startswith(home) for name in seen)

def timed(action):
    begin, cpu = time.perf_counter(), time.process_time()
    action()
    return time.perf_counter() - begin, time.process_time() - cpu

load_robot = first("workbench:load_robot")
load_plate = first("workbench:load_plate")
measure_poses = first("workbench:measure_poses")
"""
IDENTIFY = """
identify = first("workbench.identification.identify:identify", "workbench.pipeline:identify")
arm = load_robot("aria")
rows = measure_poses(arm, 100, seed=1)[1]
identify(arm, rows)
print(json.dumps(timed(lambda: identify(arm, rows))))
"""
DIAGNOSE = """
diagnose = first("workbench.diagnosis.diagnose:diagnose", "workbench.pipeline:diagnose")
arm = load_robot("aria")
rows = measure_poses(arm, 80, effects=("joint-compliance:2",), seed=1)[1]
print(json.dumps(files(lambda: diagnose(arm, rows))))
"""
DRAG = """
App = first("workbench.views.page.app:App", "workbench.app.server:App")
Grab = first("workbench.session.commands.drag:GrabTarget", "workbench.session.commands:GrabTarget")
Move = first("workbench.session.commands.drag:MoveTarget", "workbench.session.commands:MoveTarget")
app = App(load_robot("aria"), load_plate("table2"))
target = app.worker.session.plate.targets[0]
session = Grab(0, client=1).apply(app.worker.session)

def step(away):
    x, y, z = map(float, target.xyz)
    after = Move(0, (x - away, y, z), tuple(map(float, target.rpy)), client=1).apply(session)
    return after, lambda: app.view.draw(after)

for away in (0.01, 0.02):
    step(away)[1]()
applied = files(lambda: step(0.03))
after, draw = step(0.04)
print(json.dumps([applied, files(draw)]))
app.close()
"""


def run(tree: Path, code: str, *, cwd: str, **environment: str):
    """What a program prints as JSON, with a checkout's package."""
    plain = {name: value for name, value in os.environ.items() if not name.endswith("_NUM_THREADS")}
    done = subprocess.run(
        [sys.executable, "-c", code],
        env=plain | {"PYTHONPATH": str(tree), "RERUN_ANALYTICS_ENABLED": "false"} | environment,
        cwd=cwd,
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        print(done.stderr.splitlines()[-1], file=sys.stderr)
        return None
    return json.loads(done.stdout.splitlines()[-1])


def imported(module: str) -> str:
    """A program that times an import."""
    return (
        "import json, time; a, b = time.perf_counter(), time.process_time()\n"
        f"import {module}\n"
        "print(json.dumps([time.perf_counter() - a, time.process_time() - b]))"
    )


def command(tree: Path, words: list[str], *, cwd: str) -> tuple[float, float]:
    """Seconds and processor seconds of a whole command."""
    code = (
        "import json, os, subprocess, sys, time; a, b = time.perf_counter(), os.times()\n"
        f"subprocess.run([sys.executable, '-m', 'workbench', *{words!r}], check=True, capture_output=True)\n"
        "c = os.times(); cpu = c.children_user + c.children_system - b.children_user - b.children_system\n"
        "print(json.dumps([time.perf_counter() - a, cpu]))"
    )
    return run(tree, code, cwd=cwd)


def times(values: list) -> str:
    """Median seconds, and the processor's."""
    if None in values:
        return "–"
    wall, cpu = (statistics.median(column) for column in zip(*values, strict=True))
    return f"{wall:.2f} s ({cpu:.2f})"


def measured(tree: Path, repeats: int, cwd: str) -> dict[str, str]:
    """Every line of the table."""
    package = tree / "workbench"
    sources = sorted(package.rglob("*.py"))
    wings = [p for p in sorted(package.iterdir()) if (p / "__init__.py").is_file()]
    alone = [p for p in package.glob("*.py") if not p.name.startswith("__")]
    drag = run(tree, COMMON + DRAG, cwd=cwd) or ("–", "–")
    rows = ["simulate", "--robot", "aria", "--poses", "100", "--seed", "1", "--out", "rows.csv"]
    command(tree, rows, cwd=cwd)
    one = {"OPENBLAS_NUM_THREADS": "1"}
    pick = ("workbench.identification.identify", "workbench.pipeline.identification")
    module = next(m for m in pick if (tree / (m.replace(".", "/") + ".py")).is_file())
    return {
        "lines": str(sum(len(p.read_text(encoding="utf-8").splitlines()) for p in sources)),
        "files": str(len(sources)),
        "wings": f"{len(wings)} packages, {len(alone)} single files",
        "import workbench": times([run(tree, imported("workbench"), cwd=cwd) for _ in range(repeats)]),
        f"import {module}": times([run(tree, imported(module), cwd=cwd) for _ in range(repeats)]),
        "files of a drag step, to apply": str(drag[0]),
        "files of a drag step, to draw": str(drag[1]),
        "files of a diagnosis": str(run(tree, COMMON + DIAGNOSE, cwd=cwd) or "–"),
        "identify from Python": times([run(tree, COMMON + IDENTIFY, cwd=cwd) for _ in range(repeats)]),
        "identify with one thread": times(
            [run(tree, COMMON + IDENTIFY, cwd=cwd, **one) for _ in range(repeats)]
        ),
        "the whole command": times(
            [command(tree, ["identify", "rows.csv", "--robot", "aria"], cwd=cwd) for _ in range(repeats)]
        ),
    }


def main() -> None:
    """Print the table of one checkout."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--tree", type=Path, default=ROOT, help="checkout to measure")
    parser.add_argument("--repeats", type=int, default=5)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        for name, value in measured(options.tree.resolve(), options.repeats, folder).items():
            print(f"{name:<45} {value}", flush=True)


if __name__ == "__main__":
    main()
