"""Rows about a step of which nothing tells the side are left out, and said to be."""

from dataclasses import replace

import numpy as np
import pytest
from arms import make

from workbench.arm.effects.events import FrameStep
from workbench.arm.motion import Motion
from workbench.identification.identify import identify
from workbench.identification.rows.undecided_rows import MAX_BESIDE_STEP, UNDECIDED

STEP = 60


def stepped(size: float, *, wrong: int = 0):
    """An arm whose frame moved along x by a size before the row `STEP`, which the arm's effect puts some rows
    off."""
    case = make("none", 3)
    before = np.argsort(np.argsort(case.data.time)) < STEP
    position = case.data.position.copy()
    position[before, 0] -= size
    order = np.argsort(case.data.time)
    first = int(order[STEP + wrong])
    step = FrameStep(
        row=int(case.data.row[first]),
        time_s=float(case.data.time[first]),
        is_timed=True,
        coefficients=(size, 0.0, 0.0, 0.0, 0.0, 0.0),
    )
    data = replace(case.data, position=position)
    assert step.clock(Motion.of(data)) is not None
    return case.robot.with_effects(step), data, order


@pytest.mark.parametrize(("size", "some"), [(5e-3, False), (1e-5, True)])
def test_rows_about_a_step_are_left_out_where_they_do_not_show_it(size, some):
    robot, data, order = stepped(size)
    found = identify(robot, data, held_out=0.2)
    rows = {row for row, reason in found.excluded if reason == UNDECIDED}
    assert bool(rows) is some
    assert rows <= set(data.row[order[STEP - MAX_BESIDE_STEP : STEP + MAX_BESIDE_STEP]].tolist())
