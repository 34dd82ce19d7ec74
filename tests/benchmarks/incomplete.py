"""Diagnose virtual arms of which the file doesn't tell all, and count what was called certain and isn't true.

    python tests/benchmarks/incomplete.py --arms 32                           # tuning seeds
    python tests/benchmarks/incomplete.py --seeds judging --arms 1000 --check
    python tests/benchmarks/incomplete.py --gaps one-mass,lift --wrong

Every seed draws one of `GAPS`, what is hidden (any kind of `tests/diagnosis/cases.py`, laws that the
catalogue lacks among them), the morphology, 60 to 120 rows, whether base and tool are known and whether
orientations are measured. Claims are judged as `tests/diagnosis/judge.py` does; a step is true if its row is
within `NEAR`, a gravity that stands otherwise if the saved one is twice as near to the truth as the file's.
Results on judging seeds must change nothing in the program.
"""

import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import beside  # noqa: F401
import lift
import numpy as np
from arms import UnseenError
from calibration import bins, expected_error
from cases import CASES, Case, Named
from claims import Claim, claims
from conditions import CONDITIONS, Conditions, under
from generator import four, rotation
from judge import false_names
from morphologies import MORPHOLOGIES
from options import run_options
from scipy.stats import beta

from workbench import Dataset, Diagnosis, Robot, diagnose, load_robot, read_measurements
from workbench.base.errors import DataError

NEAR = 2
"""Fitted rows by which the row of an event may be off."""
ROWS = (60, 80, 100, 120)
OFF_LEVEL, TILTED = 10e-3, float(np.deg2rad(3.0))
"""By how much gravity may be off [rad]."""
SET_UP = 0.05
"""How far another set-up of the instrument is off [m], and turned [rad], per axis at most."""
ROUNDED = float(np.deg2rad(0.01)), 1e-4
"""Last digit of joint readings [rad] and of measured positions [m]."""
KINDS = tuple(k for k in CASES if not k.startswith("misseated"))
RIGHT_WITHIN = 3.0
"""Standard errors within which a size is right."""
CALIBRATED = 0.03
"""By how much stated odds may be off."""

Change = Callable[[Case, np.random.Generator], Case]


@dataclass(frozen=True)
class Gap:
    """What a file doesn't tell.

    Args:
        change: What it makes of a case.
        met: What else is met.
    """

    change: Change = lambda case, rng: case
    met: Conditions = CONDITIONS["ideal"]


def _without_masses(count: int | None) -> Change:
    def change(case, rng):
        links = rng.permutation(case.robot.dof)[:count]
        joints = tuple(replace(j, mass=None) if k in links else j for k, j in enumerate(case.robot.joints))
        soft = {n.joints for n in (*case.truth, *case.allowed) if n.name == "joint-compliance"}
        sags = tuple(Named("gravity-sag", j) for j in soft if count is None)
        return replace(case, robot=replace(case.robot, joints=joints), allowed=(*case.allowed, *sags))

    return change


def _standing(angle: float) -> Change:
    def change(case, rng):
        heading = rng.uniform(0.0, 2.0 * np.pi)
        turned = rotation(angle * np.array([np.cos(heading), np.sin(heading), 0.0])) @ case.robot.gravity
        return replace(case, robot=case.robot.under(turned))

    return change


def _without(*columns: str) -> Change:
    return lambda case, rng: replace(case, data=replace(case.data, **dict.fromkeys(columns)))


def _shuffled(case, rng):
    data = case.data.take(rng.permutation(len(case.data)))
    return replace(case, data=replace(data, time=None, direction=None, row=np.arange(len(data))))


def _set_up_again(case, rng):
    """Two set-ups of the instrument in one file, without a column of sessions."""
    data, row = case.data, int(len(case.data) * rng.uniform(0.3, 0.7))
    moved = four(rotation(SET_UP * rng.uniform(-1, 1, 3)), SET_UP * rng.uniform(-1, 1, 3))
    position = data.position.copy()
    position[row:] = position[row:] @ moved[:3, :3].T + moved[:3, 3]
    turned = data.rotation
    if turned is not None:
        turned = turned.copy()
        turned[row:] = moved[:3, :3] @ turned[row:]
    step = Named("frame-step", (), row)
    return replace(case, data=replace(data, position=position, rotation=turned), truth=(*case.truth, step))


def _rounded(case, rng):
    angle, length = ROUNDED
    data = case.data
    q = np.where(case.actual.sliding, data.q, angle * np.round(data.q / angle))
    return replace(case, data=replace(data, q=q, position=length * np.round(data.position / length)))


GAPS = {
    "one-mass": Gap(_without_masses(1)),
    "no-masses": Gap(_without_masses(None)),
    "masses30": Gap(met=Conditions(masses=0.3, coms=0.01)),
    "gravity": Gap(_standing(OFF_LEVEL)),
    "tilted": Gap(_standing(TILTED)),
    "tails": Gap(met=Conditions(tails=3.0)),
    "understated": Gap(met=Conditions(stated=1 / 3)),
    "uneven": Gap(met=Conditions(stated=0.1, spread=0.7)),
    "readings": Gap(met=Conditions(joint_noise=2e-4)),
    "rounded": Gap(_rounded),
    "no-time": Gap(_without("time")),
    "no-temperature": Gap(_without("temperature")),
    "no-payload": Gap(_without("payload")),
    "shuffled": Gap(_shuffled),
    "no-session": Gap(_set_up_again),
    "lift": Gap(),
}
"""Gaps by name; the last has arms of its own (`tests/diagnosis/lift.py`)."""


def draw(gap: str, seed: int) -> Case:
    """An arm whose file has a gap."""
    rng = np.random.default_rng([seed, 33])
    kind, arms = str(rng.choice(KINDS)), list(rng.permutation(list(MORPHOLOGIES)))
    given = replace(
        GAPS[gap].met, poses=int(rng.choice(ROWS)), point=bool(rng.integers(2)), free=bool(rng.integers(2))
    )
    for arm in arms:
        try:
            return GAPS[gap].change(under(given, kind, seed, str(arm)), rng)
        except UnseenError:
            continue
    raise UnseenError(f"no morphology can show {kind}")


def judge(gap: str, seed: int) -> dict:
    """Diagnose one arm: what is claimed of it, with its probability and whether it is true."""
    if gap == "lift":
        return _judge_lift(seed)
    case = draw(gap, seed)
    facts = {"arm": case.arm, "kind": case.kind, "rows": len(case.data), "free": case.robot.base.free}
    facts["point"] = case.data.rotation is None
    return facts | _claimed(case.robot, case.data, lambda result, *about: _is_true(case, result, *about))


def _is_true(case: Case, result: Diagnosis, claim: Claim, cause) -> bool:
    if cause.kind == "gravity-direction":
        off = [
            np.arccos(np.clip(g @ case.actual.gravity / 9.81**2, -1.0, 1.0))
            for g in (result.calibrated.gravity, case.robot.gravity)
        ]
        return bool(2.0 * off[0] < off[1])
    if cause.kind == "frame-step":
        fitted = np.sort(result.after_fit.problem.data.row)  # held-out rows lie between those that are named
        true = [t.detail for t in case.truth if t.name == cause.kind]
        return any(abs(np.diff(np.searchsorted(fitted, [row, cause.row]))[0]) <= NEAR for row in true)
    return not false_names(case, claim)


def drawn_lift(seed: int) -> tuple[Robot, Dataset, lift.Truth, dict]:
    """An arm on a lift that lacks a mass, or all, with or without inclinometers, what is true, and facts."""
    rng = np.random.default_rng([seed, 33])
    actual = lift.draw(rng, scale=float(rng.choice([0.0, 5.7e-4])), off_level=float(rng.uniform(0, 0.012)))
    columns = lift.measure(actual, rng, rows=int(rng.choice(ROWS)))
    tilted, masses, lost = bool(rng.integers(2)), bool(rng.random() < 0.8), int(rng.integers(8))
    if not tilted:
        columns = {name: v for name, v in columns.items() if not name.startswith("tilt")}
    with tempfile.TemporaryDirectory() as folder:
        paths = Path(folder) / "robot.toml", Path(folder) / "rows.csv"
        for path, text in zip(paths, (lift.file(lost, masses), lift.table(columns)), strict=True):
            path.write_text(text, encoding="utf-8")
        robot, data = load_robot(paths[0]), read_measurements(paths[1])
    facts = {"arm": "lift", "kind": f"lost {lost if masses else 'all'}", "rows": len(data), "tilts": tilted}
    return robot, data, actual, facts


def _judge_lift(seed: int) -> dict:
    robot, data, actual, facts = drawn_lift(seed)
    true = {("extension-compliance", 0), ("extension-clearance", 0), ("gravity-direction", None)}
    true |= {("joint-compliance", j) for j in range(1, 7)} | {("gravity-sag", j) for j in range(1, 7)}
    # the carriage tips behind the slide: the root of its link, and the bearing of the joint that it carries
    true |= {("link-flexure", 0), ("bearing-compliance", 1)}
    true |= {("encoder-scale", 3)} if actual.scale else set()

    def is_true(result, claim, cause):
        guide = {("bearing-compliance", 0)} if _tips_by(result, actual.tipping[0]) else set()
        return cause.confidence == "cannot tell" or (true | guide).issuperset(
            (cause.kind, j) for j in cause.joints or (None,)
        )

    return facts | _claimed(robot, data, is_true)


def _tips_by(result: Diagnosis, actual: float) -> bool:
    """Whether the slide's guide is found to tip by what the carriage does where it is retracted."""
    return any(
        abs(c - actual) < RIGHT_WITHIN * std
        for a in result.effects
        if a.effect.name == "bearing-compliance"
        for j, c, std in zip(a.effect.joints, a.effect.coefficients, a.std, strict=True)
        if j == 0
    )


def _claimed(robot, data, is_true) -> dict:
    began = time.process_time()
    try:
        output = diagnose(robot, data)
    except DataError as error:
        return {"claims": [], "message": str(error), "failed": True, "seconds": 0.0}
    seconds = time.process_time() - began
    return {
        "claims": [
            (f"{c.label} {c.sentence}", str(c.confidence), claim.probability, is_true(output, claim, c))
            for claim, c in zip(claims(output), output.causes, strict=True)
        ],
        "message": output.message,
        "seconds": seconds,
    }


def upper(count: int, whole: int) -> float:
    """One-sided 95 % bound of a share that was counted (Clopper and Pearson)."""
    return 1.0 if count >= whole else float(beta.ppf(0.95, count + 1, whole - count))


def main(arguments=None):
    given = run_options(__doc__.splitlines()[0], "gaps", GAPS, arms=32, arguments=arguments)
    wanted = [(given.kinds[seed % len(given.kinds)], seed) for seed in given.seeds]
    records = {(gap, seed): judge(gap, seed) for gap, seed in wanted}
    for name in (*given.kinds, "all"):
        found = [r for (gap, _), r in records.items() if name in (gap, "all")]
        certain = [any(c[1] == "certain" and not c[3] for c in r["claims"]) for r in found]
        probable = sum(any(c[1] == "probable" and not c[3] for c in r["claims"]) for r in found)
        true = sum(any(c[1] == "certain" and c[3] for c in r["claims"]) for r in found)
        seconds = float(np.median([r["seconds"] for r in found])) if found else np.nan
        print(
            f"{name:15} {len(found):4} arms  certain and true {true:4}, and false {sum(certain):2} "
            f"(≤ {100 * upper(sum(certain), len(found)):.2f} %)  probable and false {probable:3}  "
            f"{seconds:.2f} s"
        )
    if given.wrong:
        for (gap, seed), r in records.items():
            for label, confidence, p, _ in (c for c in r["claims"] if not c[3]):
                print(f"  {seed} {gap} {r['kind']} {r['arm']}: {label} ({confidence}, {p:.4f})")
    stated = bins([(p, true) for r in records.values() for _, _, p, true in r["claims"] if np.isfinite(p)])
    for b in stated:
        print(f"  stated {100 * b.stated:.2f} %, true {b.true} of {b.claims} ({100 * b.kept:.1f} %)")
    error = expected_error(stated)
    print(f"  expected calibration error {100 * error:.1f} %")
    return int(given.check and (any(certain) or error > CALIBRATED))


if __name__ == "__main__":
    sys.exit(main())
