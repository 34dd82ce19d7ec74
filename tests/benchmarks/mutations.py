"""Power of the tests: formulas and rules are broken one by one, and the tests named for each must fail.

    python tests/benchmarks/mutations.py                # all, in copies of the tree; minutes
    python tests/benchmarks/mutations.py backlash 12    # those whose file or number matches

First all named tests are run on the tree as it is: they must pass. The exit status is the number of breaks
that nothing caught, and of those whose text is no longer in the file.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
COPIED = ("workbench", "tests", "assets", "pyproject.toml", "README.md")


class Mutation(NamedTuple):
    """One break: in a file of the package a text becomes another, which tests (folder/name) must notice."""

    file: str
    text: str
    broken: str
    tests: str


MUTATIONS = tuple(
    Mutation(*parts)
    for parts in (
        ("base/se3.py", "np.eye(3) - 0.5 * cross", "np.eye(3) + 0.5 * cross", "base/se3"),
        ("base/se3.py", "np.linalg.det(u) * np.linalg.det(vt)", "1.0", "base/se3"),
        ("arm/chain.py", "= ay * rz - az * ry", "= ay * rz + az * ry", "arm/chain"),
        ("arm/conventions.py", '("alpha", "beta", "a", ', '("alpha", "a", "beta", ', "arm/conventions"),
        ("arm/conventions.py", "np.sin(twist)) < P", "np.sin(twist)) > P", "arm/conventions"),
        ("arm/statics/wrenches.py", "[3] += y * w - z * v", "[3] += y * w + z * v", "arm/statics"),
        ("arm/effects/joint_compliance.py", "diagonal(-own(", "diagonal(own(", "arm/effects"),
        ("arm/effects/backlash.py", "(-np.sign(motion", "(np.sign(motion", "diagnosis/arms"),
        ("arm/effects/clearance_tilt.py", "paired(-direct", "paired(direct", "arm/effects"),
        ("arm/effects/thermal_growth.py", "name) - self.ref", "name) + self.ref", "arm/effects"),
        ("arm/effects/valid_range.py", "(FADING_KNOTS * self", "(0.1 * self", "arm/effects"),
        ("arm/urdf_writer.py", "(name, first) if", "(first, name) if", "arm/urdf"),
        ("data/directions.py", "prepend=-1))] = 0.0", "prepend=-1))] += 0.0", "data/directions"),
        ("data/accuracy_requirement.py", "2.0 * float(np.arc", "1.0 * float(np.arc", "data/requirement"),
        ("data/readers/orientation.py", "NORM_TOLERANCE = 0.02", "NORM_TOLERANCE = 2.0", "data/bad_files"),
        ("data/observations/distance.py", "(-direction[", "(direction[", "identification/problem"),
        ("identification/noise.py", "(off**2).sum() / 3.0", "(off**2).sum()", "identification/noise"),
        ("identification/prior.py", "tion - cross @", "tion + cross @", "identification/recovery"),
        (
            "identification/undetermined_combinations.py",
            "] / self.s[self.seen, None]).T",
            "]).T",
            "identification/linear",
        ),
        (
            "identification/errors/expected_deviation.py",
            "growth + np.log(growth)",
            "growth",
            "identification/expected_deviation",
        ),
        (
            "identification/rows/outlying_rows.py",
            "OUTLIER_RATIO = 4.0",
            "OUTLIER_RATIO = 4e3",
            "identification/set_apart",
        ),
        (
            "identification/algorithms/influence_based.py",
            "norm(moves, axis=1)",
            "norm(moves, axis=1) ** 2",
            "identification/influence_based",
        ),
        ("plate/observability.py", "/ (1.0 / s).sum(-1)", "/ (1.0 / s).mean(-1)", "plate/observability"),
        ("plate/tolerances.py", "2.0 / 3.0 * (heights", "1.0 / 3.0 * (heights", "plate/fixture"),
        ("plate/reach_margin.py", "DEVIATIONS = 3.0", "DEVIATIONS = 0.3", "plate/reach_margin"),
        ("plate/optimiser/search.py", "shape[1]) + spread", "shape[1]) - spread", "plate/fixture"),
        ("diagnosis/search/evidence.py", "- 0.5 * rank * np.log", "- rank * np.log", "diagnosis/evidence"),
        ("diagnosis/claims/random_walk.py", "spread / whole + q", "spread + q", "diagnosis/wandering"),
        ("diagnosis/final_fit.py", "SQUARE_RATIO = 1.1", "SQUARE_RATIO = 1e3", "diagnosis/final_fit"),
        ("diagnosis/confidence.py", "1000.0, 20.0", "10.0, 2.0", "diagnosis/causes"),
    )
)


def copied(folder: Path) -> Path:
    """A copy of the tree, with the times of its files: what is compiled stays so."""
    for name in COPIED:
        path = ROOT / name
        (shutil.copytree if path.is_dir() else shutil.copy2)(path, folder / name)
    return folder


def status_of(tree: Path, *tests: str) -> int:
    """How pytest ends on some tests in a copy: 0 where all pass."""
    paths = os.pathsep.join([str(tree), str(tree / "tests")])
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "-x",
        "-n",
        "0",
        "-p",
        "no:cacheprovider",
        "-m",
        "not slow and not data",
    ]
    command += ["tests/{}/test_{}.py".format(*test.split("/")) for test in tests]
    environment = os.environ | {"PYTHONPATH": paths, "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run(command, cwd=tree, env=environment, capture_output=True, text=True, check=False)
    if done.returncode > 2:
        raise SystemExit(done.stdout + done.stderr)
    return done.returncode


def main(wanted: list[str]) -> int:
    """Break every chosen formula, and say what caught it."""
    chosen = [
        (number, m)
        for number, m in enumerate(MUTATIONS, 1)
        if not wanted or any(word == str(number) or word in m.file for word in wanted)
    ]
    with TemporaryDirectory() as folder:
        if status_of(copied(Path(folder)), *dict.fromkeys(m.tests for _, m in chosen)):
            raise SystemExit("the tests fail on the tree as it is")
    missed = 0
    for number, mutation in chosen:
        with TemporaryDirectory() as folder:
            tree = copied(Path(folder))
            path = tree / "workbench" / mutation.file
            source = path.read_text(encoding="utf-8")
            if source.count(mutation.text) != 1:
                said = "its text is not in the file once"
            else:
                path.write_text(source.replace(mutation.text, mutation.broken), encoding="utf-8")
                said = "caught" if status_of(tree, mutation.tests) else "NOT CAUGHT"
        missed += said != "caught"
        print(f"{number:2d} {said:10s} {mutation.file}: {mutation.text}  ({mutation.tests})", flush=True)
    print(f"{len(chosen) - missed} of {len(chosen)} caught")
    return missed


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
