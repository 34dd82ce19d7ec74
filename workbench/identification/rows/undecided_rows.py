"""Rows near a step that may lie on either side of it.

The step is shifted to each row at most `MAX_BESIDE_STEP` places away, all else as fitted. Rows between
places of similar likelihood are undecided: fitted on the wrong side, they would bias the result.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float

from workbench.arm.effects.events import AbstractStep
from workbench.arm.motion import Motion
from workbench.data.dataset import Dataset
from workbench.identification.problem import Problem

MAX_BESIDE_STEP = 2
"""Maximum number of undecided rows on either side of a step."""
UNDECIDED = "measured at a step: on which side is undecided"
MAX_LIKELIHOOD_GAP = 3.0
"""Log likelihood within which another place is as good: odds of 20."""


def undecided_rows(problem: Problem, x: Float[np.ndarray, " p"], data: Dataset) -> Bool[np.ndarray, " rows"]:
    """Which rows lie between likely places of a step.

    Args:
        problem: Problem whose arm has the steps.
        x: Its solution.
        data: The fitted rows, and others.
    """
    out, arm = np.zeros(len(data), bool), problem.robot_at(x)
    for event in (e for e in arm.effects if isinstance(e, AbstractStep)):
        clock = event.clock(Motion.of(data))
        if clock is None:
            continue
        order, before = np.argsort(clock, kind="stable"), int((clock < event.moment).sum())
        if not 0 < before < len(data):
            continue
        places = range(max(before - MAX_BESIDE_STEP, 1), min(before + MAX_BESIDE_STEP, len(data) - 1) + 1)
        near, costs = data.take(np.sort(order[places[0] - 1 : places[-1] + 1])), []
        for place in places:
            row, time = int(data.row[order[place]]), float(clock[order[place]])
            moved = event if place == before else replace(event, row=row, time_s=time)
            there = problem.again(
                robot=replace(arm, effects=tuple(moved if e is event else e for e in arm.effects)),
                data=near,
                effects=[],
                inertia=False,
            )
            residual = there.residual(there.at(problem.named(x)))[: there.size]
            costs.append(0.5 * float(residual @ residual))
        likely = [p for p, c in zip(places, costs, strict=True) if c < min(costs) + MAX_LIKELIHOOD_GAP]
        out[order[min([*likely, before]) : max([*likely, before])]] = True
    return out
