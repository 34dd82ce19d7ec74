"""A fleet of virtual arms with three worn ones: are they found, with their joint, and how long does it take.

    python tests/benchmarks/fleet.py --arms 1000 --folder FLEET

Every arm is an ARIA with manufacturing errors of its own, measured with 30 poses by a 6D tracker on four
days. In three of them a joint wears: one slips, one drifts, one slips between the same days. Each measurement
is identified from its file, with one worker, with two, and on a local Dask cluster of two processes.
"""

import argparse
import json
import tempfile
import time
from pathlib import Path

from distributed import LocalCluster

import workbench as wb
from workbench.identification.fleet.report import fleet_json

DATES = ("2026-01-10", "2026-03-14", "2026-06-02", "2026-09-21")
POSES = 30


def worn(arms: int) -> dict[int, tuple[str, tuple[float, ...]]]:
    """Which arm wears in which constant, and how far on each day [rad]."""
    return {
        arms // 7: ("joint3.theta", (0.0, 0.0, 8e-4, 8e-4)),
        arms // 2: ("joint2.theta", (0.0, 2e-4, 4e-4, 6e-4)),
        arms - 2: ("joint5.theta", (0.0, 0.0, 1.5e-3, 1.5e-3)),
    }


def write(folder: Path, arms: int) -> None:
    """Measurements of every arm on every day."""
    nominal, wear = wb.load_robot("aria"), worn(arms)
    for k in range(arms):
        place = folder / f"arm-{k:04d}"
        place.mkdir(parents=True)
        made, _ = wb.measure_poses(nominal, 1, seed=k)
        name, shifts = wear.get(k, ("joint1.theta", (0.0,) * len(DATES)))
        for i, (day, shift) in enumerate(zip(DATES, shifts, strict=True)):
            actual = made.with_values({name: float(made.values((name,))[0]) + shift})
            seed = 10**6 + len(DATES) * k + i
            rows = wb.measure_poses(nominal, POSES, actual=actual, seed=seed)[1]
            wb.write_measurements(rows, place / f"{day}.csv")


def main() -> None:
    options = argparse.ArgumentParser()
    options.add_argument("--arms", type=int, default=1000)
    options.add_argument("--folder", type=Path)
    given = options.parse_args()
    folder = given.folder or Path(tempfile.mkdtemp()) / "fleet"
    if not folder.exists():
        write(folder, given.arms)
    nominal, answers = wb.load_robot("aria"), {}

    def timed(name: str, **where) -> None:
        began = time.perf_counter()
        found = wb.compare_fleet(folder, robot=nominal, **where)
        print(f"{name:20s} {time.perf_counter() - began:7.1f} s   {found.verdict}", flush=True)
        answers[name] = json.dumps(fleet_json(found))
        for arm in found.worn:
            print(f"    {arm.history.arm}: {arm.worst.name} {arm.worst.law} {1e3 * arm.worst.shift:.3f} mrad")

    timed("1 worker", workers=1)
    timed("2 workers", workers=2)
    with LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=None, memory_limit=None
    ) as cluster:
        timed("Dask, 2 processes", scheduler=cluster.scheduler_address)
    print("the same numbers:", len(set(answers.values())) == 1)
    print("as hidden:", {f"arm-{k:04d}": name for k, (name, _) in worn(given.arms).items()})


if __name__ == "__main__":
    main()
