"""The program in a process of its own, where the folder, packages or surroundings are others."""

import json
import os
import subprocess
import sys
from pathlib import Path
from textwrap import dedent
from typing import NamedTuple

ROOT = Path(__file__).parent.parent
ENDED = """
import contextlib, io, json, os, shlex, sys
from pathlib import Path
from workbench.__main__ import main

def ended(line):
    sys.argv[1:] = shlex.split(line)
    out, err = (io.TextIOWrapper(io.BytesIO(), write_through=True) for _ in range(2))
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            main()
        except SystemExit as end:
            return end.code or 0, *(text.buffer.getvalue().decode(text.encoding) for text in (out, err))

"""
"""Commands one after the other: what is imported and compiled serves all of them."""


class Ended(NamedTuple):
    """How a command ended."""

    status: int
    out: str
    err: str


def python(code: str, *arguments: str, folder: Path, packages: tuple = (), **environment: str) -> str:
    """What a program prints that ends well."""
    path = os.pathsep.join(map(str, (*packages, ROOT)))
    done = subprocess.run(
        [sys.executable, "-c", dedent(code), *arguments],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": path, **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def commands(*lines: str, **options) -> list[Ended]:
    """How each command line ended, without the program's name; all in one process."""
    code = ENDED + "print(json.dumps([ended(line) for line in json.loads(sys.argv[1])]))"
    return [Ended(*end) for end in json.loads(python(code, json.dumps(lines), **options))]


FORKED = """
import importlib, workbench.cli, workbench.diagnosis.diagnose, workbench.exports, workbench.data.readers
found = {}
for name, package in json.loads(sys.argv[1]).items():
    ours, theirs = os.pipe()
    if os.fork():
        os.close(theirs)
        with open(ours) as answer:
            found[name] = json.load(answer)
        os.wait()
    else:
        sys.path.insert(0, package)
        os.chdir(package)
        importlib.invalidate_caches()
        with open(theirs, "w") as answer:
            json.dump([ended(line) for line in json.loads(sys.argv[2])[name]], answer)
        os._exit(0)
print(json.dumps(found))
"""


def beside_each(
    packages: dict[str, Path], lines: dict[str, tuple[str, ...]], *, folder: Path
) -> dict[str, list[Ended]]:
    """How its command lines ended in the folder of each package; what is imported serves all of them."""
    names = {name: str(package) for name, package in packages.items()}
    found = json.loads(python(ENDED + FORKED, json.dumps(names), json.dumps(lines), folder=folder))
    return {name: [Ended(*end) for end in ends] for name, ends in found.items()}
