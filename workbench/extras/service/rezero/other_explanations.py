"""Alternative explanations to moved zeros: a bent link, a moved frame, a wrong row, another joint.

Each is let go beside all zeros. One that leaves far less, and not by chance, speaks against the zeros: they
would only make up for it where it was measured. Where both links of a joint leave far less than either of
them alone, or anything else, the joint itself seems to be another one.
"""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from workbench.base.progress import progress
from workbench.base.remedy import remedy
from workbench.extras.service.rezero.last_calibration import LastCalibration, link_constants
from workbench.extras.service.rezero.optimum import Optimum
from workbench.extras.service.rezero.result import readable
from workbench.identification.frames import visible_parts
from workbench.identification.problem import Problem
from workbench.report.numbers import with_error

STRANGE = 1e-4
"""Probability of chance below which another cause is believed …"""
CLEARLY_WORSE = 2.5
"""… if the zeros leave this many times what it leaves."""
SIMILAR_CAUSE = 1.5
"""Causes that leave less than this many times what the best leaves are alternatives to it."""
WORST = 3
"""Rows that are left out in turn, the worst."""
ROWS_PER_WRONG_ONE = 5
"""Rows of which one may be wrong."""
CERTAIN = 2.0
"""Standard deviations by which a constant must have changed to be named."""


class _OtherExplanation(NamedTuple):
    """An alternative cause, with its constants freed.

    Args:
        text: What it is.
        remedy: What to do if it is so.
        problem: With it let go.
        further: Unknowns more, or measured numbers less, than with zeros alone.
        shown: Constants whose change is reported.
    """

    text: str
    remedy: str
    problem: Problem
    further: int
    shown: tuple[str, ...] = ()


def doubts(knowledge: LastCalibration, zeros: Optimum, *, far: bool = False) -> tuple[str, ...]:
    """Sentences on what explains the rows far better than any zeros do.

    Args:
        knowledge: What is known of the arm.
        zeros: The fit of all zeros.
        far: Whether these leave the rows far off: anything then speaks against them that is not chance.
    """
    least = 1.0 if far else CLEARLY_WORSE
    found = _better(_causes(knowledge, zeros), zeros, 0, least)
    best, freed = (found[0][2], found[0][1].further) if found else (zeros, 0)
    joints = _better(_joints(knowledge, zeros, freed), best, freed, CLEARLY_WORSE)
    if joints:
        _, cause, fit = joints[0]
        found = [(fit.against(zeros, cause.further)[1], cause, fit)]
    alike = [entry for entry in found if SIMILAR_CAUSE * entry[0] >= found[0][0]]
    if not alike and zeros.measured and np.sqrt(zeros.mean_square) > CLEARLY_WORSE:
        return (
            f"the zeros leave {np.sqrt(zeros.mean_square):.1f} times the noise, and no single link, frame or "
            "row explains it; calibrate again with 'workbench identify'",
        )
    return tuple(_sentence(knowledge, cause, fit, ratio) for ratio, cause, fit in alike)


def _better(
    causes: Iterable[_OtherExplanation], than: Optimum, freed: int, least: float
) -> list[tuple[float, _OtherExplanation, Optimum]]:
    """Causes that leave far less than a fit with fewer unknowns, the best first, and how many times less."""
    found = []
    for cause in causes:
        fit = Optimum.of(cause.problem, measured=than.measured)
        chance, ratio = fit.against(than, cause.further - freed)
        if chance < STRANGE and ratio > least:
            found.append((ratio, cause, fit))
    return sorted(found, key=lambda entry: -entry[0])


def _causes(knowledge: LastCalibration, zeros: Optimum) -> Iterator[_OtherExplanation]:
    problem, robot, offsets = zeros.problem, knowledge.robot, knowledge.robot.joint_offsets
    for joint in range(-1, robot.dof):
        progress(0.5 * (joint + 1) / (robot.dof + 1), "other explanations")
        loose = link_constants(robot, joint)
        if loose and not (joint < 0 and problem.frames.base):
            yield _OtherExplanation(
                f"{f'link {joint + 1}' if joint >= 0 else 'the base link'} is not as calibrated",
                "check it for damage, then recalibrate with 'workbench identify'",
                knowledge.problem(problem, zeros.x, (*offsets, *loose)),
                len(loose),
                loose,
            )
    for frame, parts in zip(("base", "tool"), visible_parts(problem.data, problem.known), strict=True):
        if parts and not getattr(problem.frames, frame):
            freed: dict[str, Any] = {frame: parts}
            yield _OtherExplanation(
                f"the {frame} is not where the file places it",
                f"set [{frame}] free = true in the robot's file",
                knowledge.problem(problem, zeros.x, offsets, frames=replace(problem.frames, **freed)),
                len(parts),
            )
    square = np.bincount(problem.component_rows, problem.residual(zeros.x)[: problem.size] ** 2)
    for row in np.argsort(-square)[: WORST if len(problem.data) >= ROWS_PER_WRONG_ONE else 0]:
        progress(0.6, "other explanations")
        others = problem.data.take(np.delete(np.arange(len(problem.data)), row))
        less = knowledge.problem(problem, zeros.x, offsets, data=others)
        number = int(problem.data.row[row])
        leave = f"leave it out with --exclude {number}"
        yield _OtherExplanation(
            f"row {number} does not fit the others",
            f"measure it again, or {remedy(leave, page=f'exclude row {number} in the Compare tab')}",
            less,
            problem.count - less.count,
        )


def _joints(knowledge: LastCalibration, zeros: Optimum, freed: int) -> Iterator[_OtherExplanation]:
    """Joints with both their links, where these have more unknowns than were freed already."""
    robot = knowledge.robot
    for joint in range(robot.dof):
        progress(0.7 + 0.3 * joint / robot.dof, "other explanations")
        loose = (*link_constants(robot, joint - 1), *link_constants(robot, joint))
        if len(loose) > freed:
            yield _OtherExplanation(
                f"joint {joint + 1} and the links next to it are not as calibrated",
                "it seems to be another one: calibrate again with 'workbench identify'",
                knowledge.problem(zeros.problem, zeros.x, (*robot.joint_offsets, *loose)),
                len(loose),
                loose,
            )


def _sentence(knowledge: LastCalibration, cause: _OtherExplanation, fit: Optimum, ratio: float) -> str:
    off = {n: fit.values[n] - knowledge.value(n) for n in cause.shown}
    sure = sorted(
        (n for n in off if abs(off[n]) > CERTAIN * fit.std[n]), key=lambda n: -abs(off[n]) / fit.std[n]
    )
    chain, sizes = knowledge.robot.chain, []
    for name in sure[:2]:  # with its 95 % interval
        factor, unit = readable(chain.elements[chain.index[name]].unit)
        sizes.append(f"{name} by {with_error(factor * off[name], 2.0 * factor * fit.std[name])}{unit}")
    shown = f" ({', '.join(sizes)})" if sizes else ""
    return f"{cause.text}{shown}: zeros alone leave {ratio:.1f} times as much; {cause.remedy}"
