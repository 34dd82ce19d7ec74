"""Power of the tests: a wing is broken at random places, one by one, and its own tests must notice.

    python tests/benchmarks/mutations.py extras/camera --breaks 30         # in a copy of the tree; minutes
    python tests/benchmarks/mutations.py arm/effects --tests arm diagnosis --seed 2

A break swaps an operator or a comparison, drops a sign, or changes a number. The exit status is the number of
breaks that nothing caught; the share that is caught must not fall when tests end.
"""

import argparse
import ast
import os
import random
import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

ROOT = Path(__file__).resolve().parents[2]
COPIED = ("workbench", "tests", "assets", "recordings", "pyproject.toml", "README.md")
PAIRS = (
    *((ast.Add, ast.Sub), (ast.Mult, ast.Div), (ast.BitAnd, ast.BitOr), (ast.And, ast.Or)),
    *((ast.Lt, ast.GtE), (ast.Gt, ast.LtE), (ast.Eq, ast.NotEq), (ast.Is, ast.IsNot), (ast.In, ast.NotIn)),
)
SWAPPED = dict(PAIRS) | {other: one for one, other in PAIRS}


def change(node: ast.AST) -> bool:
    """Break a part of an expression; False for what is left as it is."""
    if isinstance(node, ast.BinOp | ast.BoolOp) and type(node.op) in SWAPPED:
        node.op = SWAPPED[type(node.op)]()
    elif isinstance(node, ast.Compare) and type(node.ops[0]) in SWAPPED:
        node.ops[0] = SWAPPED[type(node.ops[0])]()
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        node.op = ast.UAdd()
    elif isinstance(node, ast.Constant) and type(node.value) in (int, float):
        node.value = node.value + 1 if type(node.value) is int else 1.5 * node.value + 0.1
    else:
        return False
    return True


def broken(path: Path, rng: random.Random) -> tuple[str, str]:
    """What was done to a file, and its text then; nothing is done to one without a formula in a function."""
    tree = ast.parse(source := path.read_text(encoding="utf-8"))
    functions = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
    places = [node for function in functions for line in function.body for node in ast.walk(line)]
    rng.shuffle(places)
    for node in places:
        if hasattr(node, "lineno") and change(node):
            return f"{node.lineno} → {ast.unparse(node)[:70]}", ast.unparse(tree)
    return "", source


def fails(tree: Path, tests: list[str]) -> bool:
    """Whether these tests of a copy notice anything."""
    command = [sys.executable, "-m", "pytest", "-q", "-x", "-n", "0", "-p", "no:cacheprovider"]
    command += ["-m", "not slow and not data and not browser", *(f"tests/{name}" for name in tests)]
    paths = os.pathsep.join([str(tree), str(tree / "tests")])
    environment = os.environ | {"PYTHONPATH": paths, "OPENBLAS_NUM_THREADS": "1"}
    return (
        subprocess.run(command, cwd=tree, env=environment, capture_output=True, check=False).returncode != 0
    )


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("wing", help="a folder or file of the package, such as arm/effects")
    parser.add_argument("--tests", nargs="+", help="folders or files of the tests; default: the wing's own")
    parser.add_argument("--breaks", type=int, default=30)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    rng, missed, tests = random.Random(given.seed), 0, given.tests or [given.wing]
    with TemporaryDirectory() as folder:
        tree = Path(folder)
        for path in map(ROOT.joinpath, COPIED):
            (shutil.copytree if path.is_dir() else shutil.copy2)(path, tree / path.name)
        if fails(tree, tests):
            raise SystemExit("the tests fail on the tree as it is")
        wing = tree / "workbench" / given.wing
        files = [wing] if wing.is_file() else sorted(wing.rglob("*.py"))
        for _ in range(given.breaks):
            said = ""
            while not said:
                said, text = broken(path := rng.choice(files), rng)
            whole, times = path.read_bytes(), path.stat()
            path.write_text(text, encoding="utf-8")
            caught = fails(tree, tests)
            path.write_bytes(whole)
            os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))  # what is compiled stays so
            missed += not caught
            name = path.relative_to(tree / "workbench")
            print(f"{'caught' if caught else 'NOT CAUGHT':10s} {name}:{said}", flush=True)
    print(f"{given.breaks - missed} of {given.breaks} caught")
    return missed


if __name__ == "__main__":
    sys.exit(main())
