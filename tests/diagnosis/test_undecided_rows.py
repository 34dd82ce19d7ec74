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


def stepped(size: float):
    """An arm whose frame moved along x by a size before the row `STEP`, which the arm's effect puts some rows
    off."""
    case = make("none", 3)
    order = np.argsort(case.data.time)
    position = case.data.position.copy()
    position[order[:STEP], 0] -= size
    step = FrameStep(
        row=int(case.data.row[order[STEP]]),
        time_s=float(case.data.time[order[STEP]]),
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
