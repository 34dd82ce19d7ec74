"""Clearance, backlash and stiffness of joints, fitted together with the geometry or at a given one.

A joint gives way by three effects of load (Katana eqs. 4.10–4.15, 5.15–5.19): it tips across its axis by its
clearance c, lies to one side of its play b, and turns by κ η under the moment η about its axis.

The thesis takes the clearance's radius from the shaft's length L: r = (L/2) tan C, which its (5.15) prints
inverted; and it turns the tilt by γ = 90° |η_x|/(|η_x| + |η_y|), (5.16), which strays from the moment's
direction by up to 4.1° and depends on how the frame lies about the axis. Here, as in (4.11), C itself is the
coefficient, and the tilt has the direction of the moment.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from workbench.effects import AbstractEffect
from workbench.effects.backlash import Backlash
from workbench.effects.clearance_tilt import ClearanceTilt
from workbench.effects.joint_compliance import JointCompliance
from workbench.identify.opt2 import Opt2
from workbench.identify.problem import FrameFreedom, Noise, Problem
from workbench.identify.result import Fit
from workbench.measure.dataset import Dataset
from workbench.robots.robot import Robot

STEPS = 60
"""Most steps of a fit."""


@dataclass(frozen=True)
class JointTilting:
    """How one joint gives way, with standard errors.

    Args:
        joint: From 0.
        clearance: Tilt across its axis, to each side [rad].
        backlash: Play about its axis, to each side [rad].
        compliance: Angle per moment about its axis [rad/(N m)].
        clearance_std: Standard error of the clearance [rad].
        backlash_std: Of the backlash [rad].
        compliance_std: Of the compliance [rad/(N m)].
    """

    joint: int
    clearance: float
    backlash: float
    compliance: float
    clearance_std: float
    backlash_std: float
    compliance_std: float

    @property
    def stiffness(self) -> float:
        """Moment per angle about its axis [N m/rad]; infinite for a joint that does not give way."""
        return 1.0 / self.compliance if self.compliance > 0.0 else np.inf

    @property
    def stiffness_std(self) -> float:
        """Its standard error, to first order [N m/rad]."""
        return self.stiffness * self.compliance_std / self.compliance if self.compliance > 0.0 else np.inf


@dataclass(frozen=True, eq=False)
class Tilting:
    """A fit of joints that give way.

    Args:
        fit: Geometry and coefficients.
        joints: What was found of each joint.
    """

    fit: Fit
    joints: tuple[JointTilting, ...]

    @property
    def calibrated(self) -> Robot:
        """The arm with what was identified."""
        return self.fit.calibrated

    @property
    def effects(self) -> tuple[AbstractEffect, ...]:
        """What was found, as effects of the arm."""
        return tilting_effects(self.joints)


def tilting_effects(joints: Sequence[JointTilting]) -> tuple[AbstractEffect, ...]:
    """Joints that give way as effects of an arm; backlash by the load."""
    which = tuple(j.joint for j in joints)
    return (
        ClearanceTilt(which, tuple(j.clearance for j in joints)),
        Backlash(which, tuple(j.backlash for j in joints)),
        JointCompliance(which, tuple(j.compliance for j in joints)),
    )


def fit_tilting(
    robot: Robot,
    data: Dataset,
    *,
    joints: Sequence[int],
    noise: Noise,
    free: Sequence[str] | None = None,
    frames: FrameFreedom | None = None,
) -> Tilting:
    """Fit the three effects of some joints to any measured rows, together with constants of the geometry.

    Args:
        robot: Nominal arm with masses; effects that it carries already act as they are.
        data: Rows of any observation.
        joints: Joints that may give way, from 0.
        noise: Standard deviations where rows bring none.
        free: Constants to fit beside; the robot's default ones if None, none if empty: a given geometry.
        frames: What of base and tool is unknown; nothing if None.
    """
    effects = tilting_effects([JointTilting(j, *[0.0] * 6) for j in joints])
    names = [name for effect in effects for name in effect.names]
    bent = robot.with_effects(*robot.effects, *effects)
    problem = Problem.build(bent, data, noise=noise, free=free, frames=frames, effects=names)
    fit = searched(problem)
    value = dict(zip(problem.names, fit.x.tolist(), strict=True))
    std = dict(zip(problem.names, fit.std.tolist(), strict=True))
    words = ("clearance", "backlash", "compliance")
    found = [
        JointTilting(j, *(part[f"joint{j + 1}.{word}"] for part in (value, std) for word in words))
        for j in joints
    ]
    return Tilting(fit, tuple(found))


def searched(problem: Problem) -> Fit:
    """The least-squares answer of a problem."""
    search = Opt2(limit=STEPS).search(problem)
    return Fit(
        algorithm="opt2",
        title="OPT2",
        problem=problem,
        x=search.x,
        outcome=search.outcome,
        history=search.history,
        seconds=0.0,
    )
