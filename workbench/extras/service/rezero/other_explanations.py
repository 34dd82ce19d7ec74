"""Alternative explanations to moved zeros: a bent link, a moved frame, a wrong row, or several at once.

Each is let go beside all zeros. One that leaves far less, and not by chance, speaks against the zeros: they
would only make up for it where it was measured. Where none does, all lengths and angles together are tried.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from workbench.base.progress import progress
from workbench.base.remedy import remedy
from workbench.extras.service.rezero.last_calibration import LastCalibration, link_constants
from workbench.extras.service.rezero.optimum import Optimum
from workbench.identification.frames import visible_parts

STRANGE = 1e-4
"""Probability of chance below which another cause is believed …"""
CLEARLY_WORSE = 1.75
"""… if the zeros leave this many times what it leaves."""
SIMILAR_CAUSE = 1.5
"""Causes that leave less than this many times what the best leaves are alternatives to it."""
WORST = 3
"""Rows that are left out in turn, the worst."""
SCALE = "all lengths"
ROWS_PER_WRONG_ONE = 5
"""Rows of which one may be wrong."""


def doubts(knowledge: LastCalibration, zeros: Optimum, *, far: bool = False) -> tuple[str, ...]:
    """Sentences on what explains the rows far better than any zeros do.

    Args:
        knowledge: What is known of the arm.
        zeros: The fit of all zeros.
        far: Whether these leave the rows far off: anything then speaks against them that is not chance.
    """
    causes = list(_causes(knowledge, zeros))
    least = 1.0 if far else CLEARLY_WORSE
    tried = [(_times(zeros, fit, least, len(causes)), text, remedy) for text, remedy, fit in causes]
    if (best := max(ratio for ratio, *_ in tried)) > 0.0:
        alike = sorted((each for each in tried if SIMILAR_CAUSE * each[0] >= best), key=lambda t: -t[0])
        alike = alike[: 1 if alike[0][1].startswith(SCALE) else None]  # one number tells it as well as many
        return tuple(f"{text}: zeros alone leave {r:.1f} times as much; {cure}" for r, text, cure in alike)
    noise = np.sqrt(zeros.mean_square) * (zeros.least is None)
    ratio = _times(zeros, zeros.freed(knowledge, knowledge.known.names), CLEARLY_WORSE)
    if max(ratio, noise) < CLEARLY_WORSE:
        return ()
    than = f"{ratio:.1f} times what other lengths and angles do" if ratio else f"{noise:.1f} times the noise"
    text = f"the zeros leave {than}, and no single link, frame or row explains it"
    return (f"{text}; calibrate again with 'workbench identify'",)


def _times(zeros: Optimum, freer: Optimum, least: float, tried: int = 1) -> float:
    """How many times what another explanation leaves the zeros leave; 0 where that is little or chance in as
    many."""
    chance, ratio = freer.against(zeros)
    return ratio if tried * chance < STRANGE and ratio > least else 0.0


def _causes(knowledge: LastCalibration, zeros: Optimum) -> Iterator[tuple[str, str, Optimum]]:
    """Other causes, each with what to do if it is so, and the optimum with its constants freed."""
    problem, robot, offsets = zeros.problem, knowledge.robot, knowledge.robot.joint_offsets
    for joint in range(-1, robot.dof):
        progress(0.5 * (joint + 1) / (robot.dof + 1), "other explanations")
        if (loose := link_constants(robot, joint)) and not (joint < 0 and problem.frames.base):
            link = f"link {joint + 1}" if joint >= 0 else "the base link"
            was, cure = "calibrated", "check it for damage, then recalibrate with 'workbench identify'"
            if robot.calibration is None:
                was, cure = "in the file", "no calibration is on record: begin with 'workbench identify'"
            yield f"{link} is not as {was}", cure, zeros.freed(knowledge, (*offsets, *loose))
    for frame, parts in zip(("base", "tool"), visible_parts(problem.data, problem.known), strict=True):
        if parts and not getattr(problem.frames, frame):
            freed: dict[str, Any] = {frame: parts}
            fit = zeros.freed(knowledge, offsets, frames=replace(problem.frames, **freed))
            cure = f"set [{frame}] free = true in the robot's file"
            yield f"the {frame} is not where the file places it", cure, fit
    yield from _scales(knowledge, zeros)
    square = np.bincount(problem.component_rows, problem.residual(zeros.x)[: problem.size] ** 2)
    for row in np.argsort(-square)[: WORST if len(problem.data) >= ROWS_PER_WRONG_ONE else 0]:
        progress(0.6, "other explanations")
        others = problem.data.take(np.delete(np.arange(len(problem.data)), row))
        number = int(problem.data.row[row])
        page = f"exclude row {number} in the Calibrate tab"
        cure = f"measure it again, or {remedy(f'leave it out with --exclude {number}', page=page)}"
        yield f"row {number} does not fit the others", cure, zeros.freed(knowledge, offsets, data=others)


def _scales(knowledge: LastCalibration, zeros: Optimum) -> Iterator[tuple[str, str, Optimum]]:
    """That all lengths changed alike, by first order; nothing if positions weren't measured."""
    problem, at = zeros.problem, zeros.problem.evaluate(zeros.x)
    if (points := problem.data.position) is None:
        return
    longer = points - problem.robot_at(zeros.x).in_first_session.base.xyz
    drawn = problem.again(data=replace(problem.data, position=points + longer)).residual(zeros.x)
    more = np.pad(drawn - at.residual[: problem.size], (0, len(at.residual) - problem.size))
    scale = np.linalg.lstsq(np.column_stack([at.jacobian, more]), at.residual, rcond=1e-12)[0][-1]
    rows = replace(problem.data, position=points - scale * longer)
    what = f"{SCALE} are {100.0 * abs(scale):.2g} % {'longer' if scale > 0.0 else 'shorter'} than calibrated"
    cure = "is the arm warmer or colder, or the instrument's scale another? measure a known distance with it"
    yield what, cure, replace(zeros.freed(knowledge, knowledge.robot.joint_offsets, data=rows), spent=1)
