"""A fleet of virtual arms with three worn ones: are they found, with their joint, and how long does it take.

    python tests/benchmarks/fleet.py --arms 1000 --folder FLEET

Every arm is an ARIA with manufacturing errors of its own, measured with 30 poses by a 6D tracker on four
days. In three of them a joint wears: one slips, one drifts, one slips between the same days. Each measurement
is identified from its file, with one worker, with two, and on a local Dask cluster of two processes; `--ways`
chooses among these, and the numbers' fingerprint shows whether they are those of another run.
"""

import argparse
import hashlib
import json
import resource
import tempfile
import time
from pathlib import Path

from distributed import LocalCluster

import workbench as wb
from workbench.extras.service.fleet.report import fleet_json

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
    options.add_argument("--ways", nargs="+", choices=("1", "2", "dask"), default=["1", "2", "dask"])
    given = options.parse_args()
    folder = given.folder or Path(tempfile.mkdtemp()) / "fleet"
    if not folder.exists():
        write(folder, given.arms)
    nominal, answers = wb.load_robot("aria"), set()

    def timed(name: str, **where) -> None:
        began, processor = time.perf_counter(), time.process_time()
        found = wb.compare_fleet(folder, robot=nominal, **where)
        seconds = (
            f"{time.perf_counter() - began:7.1f} s, {time.process_time() - processor:6.1f} s of this process"
        )
        fingerprint = hashlib.sha256(json.dumps(fleet_json(found)).encode()).hexdigest()[:12]
        print(f"{name:18s} {seconds}   numbers {fingerprint}   {found.verdict}", flush=True)
        answers.add(fingerprint)
        for arm in found.worn:
            print(f"    {arm.history.arm}: {arm.worst.name} {arm.worst.law} {1e3 * arm.worst.shift:.3f} mrad")

    if "1" in given.ways:
        timed("1 worker", workers=1)
    if "2" in given.ways:
        timed("2 workers", workers=2)
    if "dask" in given.ways:
        with LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=None, memory_limit=None
        ) as cluster:
            timed("Dask, 2 processes", scheduler=cluster.scheduler_address)
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    print(f"processor time of ended workers: {children.ru_utime + children.ru_stime:.1f} s")
    print("the same numbers:", len(answers) == 1)
    print("as hidden:", {f"arm-{k:04d}": name for k, (name, _) in worn(given.arms).items()})


if __name__ == "__main__":
    main()
