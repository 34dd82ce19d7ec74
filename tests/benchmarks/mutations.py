"""Power of the tests: formulas and rules are broken one by one, and the tests named for each must fail.

    python tests/benchmarks/mutations.py                # all, in copies of the tree; minutes
    python tests/benchmarks/mutations.py backlash 12    # those whose file or number matches

First the named tests are run on the tree as it is: they must pass. The exit status is the number of breaks
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
    """A text of the package and what it becomes; and which tests of a file, by a word, must notice."""

    file: str
    text: str
    broken: str
    tests: str


# fmt: off
MUTATIONS = tuple(Mutation(*parts) for parts in (
    ("base/se3.py", "v[b] + 0.5 * v[c], k", "v[b] - 0.5 * v[c], k", "base/se3 left_jacobian"),
    ("base/se3.py", "np.linalg.det(u) * np.linalg.det(vt)", "1.0", "base/se3 mirrored"),
    ("arm/chain.py", "= y * w - z * v, x", "= y * w + z * v, x", "arm/chain twists_are"),
    ("arm/conventions.py", '("alpha", "beta", "a", ', '("alpha", "a", "beta", ',
     "arm/conventions links_multiply"),
    ("arm/conventions.py", "entry.alpha)) < P", "entry.alpha)) > P", "arm/conventions four_constants"),
    ("arm/statics/wrenches.py", "(y * f[2] - z * f[1])", "(y * f[2] + z * f[1])", "arm/statics built_in"),
    ("arm/effects/joint_compliance.py", "diagonal(-own(", "diagonal(own(", "arm/effects load_effects"),
    ("arm/effects/backlash.py", "(-np.sign(motion", "(np.sign(motion", "diagnosis/arms laws_equal"),
    ("arm/effects/tilting.py", "return side, (np", "return -side, (np", "arm/effects clearance_tips"),
    ("arm/effects/thermal_growth.py", "name) - self.ref", "name) + self.ref", "arm/effects thermal"),
    ("arm/effects/valid_range.py", "(FADING_KNOTS * self", "(0.1 * self", "arm/effects fades"),
    ("arm/urdf_writer.py", "(name, first) if", "(first, name) if", "arm/urdf through_urdf"),
    ("data/measuring_order.py", "prepend=data.q[rows[:1]])", "prepend=0.0)", "data/order begins_anew"),
    ("data/accuracy_requirement.py", "2.0 * float(np.arc", "1.0 * float(np.arc",
     "data/requirement papers_angle"),
    ("data/readers/orientation.py", "0.02, _LONG", "2.0, _LONG", "data/bad_files what_is_wrong"),
    ("data/observations/places.py", "(-direction[", "(direction[",
     "identification/problem jacobian_column"),
    ("identification/noise.py", "sum((0, 2)) / 3.0", "sum((0, 2))", "identification/noise repeats"),
    ("identification/prior.py", "tion - cross @", "tion + cross @", "identification/linear knowledge"),
    ("identification/undetermined_combinations.py", "] / self.svd.S[self.seen, None]).T", "]).T",
     "identification/linear covariance"),
    ("identification/errors/expected_deviation.py", "(square) + np.log(growth).sum(1)", "(square)",
     "identification/expected_deviation size_of"),
    ("identification/rows/outlying_rows.py", "OUTLIER_RATIO = 4.0", "OUTLIER_RATIO = 4e3",
     "identification/set_apart one_wrong_row"),
    ("identification/algorithms/influence_based.py", "norm(moves, axis=1)", "norm(moves, axis=1) ** 2",
     "identification/influence_based imposed"),
    ("plate/observability.py", "/ (1.0 / s).sum(-1)", "/ (1.0 / s).mean(-1)",
     "plate/observability hand_worked"),
    ("plate/tolerances.py", "2.0 / 3.0 * (heights", "1.0 / 3.0 * (heights", "plate/fixture tall_blocks"),
    ("plate/reach_margin.py", "DEVIATIONS = 3.0", "DEVIATIONS = 0.3", "plate/reach_margin with_margin"),
    ("plate/optimiser/search.py", "shape[1]) + spread", "shape[1]) - spread", "plate/fixture gains"),
    ("diagnosis/search/evidence.py", "- 0.5 * rank * np.log", "- rank * np.log",
     "diagnosis/evidence free_candidates"),
    ("diagnosis/drivers/process.py", "rate) / rate])", "rate)])", "diagnosis/drivers brownian"),
    ("diagnosis/final_fit.py", "SQUARE_RATIO = 1.1", "SQUARE_RATIO = 1e9", "diagnosis/final_fit let_go"),
    ("diagnosis/confidence.py", "1000.0, 20.0", "10.0, 2.0", "diagnosis/causes words_are_odds"),
))
# fmt: on


def copied(folder: Path) -> Path:
    """A copy of the tree, with the times of its files: what is compiled stays so."""
    for name in COPIED:
        path = ROOT / name
        (shutil.copytree if path.is_dir() else shutil.copy2)(path, folder / name)
    return folder


def status_of(tree: Path, *tests: str) -> int:
    """How pytest ends on some tests in a copy: 0 where all pass."""
    files, words = zip(*(test.split() for test in tests), strict=True)
    command = [sys.executable, "-m", "pytest", "-q", "-x", "-n", "0", "-p", "no:cacheprovider", "-k"]
    command += [" or ".join(words), "-m", "not slow and not data"]
    command += dict.fromkeys("tests/{}/test_{}.py".format(*file.split("/")) for file in files)
    paths = os.pathsep.join([str(tree), str(tree / "tests")])
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
        if status_of(copied(Path(folder)), *(m.tests for _, m in chosen)):
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
