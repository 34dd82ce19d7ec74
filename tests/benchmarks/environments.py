"""One virtual environment per peer, made once in a cache folder outside the tree and reused.

Nothing is installed into the environment that runs the benchmark.
"""

import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

REQUIREMENTS = {
    "pybotics": ("pybotics==3.1.2",),
    "figaroh": ("figaroh==1.0.2", "pin>=3.7,<5"),
    "robotkinecal": ("robotkinecal==0.1.0", "setuptools<81"),
}
"""What pip is asked for. robotkinecal's toolbox still imports pkg_resources."""
PYTHONS = ((3, 10), (3, 12))
"""Oldest and newest Python that all peers accept."""
THREADS = ("OMP", "OPENBLAS", "MKL", "NUMEXPR", "NUMBA", "VECLIB_MAXIMUM", "BLIS")
"""Libraries that take their number of threads from `…_NUM_THREADS` (VECLIB_MAXIMUM: `…_THREADS`)."""


@dataclass(frozen=True)
class Failed:
    """Why an environment or a worker could not be had."""

    reason: str


def default_cache():
    """The user's cache folder."""
    root = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(root) / "workbench-benchmarks"


def environment(threads, **more):
    """Variables of every worker: threads limited alike, nothing leaking in from this environment."""
    kept = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "PYTHONHOME", "VIRTUAL_ENV")}
    names = [f"{n}_{'' if n == 'VECLIB_MAXIMUM' else 'NUM_'}THREADS" for n in THREADS]
    return {**kept, **dict.fromkeys(names, str(threads)), **more}


def suitable_python():
    """A Python that all peers accept: this one, or another on the path."""
    if PYTHONS[0] <= sys.version_info[:2] <= PYTHONS[1]:
        return sys.executable
    for minor in range(PYTHONS[1][1], PYTHONS[0][1] - 1, -1):
        if found := shutil.which(f"python3.{minor}"):
            return found
    return None


def interpreter(peer, cache, python=None):
    """The Python of a peer's environment, made if it is not there; or why not."""
    folder = Path(cache) / peer
    found, done = folder / "bin" / "python", folder / "requirements.txt"
    wanted = "\n".join(REQUIREMENTS[peer])
    if found.exists() and done.exists() and done.read_text() == wanted:
        return found
    python = python or suitable_python()
    if python is None:
        return Failed("no Python 3.10–3.12 on the path")
    folder.parent.mkdir(parents=True, exist_ok=True)
    print(f"installing {', '.join(REQUIREMENTS[peer])} …", file=sys.stderr, flush=True)
    pip = (found, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *REQUIREMENTS[peer])
    for command in ((python, "-m", "venv", "--clear", folder), pip):
        ended = subprocess.run([str(c) for c in command], capture_output=True, text=True, env=environment(1))
        if ended.returncode:
            why = last_line(ended.stderr) or f"exit status {ended.returncode}"
            return Failed(f"not installed: {why}")
    done.write_text(wanted)
    return found


def run(command, *, limit, env):
    """Standard output of a process, or why there is none."""
    try:
        ended = subprocess.run(
            [str(c) for c in command], capture_output=True, text=True, timeout=limit, env=env
        )
    except subprocess.TimeoutExpired:
        return Failed(f"not done in {limit:g} s")
    if ended.returncode:
        return Failed(last_line(ended.stderr) or f"exit status {ended.returncode}")
    return ended.stdout


def last_line(text):
    """The last line that says something."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    errors = [line for line in lines if "rror" in line]
    return (errors or lines or [""])[-1][:160]
