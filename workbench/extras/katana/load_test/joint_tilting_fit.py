"""Clearance, backlash and stiffness of joints, fitted with the geometry or at a given one.

A joint yields to its load by three effects (Katana eqs. 4.10–4.15, 5.15–5.19): it tips across its axis by its
clearance c, lies to one side of its play b, and turns by κ η under the moment η about its axis.

The thesis takes the clearance's radius from the shaft's length L: r = (L/2) tan C, which its (5.15) prints
inverted; and it turns the tilt by γ = 90° |η_x|/(|η_x| + |η_y|), (5.16), which strays from the moment's
direction by up to 4.1° and depends on how the frame lies about the axis. Here, as in (4.11), C itself is the
coefficient, and the tilt has the direction of the moment.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass

import numpy as np

from workbench.arm.effects import AbstractEffect
from workbench.arm.effects.backlash import Backlash
from workbench.arm.effects.joint_compliance import JointCompliance
from workbench.arm.effects.tilting import ClearanceTilt
from workbench.arm.robot import Robot
from workbench.data.dataset import Dataset
from workbench.identification.algorithms.opt2_levenberg_marquardt import Opt2
from workbench.identification.consider_covariance import Considered
from workbench.identification.fit import Fit
from workbench.identification.problem import Noise, Problem

KINDS = {str(kind.coefficient): kind for kind in (ClearanceTilt, Backlash, JointCompliance)}
"""The effects, by what their coefficients are called."""
MAX_STEPS = 60
"""Maximum number of steps of a fit."""


@dataclass(frozen=True)
class JointTilting:
    """How one joint yields to its load, with standard errors; NaN for what was not fitted.

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
    clearance: float = np.nan
    backlash: float = np.nan
    compliance: float = np.nan
    clearance_std: float = np.nan
    backlash_std: float = np.nan
    compliance_std: float = np.nan

    def joined(self, other: "JointTilting") -> "JointTilting":
        """These sizes, completed by those of the other fit."""
        more = asdict(other)
        return JointTilting(**{k: more[k] if np.isnan(v) else v for k, v in asdict(self).items()})


@dataclass(frozen=True, eq=False)
class Tilting:
    """A fit of joints that yield to their loads.

    Args:
        fit: Geometry and coefficients.
        joints: What was found of each joint.
    """

    fit: Fit
    joints: tuple[JointTilting, ...]

    @property
    def effects(self) -> tuple[AbstractEffect, ...]:
        return tilting_effects(self.joints)


def tilting_effects(joints: Sequence[JointTilting]) -> tuple[AbstractEffect, ...]:
    """The sizes of joints as effects of an arm; backlash follows the load."""
    out: list[AbstractEffect] = []
    for word, kind in KINDS.items():
        sizes = {j.joint: getattr(j, word) for j in joints if np.isfinite(getattr(j, word))}
        if sizes:
            out.append(kind(tuple(sizes), tuple(sizes.values())))
    return tuple(out)


def fit_tilting(
    robot: Robot,
    data: Dataset,
    *,
    requested: Sequence[JointTilting],
    noise: Noise,
    free: Sequence[str] | None = None,
    known: Mapping[str, float] | None = None,
    inertia: bool = False,
) -> Tilting:
    """Fit how some joints yield to their loads, together with constants of the geometry.

    Args:
        robot: Nominal arm with masses; effects that it carries already act as they are.
        data: Rows of any observation.
        requested: Joints with the sizes where the search starts; NaN is not fitted.
        noise: Standard deviations where rows bring none.
        free: Constants to fit too; the robot's default ones if None; none if empty (given geometry).
        known: Standard deviation of constants [m], [rad]; of those that are not fitted it enters the errors.
        inertia: Whether the links' masses and centres are fitted too, known as well as the robot file states.
    """
    effects = tilting_effects(requested)
    names = [name for effect in effects for name in effect.names]
    deflected = robot.with_effects(*robot.effects, *effects)
    problem = Problem.build(deflected, data, noise=noise, free=free, effects=names, inertia=inertia)
    considered = None
    if known:
        wide = problem.again(free=[n for n in known if n in robot.chain.index])
        left = [0.0 if n in problem.names else known[n] for n in wide.names]
        considered = Considered(wide, np.array(left))
    algorithm = Opt2(limit=MAX_STEPS)
    fit = Fit(algorithm=algorithm, problem=problem, search=algorithm.search(problem), considered=considered)
    found = dict(zip(problem.names, zip(fit.x.tolist(), fit.std.tolist(), strict=True), strict=True))
    return Tilting(fit, tuple(_found(j.joint, found) for j in sorted(requested, key=lambda j: j.joint)))


def _found(joint: int, found: Mapping[str, tuple[float, float]]) -> JointTilting:
    """Sizes and standard errors of one joint."""
    pairs = {word: found.get(f"joint{joint + 1}.{word}", (np.nan, np.nan)) for word in KINDS}
    sizes = {word: pair[0] for word, pair in pairs.items()}
    return JointTilting(joint, **sizes, **{f"{word}_std": pair[1] for word, pair in pairs.items()})
