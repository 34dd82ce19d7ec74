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
