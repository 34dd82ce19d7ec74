"""Whether the workbench runs with the lowest versions that it names and with the newest, and what it brings.

    python tests/benchmarks/versions.py lowest
    python tests/benchmarks/versions.py newest
    python tests/benchmarks/versions.py audit

The first two make an environment of this Python in the user's cache folder, install the base dependencies at
their lower bounds (or as new as they come), and run import, simulate, identify, diagnose and the page. The
third lists what this environment holds because of the base installation, with licence and size.
"""

import re
import subprocess
import sys
import tempfile
import tomllib
import urllib.request
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

from environments import default_cache, environment, last_line

ROOT = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
SHOWN = ("numpy", "scipy", "numba", "pin", "viser", "rerun-sdk", "trimesh", "matplotlib", "pint", "typer")
SERVE = """
from workbench.arm.built_in_arms import load_robot
from workbench.plate.plate_toml import load_plate
from workbench.views.page.serve import serve
serve(lambda: (load_robot("aria"), load_plate("table2")), port=0, open_browser=False,
      on_ready=lambda url: print(url, flush=True))
"""


def python_of(which: str) -> Path:
    """The Python of an environment with these versions, made if it is not there."""
    folder = default_cache() / f"versions-{which}"
    python, done = folder / "bin" / "python", folder / "requirements.txt"
    bounds = PROJECT["dependencies"]
    wanted = "\n".join(text.replace(">=", "==") if which == "lowest" else text for text in bounds)
    if not (python.exists() and done.exists() and done.read_text() == wanted):
        subprocess.run([sys.executable, "-m", "venv", "--clear", folder], check=True)
        (folder / "wanted.txt").write_text(wanted)
        pip = [python, "-m", "pip", "install", "-q", "--only-binary", ":all:", "-r", folder / "wanted.txt"]
        subprocess.run(pip, check=True, env=environment(1))
        (folder / "wanted.txt").rename(done)
    return python


def run(python: Path) -> None:
    """The commands, one after the other; each says whether it works."""
    found = subprocess.run([python, "-m", "pip", "freeze"], capture_output=True, text=True, check=True)
    frozen = dict(line.lower().split("==") for line in found.stdout.splitlines() if "==" in line)
    print(", ".join(f"{name} {frozen.get(name)}" for name in SHOWN))
    variables = environment(1, PYTHONPATH=str(ROOT), RERUN_ANALYTICS_ENABLED="false")
    with tempfile.TemporaryDirectory() as folder:
        program = [python, "-W", "error::DeprecationWarning:workbench", "-m", "workbench"]
        for words in (
            "--help",
            "simulate --robot aria --poses 60 --seed 1 --effect joint-compliance:2 --out rows.csv",
            "identify rows.csv --robot aria --save calibrated.toml --json result.json --report report",
            "diagnose rows.csv --robot aria --json diagnosis.json",
            "plate export table2 --robot aria --formats csv --out made",
        ):
            ended = subprocess.run(
                [*map(str, program), *words.split()],
                cwd=folder,
                env=variables,
                capture_output=True,
                text=True,
            )
            good = ended.returncode == 0
            print(f"{words.split()[0]}: {'works' if good else last_line(ended.stderr)}", flush=True)
        page = subprocess.Popen(
            [python, "-c", SERVE], cwd=folder, env=variables, stdout=subprocess.PIPE, text=True
        )
        try:
            status = urllib.request.urlopen(page.stdout.readline().strip(), timeout=60).status
            print(f"page: {'works' if status == 200 else status}")
        finally:
            page.terminate()
            page.wait()


def needed(names: list[str]) -> dict[str, str]:
    """Distributions that a list of requirements brings, and which first asked for each."""
    found, open_ = {}, [(text, "workbench") for text in names]
    while open_:
        text, by = open_.pop(0)
        name, extras = re.match(r"([\w.-]+)(?:\[([\w,-]+)\])?", text).groups()
        key = re.sub(r"[-_.]+", "-", name).lower()
        try:
            asked = distribution(key).requires or []
        except PackageNotFoundError:
            continue
        known = key in found
        found.setdefault(key, by)
        for one in asked:
            extra = re.search(r"extra\s*==\s*['\"]([\w-]+)", one)
            if (not extra and not known) or (extra and extras and extra[1] in extras.split(",")):
                open_.append((one, key))
    return found


def licence(meta) -> str:
    """As its maker states it."""
    text = meta.get("License-Expression") or ""
    classified = [
        c.rpartition("::")[2].strip() for c in meta.get_all("Classifier") or [] if "License ::" in c
    ]
    return text or ", ".join(classified) or (meta.get("License") or "not stated").splitlines()[0][:60]


def audit() -> None:
    """One row for each distribution of the base installation."""
    rows, total = [], 0.0
    for key, by in needed(PROJECT["dependencies"]).items():
        one = distribution(key)
        size = (
            sum(p.stat().st_size for f in one.files or [] if (p := Path(str(f.locate()))).is_file()) / 2**20
        )
        rows.append(
            (
                size,
                f"| {one.metadata['Name']} | {one.version} | {licence(one.metadata)} | {size:.1f} | {by} |",
            )
        )
        total += size
    print("| distribution | version | licence | MiB | asked for by |\n|---|---|---|---|---|")
    for _, row in sorted(rows, reverse=True):
        print(row)
    print(f"\n{len(rows)} distributions, {total:.0f} MiB")


if __name__ == "__main__":
    if sys.argv[1] == "audit":
        audit()
    else:
        run(python_of(sys.argv[1]))
