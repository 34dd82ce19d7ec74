"""A table with one constant that is wrong: the last thing that rows may say of an arm that they don't fit."""

from dataclasses import replace

import numpy as np

from workbench.arm import chain as chains
from workbench.arm.frame import FRAME_PARTS
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.wording import in_mm
from workbench.data.dataset import Dataset
from workbench.identification.algorithms.opt2_levenberg_marquardt import Opt2
from workbench.identification.meaning.bounds import WEIGHT
from workbench.identification.meaning.reading import FITS, FITS_TURN, RowReading
from workbench.identification.problem import FrameFreedom, Noise, Problem

STEPS, UNIT = 30, 1e-4
"""Maximum steps of a fit, and its noise as a share of the reach."""
CLEAR = 2.5
"""How many times better a table must fit with one constant changed."""
ALIKE = 1.3
"""Ratio of misfits within which other constants are named as well."""
SHOWN = 2


def one_constant(reading: RowReading, data: Dataset) -> str:
    """`with joint4.d 108.8 instead of 88.8 mm they fit to 0.02 mm`; empty if no constant explains the rows.

    Args:
        reading: Plain joints, placed.
        data: The rows that it was placed with.
    """
    arm, rows = reading.robot, reading.apply(data.take(np.delete(np.arange(len(data)), reading.apart)))
    arm = replace(arm, mounting=arm.mounting.at(reading.base, reading.tool))
    names = [e.name for e in arm.elements if e.matrix is None]
    found = sorted((_without(arm, rows, name) for name in names), key=lambda f: f[0])
    best = [f for f in found if f[0] < ALIKE * found[0][0] + 1e-6]
    score, position, turn, _ = best[0]
    if CLEAR * score > reading.score or position > FITS * arm.reach or turn > FITS_TURN:
        return ""
    which = " or ".join(text for *_, text in best[:SHOWN])
    return f"with {which} they fit to {in_mm(position)}"


def _without(arm: Robot, rows: Dataset, name: str) -> tuple[float, float, float, str]:
    """Score, misfits [m, rad], and what was changed, with one constant fitted beside base and tool."""
    freedom = FrameFreedom(FRAME_PARTS, FRAME_PARTS)
    noise = Noise(UNIT * arm.reach, UNIT / WEIGHT)
    problem = Problem.build(arm, rows, free=[name], frames=freedom, noise=noise)
    fitted = problem.robot_at(Opt2(limit=STEPS).search(problem).x)
    poses = chains.poses(fitted.chain, rows.q)
    position = float(np.sqrt(((poses[:, :3, 3] - rows.position) ** 2).sum(1).mean()))
    turn = 0.0
    if rows.rotation is not None:
        turned = se3.matrix_to_rotvec(np.swapaxes(poses[:, :3, :3], 1, 2) @ rows.rotation)
        turn = float(np.sqrt((turned**2).sum(1).mean()))
    element = next(e for e in arm.elements if e.name == name)
    unit, factor = ("°", 180.0 / np.pi) if element.axis.turns else (" mm", 1e3)
    before, after = (factor * float(r.values((name,))[0]) for r in (arm, fitted))
    text = f"{name} {after:.4g} instead of {before:.4g}{unit}"
    return float(np.hypot(position / arm.reach, WEIGHT * turn)), position, turn, text
