"""Figures of workbench alone, each in a process of its own: `python tests/benchmarks/single_process.py`.

One alone: `single_process.py growth|first|large`.

growth: poses with identification Jacobians block by block, and the greatest memory beyond the input.
first: the very first calls of a process (`NUMBA_CACHE_DIR` says where the compiled code is).
large: 11 911 poses of a 7-joint arm with 40 parameters, base and tool among them.
"""

import json
import resource
import statistics
import subprocess
import sys
import time
from dataclasses import replace
from functools import partial

import numpy as np

from workbench.arm.motion import Motion

ROWS = (1_000, 10_000, 100_000, 1_000_000)
LARGE = 11_911
MEGABYTE = 2**20 if sys.platform == "darwin" else 2**10


def peak():
    """Greatest resident memory so far [MB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / MEGABYTE


def timed(work):
    """Seconds of one call, and its answer."""
    began = time.perf_counter()
    answer = work()
    return time.perf_counter() - began, answer


def middle(*series):
    """Median seconds of each series of timed calls."""
    return [statistics.median(seconds for seconds, _ in calls) for calls in series]


def growth():
    from workbench.arm.built_in_arms import load_robot
    from workbench.arm.kinematics.forward import identification_jacobian

    robot = load_robot("aria")
    rng = np.random.default_rng(0)

    def through(q):
        for start in range(0, len(q), 1024):
            identification_jacobian(robot, Motion(q[start : start + 1024]), robot.default_free)

    through(rng.uniform(-1, 1, (100, robot.dof)))
    report = []
    q = None
    for rows in ROWS:
        del q  # else the last input hides what this one needs
        q = rng.uniform(-1, 1, (rows, robot.dof))
        before = peak()
        seconds = [timed(partial(through, q))[0] for _ in range(max(3, min(50, 10**6 // rows)))]
        report.append({"rows": rows, "seconds": statistics.median(seconds), "beyond_input": peak() - before})
    return report


def first():
    started = time.perf_counter()
    import task
    import worker_workbench as worker

    imported = time.perf_counter() - started
    from workbench.arm.kinematics.forward import identification_jacobian
    from workbench.identification.algorithms.opt2_levenberg_marquardt import Opt2

    robot = worker.nominal()
    arrays = task.make(seed=1, train=100, held_out=1)
    names = worker.between_the_frames(robot)
    data = worker.table(arrays["q"], arrays["plain"])
    jacobian = timed(lambda: identification_jacobian(robot, Motion(data.q)))[0]
    identified = timed(lambda: worker.searched(robot, data, names, Opt2()))[0]
    return {"imports": imported, "jacobian": jacobian, "identification": identified}


def large():
    import worker_workbench as worker

    from workbench.arm.built_in_arms import load_robot
    from workbench.base.types import Freedom
    from workbench.data.simulation.instruments import instrument_named
    from workbench.data.simulation.simulate import simulate, virtual_arm
    from workbench.identification.algorithms.opt2_levenberg_marquardt import Opt2
    from workbench.identification.identify import identify

    robot = load_robot("wam")
    base, tool = (replace(frame, free=Freedom.FREE) for frame in (robot.base, robot.tool))
    robot = robot.with_frames(base=base, tool=tool)
    rng = np.random.default_rng(2)
    actual = virtual_arm(robot, rng=rng, errors=(2e-3, np.deg2rad(0.5)))
    limits = robot.search_limits
    q = rng.uniform(limits[:, 0], limits[:, 1], (LARGE, robot.dof))
    data = simulate(actual, Motion(q), instrument=instrument_named("plate"), rng=rng)
    small = data.take(np.arange(200))
    worker.searched(robot, small, robot.default_free, Opt2())
    identify(robot, small, algorithms=("opt2",))
    searches = [timed(lambda: worker.searched(robot, data, robot.default_free, Opt2())) for _ in range(3)]
    wholes = [timed(lambda: identify(robot, data, algorithms=("opt2",))) for _ in range(3)]
    (search, whole), (problem, found), run = middle(searches, wholes), searches[-1][1], wholes[-1][1]
    all_three = timed(lambda: identify(robot, data))[0]
    return {
        "parameters": len(problem.names),
        "whole_parameters": len(run.best.fit.problem.names),
        "search": search,
        "whole": whole,
        "all_three": all_three,
        "steps": len(found.history) - 1,
        "held_out_mm": run.best.held_out.position_mm.mean,
    }


if __name__ == "__main__":
    parts = {f.__name__: f for f in (growth, first, large)}
    if len(sys.argv) == 2:
        print(json.dumps(parts[sys.argv[1]]()))
    else:
        for part in parts:
            printed = subprocess.check_output([sys.executable, __file__, part], text=True)
            print(part, printed, end="", flush=True)
