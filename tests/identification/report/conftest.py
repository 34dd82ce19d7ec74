"""Small results that the report's tests share."""

from dataclasses import replace

import numpy as np
import pytest

from workbench import Frame, evaluate, identify, load_robot, measure_poses
from workbench.base.types import Freedom

HOSTILE = "<script>alert('x')</script> & \"quoted\" $\\alpha$"


@pytest.fixture(scope="session")
def result():
    """An arm of hostile name, measured as poses with one wrong and one excluded row."""
    robot = replace(load_robot("aria"), name=HOSTILE)
    _, rows = measure_poses(robot, 30, errors=(5e-3, np.deg2rad(5.0)), seed=1)
    position, exclude = rows.position.copy(), np.zeros(30, bool)
    position[10, 0] += 4e-3
    exclude[3] = True
    reason = np.array(["<b>probe</b>" if e else "" for e in exclude])
    rows = replace(rows, position=position, exclude=exclude, reason=reason, source="a<i>b.csv")
    return identify(robot, rows, algorithms=("ols", "opt2"), set_apart=False)


@pytest.fixture(scope="session")
def points():
    """Points only, base and tool unknown, none held out."""
    free = Frame(free=Freedom.FREE)
    robot = load_robot("ur5").with_frames(base=free, tool=free)
    _, rows = measure_poses(robot, 40, seed=2, instrument="laser-tracker")
    return identify(robot, rows, algorithms=("ols",), held_out=0.0)


@pytest.fixture(scope="session")
def evaluated():
    robot = load_robot("aria")
    _, rows = measure_poses(robot, 12, seed=3)
    return evaluate(robot, rows)
