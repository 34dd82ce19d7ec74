"""Find clearance and backlash of Katana arms blind from 118 poses, over many arms, and print how well.

    python tests/benchmarks/tilting.py --seeds 0:30
    python tests/benchmarks/tilting.py --seeds 100:130 --loading 3       # inclinometers, 3 kg at the tool

Arms are those of `tests/diagnosis/katanas.py`, each joint up to 30 % off Tables 4.3 and 4.4. The bound is the
Cramér–Rao bound of the linearised problem at the sizes that are hidden.
"""

import argparse
import os
import sys
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
TESTS = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TESTS.parent), str(TESTS), str(TESTS / "diagnosis")]

import numpy as np
from katanas import METER, SIGMA, inclined, make_katana
from rich.console import Console
from rich.progress import track
from rich.table import Column, Table

from workbench.arm.effects import EFFECTS
from workbench.diagnosis.diagnose import diagnose
from workbench.extras.katana.load_test.experiment import tilting_of
from workbench.extras.katana.load_test.postures import plan_load_test
from workbench.extras.katana.load_test.tolerance import with_centre_tolerance
from workbench.identification.problem import Noise, Problem
from workbench.identification.undetermined_combinations import factorise


def from_poses(seed):
    """Sizes and standard errors by name, the hidden sizes, and the bounds."""
    case = make_katana(seed)
    result = diagnose(case.robot, case.data, held_out=0.0)
    found = {}
    for effect, std in ((e.effect, e.std) for e in result.effects):
        found |= zip(effect.names, zip(effect.coefficients, std, strict=True), strict=True)
    return found, case.sizes, bounds(case)


def bounds(case):
    """Least standard errors that any unbiased estimate of all sizes and the geometry can have."""
    kinds = dict.fromkeys(e.name for e in case.hidden)
    effects = [
        EFFECTS[kind](tuple(e.joints[0] for e in mine), tuple(e.size[0] for e in mine))
        for kind in kinds
        for mine in [[e for e in case.hidden if e.name == kind]]
    ]
    names = [n for e in effects for n in e.names]
    problem = Problem.build(case.robot.with_effects(*effects), case.data, noise=Noise(*SIGMA), effects=names)
    jacobian = problem.jacobian(problem.start)
    spread = factorise(jacobian, np.zeros(len(jacobian)), problem.units).covariance()
    std = dict(zip(problem.names, np.sqrt(np.diag(spread)).tolist(), strict=True))
    return {n: std[n] for n in names}


def from_tilts(seed, mass):
    """The same from inclinometers with a mass at the tool."""
    case, rng = make_katana(seed), np.random.default_rng(seed)
    robot = with_centre_tolerance(case.robot)
    plan = plan_load_test(robot, added_mass=mass, rng=rng)
    data = inclined(case.actual, case.hidden, plan, rng)
    joints = tilting_of(robot, plan, data, instrument=METER).joints
    found = {
        f"joint{j.joint + 1}.{part}": (getattr(j, part), getattr(j, f"{part}_std"))
        for j in joints
        for part in ("clearance", "backlash", "compliance")
    }
    return found, case.sizes, {}


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", default="0:30", help="first and end, a colon between")
    parser.add_argument(
        "--loading", type=float, help="inclinometers instead, with this mass at the tool [kg]"
    )
    given = parser.parse_args(arguments)
    first, end = (int(s) for s in given.seeds.split(":"))
    try_one = from_poses if given.loading is None else lambda seed: from_tilts(seed, given.loading)
    results = [try_one(s) for s in track(range(first, end), console=Console(stderr=True))]
    table = Table(
        Column("size", no_wrap=True),
        "found",
        "worst error",
        "rms error",
        "z mean",
        "z rms",
        "bound",
        title="errors",
    )
    for name in results[0][1]:
        pairs = [(f[name], sizes[name]) for f, sizes, _ in results if name in f]
        if not pairs:
            table.add_row(name, f"0 of {len(results)}")
            continue
        off = np.array([value / wanted - 1.0 for (value, _), wanted in pairs])
        z = np.array([(value - wanted) / std for (value, std), wanted in pairs])
        minimum = [b[name] / sizes[name] for _, sizes, b in results if name in b]
        cells = [f"{100 * v:.1f} %" for v in (np.abs(off).max(), np.sqrt((off**2).mean()))]
        cells += [f"{z.mean():+.2f}", f"{np.sqrt((z**2).mean()):.2f}"]
        table.add_row(
            name,
            f"{len(pairs)} of {len(results)}",
            *cells,
            f"{100 * np.mean(minimum):.1f} %" if minimum else "",
        )
    Console().print(table)


if __name__ == "__main__":
    main()
