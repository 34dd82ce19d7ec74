"""Golden numbers: what the program finds, recorded once and compared after every change.

    python tests/benchmarks/golden.py compare tests/benchmarks/golden.json quick       # under three minutes
    python tests/benchmarks/golden.py compare tests/benchmarks/golden.json             # everything: an hour
    python tests/benchmarks/golden.py record new.json identify/ur5 judging plate

A part is named in full, by what stands before its `/`, or as one of the group `quick`; without names all run.
Recording replaces the parts that run and keeps the others. Comparing prints every number that differs, by how
much, and each part's time beside the recorded one; times are not compared. The exit status is 1 if anything
differs. Parts of real arms need `../shared/data`. Numbers keep 12 digits; `TOLERANCES` says what may differ.
"""

import argparse
import json
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import beside
import numpy as np
from real_arms import SETS, load, splits

from workbench import diagnose, identify, load_plate, load_robot, optimise_plate
from workbench.plate.observability import INDICES
from workbench.session import Session, start
from workbench.session.commands.drag import GrabTarget

DIGITS = 12
RELATIVE, ABSOLUTE = 1e-9, 1e-12
TOLERANCES = {"files": 1e-6}
"""Relative, by part or what stands before its `/`: files state their constants in ten digits."""
FILE_SETS, FILE_ROWS = ("ur10", "ur5", "wam", "panda_3", "iiwa14"), 250
JUDGED, FIRST_SEED = 60, 1_000_000
"""Virtual arms that are judged, and the first of their seeds: those for judging."""
Numbers = dict[str, Any]


def identified(name: str) -> Numbers:
    """Held-out errors of five folds, geometry alone, and the constants of the first."""
    robot, data = load(beside.DATA, name)
    out: Numbers = {}
    for k, (train, held) in enumerate(splits(data)):
        run = identify(robot, train, held_out=held, algorithms=("opt2",))
        for stage, rows in (("nominal", run.nominal.held_out), ("geometry", run.best.held_out)):
            out[f"fold {k}, {stage}"] = [1e3 * rows.position.mean(), np.rad2deg(rows.rotation.mean())]
        if k == 0:
            out["constants"] = dict(zip(run.best.fit.problem.names, run.best.fit.x, strict=True))
            out["unidentifiable"] = list(run.unidentifiable)
    return out


def diagnosed(name: str) -> Numbers:
    """The same with the effects found, and these."""
    from real_diagnosis import one

    robot, data = load(beside.DATA, name)
    keys = ("position", "turned", "rows", "causes", "map_mm", "verdict", "joint_noise")
    parts = [one(robot, train, held) for train, held in splits(data)]
    return {f"fold {k}": {key: getattr(part, key) for key in keys} for k, part in enumerate(parts)}


def peers() -> Numbers:
    """Our errors on the task that `run.py` gives to all packages."""
    import task
    import worker_workbench

    arrays = task.make(1, 100, 200)
    report = worker_workbench.body(arrays, None, 1)
    out: Numbers = {"seconds a pose with Jacobian": 1.0 / report["rates"][0]["poses_per_second"]}
    for path in report["paths"]:
        for arm, entry in path["arms"].items():
            errors = task.errors(entry["predicted"], arrays[f"{arm}_held_out"])
            found = {"mm, deg": errors, "evaluations": entry["evaluations"], "seconds": min(entry["seconds"])}
            out[f"{path['name']}, {arm}"] = found
    return out


def aria(arms: int) -> Numbers:
    """`workbench reproduce aria`."""
    from studies.aria import reproduce_aria

    found = reproduce_aria(arms=arms)
    return {
        "findings": {f"{f.where}: {f.what}": [f.here, str(f.verdict)] for f in found.findings},
        "measured": {c.acquisition.title: np.nanmedian(c.own_position, axis=0) for c in found.noisy},
        "region": {c.acquisition.title: np.nanmedian(c.region, axis=0) for c in found.noisy},
        "clustering": [found.clustering.best.o, found.clustering.best.cubes],
    }


def katana(arms: int, weighed: int) -> Numbers:
    """`workbench reproduce katana`."""
    from studies.katana import reproduce_katana

    found = reproduce_katana(arms=arms, weighed=weighed)
    return {
        "findings": {f"{f.where}: {f.what}": [f.here, str(f.verdict)] for f in found.findings},
        **{key: np.median(getattr(found, key).held_out, axis=0) for key in ("once", "twice", "as_bad")},
        "influence": found.influences.mean,
    }


def judging(count: int) -> Numbers:
    """Claims and odds of virtual arms: each kind of case, then some of them under every condition."""
    from arms import UnseenError, make
    from cases import CASES
    from claims import claims
    from conditions import CONDITIONS, under
    from judge import error_of
    from morphologies import MORPHOLOGIES

    kinds, met, shapes = list(CASES), list(CONDITIONS)[1:], list(MORPHOLOGIES)
    out: Numbers = {}
    for k in range(0, JUDGED, JUDGED // count):
        given = kinds[k % len(kinds)], FIRST_SEED + k, shapes[k % len(shapes)]
        condition = CONDITIONS[met[(k - len(kinds)) % len(met)]]
        try:
            case = make(*given) if k < len(kinds) else under(condition, *given)
        except UnseenError:  # a kind that its arm can't show
            continue
        result = diagnose(case.robot, case.data, held_out=0.0)
        found = {"verdict": str(result.verdict), "error": error_of(result.calibrated, case)}
        for claim in claims(result):
            words = (" ".join(map(str, (n.name, *n.joints, n.detail or ""))) for n in claim.names)
            found[f"{' + '.join(words)}, {claim.confidence}"] = claim.probability
        out[f"{k} {case.kind} {case.arm}"] = found
    return out


def table2() -> Session:
    return start(load_robot("aria"), load_plate("table2"))


def shown(session: Session) -> Numbers:
    """What the page shows of a plate: every index, the predicted error, the worst constants."""
    score = session.score
    keys = ("per_target", "rank", "position", "rotation", "rises")
    indices, found = {name: score.indices[name] for name in INDICES}, score.linearisation
    errors = np.sqrt(np.diag(found.covariance))
    errors = np.where((found.unidentifiable**2).sum(1) > 1e-6, np.inf, errors)
    worst = np.argsort(-errors / found.weights, kind="stable")[:3]
    out = {
        "parameters": score.visible,
        "indices": indices,
        "worst": {found.names[i]: errors[i] for i in worst},
    }
    return {key: getattr(score, key) for key in keys} | out


def improve() -> Numbers:
    """What the page's Improve makes of Table 2."""
    session = table2()
    sigma = session.noise.position, session.noise.rotation
    made = session.plate.production
    design = optimise_plate(session.robot, session.plate, production=made, sigma=sigma, moves=True)
    keys = ("cost", "rotation", "start_cost", "clearance", "limit_margin", "spacing")
    poses = np.array([target.pose[:3, 3] for target in design.plate.targets])
    return {key: getattr(design, key) for key in keys} | {"targets": poses, "outcome": str(design.outcome)}


def files(name: str) -> Numbers:
    """Errors of saved arms by their files alone, other code reading them: geometry, then with effects."""
    import round_trip

    robot, data = load(beside.DATA, name)
    rows = np.arange(0, len(data), -(-len(data) // FILE_ROWS))
    read = round_trip.read_rows(beside.DATA / SETS[name][0] / "measurements.csv").take(data.row[rows])
    if data.direction is not None:
        read = replace(read, direction=data.direction[rows])
    out: Numbers = {}
    with tempfile.TemporaryDirectory() as folder:
        for verb in (identify, diagnose):
            calibrated = verb(robot, data.take(rows), held_out=0.0).robot
            for ending in ("toml", "urdf"):
                path = Path(folder) / f"arm.{ending}"
                calibrated.save(path)
                found = round_trip.errors(round_trip.read_arm(path), read)
                out[f"{verb.__name__}, {ending}"] = [1e3 * found.position, np.rad2deg(found.rotation)]
    return out


def drag() -> Numbers:
    """300 steps of a drag of Table 2's first target: the score at every fiftieth."""
    from drag import moves

    first = table2()
    session, out, times = GrabTarget(0, client=1).apply(first), {}, []
    for k, move in enumerate(moves(first)):
        begin = time.perf_counter()
        move.check(session)
        session = move.apply(session)
        times.append(time.perf_counter() - begin)
        if k % 50 == 49:
            out[f"step {k + 1}"] = shown(session)
    return {**out, "seconds": float(np.median(times))}


PARTS: dict[str, Callable[[], Numbers]] = {
    "plate/score": lambda: shown(table2()),
    "plate/improve": improve,
    "drag": drag,
    "peers": peers,
    "judging-few": partial(judging, 12),
    "judging": partial(judging, JUDGED),
    **{f"identify/{name}": partial(identified, name) for name in reversed(SETS)},
    **{f"files/{name}": partial(files, name) for name in reversed(FILE_SETS)},
    "aria-few": partial(aria, 2),
    "aria": partial(aria, 100),
    "katana": partial(katana, 40, 200),
    **{f"diagnose/{name}": partial(diagnosed, name) for name in reversed(SETS)},
}
QUICK = ("plate/score", "drag", "peers", "judging-few", "identify/ur5", "identify/wam", "identify/iiwa14",
         "files/iiwa14", "aria-few")  # fmt: skip


def leaves(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Numbers and words by their place."""
    if isinstance(value, dict | list):
        entries = value.items() if isinstance(value, dict) else enumerate(value)
        for key, inner in entries:
            yield from leaves(inner, f"{path} · {key}" if path else str(key))
    else:
        yield path, value


def plain(value: Any) -> Any:
    """As JSON keeps it, in `DIGITS` digits."""
    if isinstance(value, dict):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple | np.ndarray):
        return [plain(v) for v in value]
    if isinstance(value, float | np.floating):
        return float(f"{value:.{DIGITS}g}") if np.isfinite(value) else str(value)
    return value.item() if isinstance(value, np.generic) else value


def differences(part: str, old: Numbers, new: Numbers) -> Iterator[str]:
    """What is not as it was."""
    relative = TOLERANCES.get(part, TOLERANCES.get(part.partition("/")[0], RELATIVE))
    before, after = dict(leaves(old)), dict(leaves(new))
    for place in dict.fromkeys((*before, *after)):
        if place not in before or place not in after:
            yield f"{place}: " + (f"new, {after[place]}" if place in after else f"gone, was {before[place]}")
            continue
        a, b = before[place], after[place]
        if place.rpartition(" · ")[2].startswith("seconds") or a == b:
            continue
        if isinstance(a, float | int) and isinstance(b, float | int):
            by = abs(b - a)
            if by > ABSOLUTE + relative * max(abs(a), abs(b)):
                yield f"{place}: {a} → {b} (by {by:.3g}, relative {by / max(abs(a), abs(b)):.3g})"
        else:
            yield f"{place}: {a!r} → {b!r}"


def chosen(names: list[str]) -> list[str]:
    """Parts by their names or those of their groups."""
    found: dict[str, None] = {}
    for name in names or PARTS:
        parts = QUICK if name == "quick" else [p for p in PARTS if name in (p, p.partition("/")[0])]
        if not parts:
            sys.exit(f"no part '{name}'; choose from quick, {', '.join(PARTS)}")
        found |= dict.fromkeys(parts)
    return list(found)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("do", choices=("record", "compare"))
    parser.add_argument("file", type=Path)
    parser.add_argument("parts", nargs="*", help=f"quick, {', '.join(PARTS)}")
    given = parser.parse_args()
    known = json.loads(given.file.read_text()) if given.file.exists() else {}
    differing = 0
    for part in chosen(given.parts):
        began = time.perf_counter()
        try:
            numbers = plain(PARTS[part]())
        except Exception as error:  # such as what a part imports has moved: the others are still compared
            numbers = {"failed": f"{type(error).__name__}: {error}"}
        seconds = round(time.perf_counter() - began, 1)
        old = known.get(part, {"seconds": None, "numbers": {}})
        print(f"{part}: {seconds} s, recorded {old['seconds']} s", flush=True)
        if given.do == "record" and "failed" not in numbers:
            known = json.loads(given.file.read_text()) if given.file.exists() else {}  # of a run beside this
            known[part] = {"seconds": seconds, "numbers": numbers}
            given.file.write_text(json.dumps(known, ensure_ascii=False, indent=0) + "\n")
            continue
        lines = list(differences(part, old["numbers"], numbers))
        print("".join(f"    {line}\n" for line in lines) or "    the same\n", end="", flush=True)
        differing += len(lines)
    print(f"{differing} numbers differ")
    return int(differing > 0)


if __name__ == "__main__":
    sys.exit(main())
