"""Time of one drag step on the server, without and with drawing.  Run: python tests/benchmarks/drag.py

One step moves a target: inverse kinematics, all indices of ten targets, predicted error; drawing prepares
and queues every message for the page. Printed in ms: median and 95th percentile of 300 steps.
"""

import time

import numpy as np

from workbench.app.server import App
from workbench.design.plate_toml import load_plate
from workbench.robots import load_robot
from workbench.session import start
from workbench.session.commands import GrabTarget, MoveTarget

STEPS = 300


def steps(session):
    """Moves along a small circle, turning a little."""
    begin = session.plate.targets[0]
    for k in range(STEPS):
        angle = 2.0 * np.pi * k / 60
        x, y = np.cos(angle), np.sin(angle)
        xyz = begin.xyz + np.array([0.04 * x - 0.04, 0.04 * y, 0.04 * x * y])
        rpy = begin.rpy + np.array([0.1 * y, 0.1 * x, 0.0])
        yield MoveTarget(0, tuple(map(float, xyz)), tuple(map(float, rpy)), client=1)


def main() -> None:
    """Print the two lines."""
    begin = time.perf_counter()
    session = start(load_robot("aria"), load_plate("table2"))
    print(f"session start      {1e3 * (time.perf_counter() - begin):8.1f} ms")
    app = App(session.robot, session.plate)
    for words, draw in (("step", lambda s: None), ("step with drawing", app.view.draw)):
        now, times = GrabTarget(0, client=1).apply(session), []
        for move in steps(session):
            begin = time.perf_counter()
            move.check(now)
            now = move.apply(now)
            draw(now)
            times.append(1e3 * (time.perf_counter() - begin))
        print(f"{words:<18} {np.median(times):8.2f} ms   p95 {np.percentile(times, 95):6.2f} ms")
    app.close()


if __name__ == "__main__":
    main()
