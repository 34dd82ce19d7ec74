"""How far each constant that was identified moves the tool from where its nominal value has it."""

from typing import NamedTuple

import numpy as np

from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.identification.fit import Fit
from workbench.identification.report.parameters import unseen
from workbench.report.chart import Bar, bars
from workbench.report.colours import CALIBRATED, NOMINAL
from workbench.report.numbers import signed

MAX_POSES = 300
"""Poses that are looked at; of more, evenly chosen ones."""
MAX_BARS = 8
"""Constants with a bar of their own."""


class ChangedConstant(NamedTuple):
    """A constant of the arm, from nominal to identified.

    Args:
        name: As in the result, such as `joint2.alpha`.
        change: Identified less nominal [rad or m].
        moved: Mean distance by which that moves the tool at the fitted poses [m].
    """

    name: str
    unit: str
    change: float
    moved: float


def changed_constants(fit: Fit) -> list[ChangedConstant]:
    """All constants of the arm that the rows determine, what moves the tool most first."""
    arm, hidden, q = fit.calibrated.with_effects(), unseen(fit), fit.problem.data.q
    poses = Motion(q[np.unique(np.linspace(0, len(q) - 1, min(len(q), MAX_POSES)).round().astype(int))])
    here, found = tool_poses(arm, poses)[:, :3, 3], []
    for p, value in zip(fit.parameters, fit.x.tolist(), strict=True):
        if p.is_geometry and p.name not in hidden:
            there = tool_poses(arm.with_values({p.name: p.nominal}), poses)[:, :3, 3]
            moved = float(np.linalg.norm(here - there, axis=1).mean())
            found.append(ChangedConstant(p.name, p.unit, value - p.nominal, moved))
    return sorted(found, key=lambda one: -one.moved)


def constant_bars(fit: Fit) -> str:
    """The largest as bars in mm, angles with their change; what the others amount to each at most."""
    found = changed_constants(fit)
    rows = [Bar(_text(one, fit), 1e3 * one.moved, CALIBRATED, _turned(one)) for one in found[:MAX_BARS]]
    if others := found[MAX_BARS:]:
        rows.append(Bar(f"Each of {len(others)} others, at most", 1e3 * others[0].moved, NOMINAL))
    return bars(rows, testid="constants")


def _text(one: ChangedConstant, fit: Fit) -> str:
    joint, _, constant = one.name.partition(".")
    is_zero = one.name in fit.problem.robot.joint_offsets
    return f"{joint.replace('joint', 'Joint ')}: {'zero' if is_zero else constant}"


def _turned(one: ChangedConstant) -> str:
    return signed(float(np.rad2deg(one.change)), 3) + "°" if one.unit == "rad" else ""
