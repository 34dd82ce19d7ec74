"""Alternative explanations to moved zeros: a bent link, a moved frame, a wrong row.

Each is let go beside all zeros. One that leaves far less, and not by chance, speaks against the zeros: they
would only make up for it where it was measured. Where both links of a joint leave far less than either of
them alone, or anything else, the joint itself seems to be another one.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from workbench.arm.robot import Robot
from workbench.base.progress import progress
from workbench.base.remedy import remedy
from workbench.extras.service.rezero.f_test import Optimum
from workbench.extras.service.rezero.last_calibration import LastCalibration, link_constants
from workbench.extras.service.rezero.result import readable
from workbench.identification.frames import visible_parts
from workbench.identification.problem import Problem

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


def doubts(knowledge: LastCalibration, zeros: Optimum, *, measured: bool) -> tuple[str, ...]:
    """Sentences on what explains the rows far better than any zeros do.

    Args:
        knowledge: What is known of the arm.
        zeros: The fit of all zeros.
        measured: Whether the noise is known.
    """
    found = []
    maximum = knowledge.robot.dof + 3 + WORST
    for k, cause in enumerate(_causes(knowledge, zeros)):
        progress(0.7 * k / maximum, "other explanations")
        fit = Optimum.of(cause.problem, measured=measured)
        chance, ratio = fit.against(zeros, cause.further)
        if chance < STRANGE and ratio > CLEARLY_WORSE:
            found.append((ratio, cause, fit))
    found.sort(key=lambda entry: -entry[0])
    best = (found[0][2], found[0][1].further) if found else (zeros, 0)
    if (other := _other_joint(knowledge, zeros, *best, measured=measured)) is not None:
        return (other,)
    sentences = [
        _sentence(knowledge, cause, fit, ratio)
        for ratio, cause, fit in found
        if SIMILAR_CAUSE * ratio >= found[0][0]
    ]
    if not sentences and measured and np.sqrt(zeros.mean_square) > CLEARLY_WORSE:
        sentences.append(
            f"the zeros leave {np.sqrt(zeros.mean_square):.1f} times the noise, and no single link, frame or "
            "row explains it; calibrate again with 'workbench identify'"
        )
    return tuple(sentences)


def _causes(knowledge: LastCalibration, zeros: Optimum) -> Iterator[_OtherExplanation]:
    problem, robot, offsets = zeros.problem, knowledge.robot, knowledge.robot.joint_offsets
    for joint in range(-1, robot.dof):
        loose = [n for n in link_constants(robot, joint) if n not in knowledge.renewed]
        if loose and not (joint < 0 and problem.frames.base):
            yield _OtherExplanation(
                f"{f'link {joint + 1}' if joint >= 0 else 'the base link'} is not as calibrated",
                "check it for damage, then recalibrate with 'workbench identify'",
                knowledge.problem(problem, zeros.x, (*offsets, *loose)),
                len(loose),
                tuple(loose),
            )
    base, tool = visible_parts(problem.data, problem.known)
    for frame, parts in (("base", base), ("tool", tool)):
        if parts and not getattr(problem.frames, frame):
            freed: dict[str, Any] = {frame: parts}
            freer = replace(problem.frames, **freed)
            yield _OtherExplanation(
                f"the {frame} is not where the file places it",
                f"set [{frame}] free = true in the robot's file",
                knowledge.problem(problem, zeros.x, offsets, frames=freer),
                len(parts),
            )
    if len(problem.data) < ROWS_PER_WRONG_ONE:
        return
    square = np.bincount(problem.component_rows, problem.residual(zeros.x)[: problem.size] ** 2)
    for row in np.argsort(-square)[:WORST]:
        others = problem.data.take(np.delete(np.arange(len(problem.data)), row))
        less = knowledge.problem(problem, zeros.x, offsets, data=others)
        number = int(problem.data.row[row])
        yield _OtherExplanation(
            f"row {number} does not fit the others",
            "measure it again, or "
            + remedy(
                f"leave it out with --exclude {number}", page=f"exclude row {number} in the Compare tab"
            ),
            less,
            problem.count - less.count,
        )


def _other_joint(
    knowledge: LastCalibration, zeros: Optimum, best: Optimum, freed: int, *, measured: bool
) -> str | None:
    """A sentence on the joint that was replaced, if both its links leave far less than the best cause."""
    robot, found = knowledge.robot, []
    for joint in range(robot.dof):
        links = [
            n for k in (joint - 1, joint) for n in link_constants(robot, k) if n not in knowledge.renewed
        ]
        if len(links) <= freed:
            continue
        progress(0.7 + 0.3 * joint / robot.dof, "other explanations")
        freer = knowledge.problem(zeros.problem, zeros.x, (*robot.joint_offsets, *links))
        fit = Optimum.of(freer, measured=measured)
        chance, ratio = fit.against(best, len(links) - freed)
        if chance < STRANGE and ratio > CLEARLY_WORSE:
            found.append((ratio, joint, links, fit))
    if not found:
        return None
    _, joint, links, fit = max(found, key=lambda entry: entry[0])
    cause = _OtherExplanation(
        f"joint {joint + 1} and the links next to it are not as calibrated",
        "if it was replaced, "
        + remedy(
            f"run this again with --replaced {joint + 1}; else calibrate again with 'workbench identify'",
            page=f"name joint {joint + 1} as replaced and find the zeros again; else calibrate again",
        ),
        fit.problem,
        len(links),
        tuple(links),
    )
    return _sentence(knowledge, cause, fit, fit.against(zeros, len(links))[1])


def _sentence(knowledge: LastCalibration, cause: _OtherExplanation, fit: Optimum, ratio: float) -> str:
    off = {n: fit.values[n] - knowledge.value(n) for n in cause.shown}
    sure = [n for n in off if abs(off[n]) > CERTAIN * fit.std[n]]
    sure.sort(key=lambda n: -abs(off[n]) / fit.std[n])
    sizes = [_size(knowledge.robot, n, off[n], fit.std[n]) for n in sure[:2]]
    shown = f" ({', '.join(sizes)})" if sizes else ""
    return f"{cause.text}{shown}: zeros alone leave {ratio:.1f} times as much; {cause.remedy}"


def _size(robot: Robot, name: str, change: float, std: float) -> str:
    factor, unit = readable(robot.chain.elements[robot.chain.index[name]].unit)
    return f"{name} {factor * change:+.2g} ± {2.0 * factor * std:.1g}{unit}".replace("-", "−")
