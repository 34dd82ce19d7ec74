"""An arm reduced for inverse kinematics: one constant transform between neighbouring joints.

    T(q) = C_0 Z(z_1) C_1 Z(z_2) … Z(z_m) C_m,      Z = rotation about, or translation along, z;  z = D q

Any chain has this form once each joint's axis is rotated onto z, independent of convention and nominal
structure. The axes and points for the Jacobian's columns and for the names of branches are those of the
frames right before each Z. An axis moves by its joint's q_k, a coupled one by q_k + Σ ratio q_j, that of a
passive joint by Σ ratio q_j alone.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import pairwise
from typing import no_type_check

import numpy as np
from jaxtyping import Bool, Float, Int

from workbench.arm import chain as chains
from workbench.arm.chain import Axis, Chain, inner
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.types import frozen

ONTO_Z = tuple(frozen(se3.pose(np.roll(np.eye(3), -(axis + 1), axis=1), np.zeros(3))) for axis in range(3))
"""Frames whose z axis is the x, y or z axis of their parent."""


@dataclass(frozen=True, eq=False)
class ReducedArm:
    """Constants between joints.

    Args:
        chain: Base, arm and tool.
        places: Element of the chain that each axis is.
        constants: C_0 … C_m, base and tool included.
        slides: Whether each axis translates.
        shares: Entries of D, row by row: axis, joint and ratio.
        limits: Minimum and maximum coordinate of each joint [rad or m].
        length: Length of the stretched arm [m]: the unit that makes its Jacobian dimensionless.
    """

    chain: Chain
    places: Int[np.ndarray, " m"]
    constants: Float[np.ndarray, "links 4 4"]
    slides: Bool[np.ndarray, " m"]
    shares: Float[np.ndarray, "s 3"]
    limits: Float[np.ndarray, "n 2"]
    length: float

    @property
    def dof(self) -> int:
        """Number of joints."""
        return self.chain.dof

    @cached_property
    def drives(self) -> Float[np.ndarray, "m n"]:
        """D: what each axis moves by, of all joints."""
        out = np.zeros((len(self.slides), self.dof))
        axis, joint = self.shares[:, :2].astype(int).T
        np.add.at(out, (axis, joint), self.shares[:, 2])
        return out

    @property
    def sliding(self) -> Bool[np.ndarray, " n"]:
        """Whether each joint translates."""
        return self.chain.axes[self.chain.driven] > Axis.RZ

    @cached_property
    def repeats(self) -> Bool[np.ndarray, " n"]:
        """Whether a full turn of each joint leads to the same pose."""
        return ~self.sliding & (self.drives % 1.0 == 0.0).all(0)

    def geometry(
        self, x: Float[np.ndarray, "rows n"]
    ) -> tuple[Float[np.ndarray, "rows 3 4"], Float[np.ndarray, "rows n 3"], Float[np.ndarray, "rows n 3"]]:
        """Tool poses (upper three rows), and direction and a point of every joint axis."""
        chain = self.chain
        found = chains.frames(chain, x, np.append(self.places - 1, len(chain.elements) - 1))[:, :, :3]
        axes = [found[:, k, :, axis] for k, axis in enumerate(chain.axes[self.places] % 3)]
        return found[:, -1], np.stack(axes, 1), found[:, :-1, :, 3]

    def jacobian(self, x: Float[np.ndarray, "rows n"]) -> Float[np.ndarray, "rows 6 n"]:
        """Twist of the tool per joint, linear part in units of `length`, so that it is dimensionless."""
        twists = chains.joint_twists(self.chain, x)[1]
        twists[:, :3] /= self.length
        return twists


@lru_cache(maxsize=64)
def compile_arm(robot: Robot) -> ReducedArm:
    """The robot's reduced arm."""
    chain, places, shares, axis = robot.chain, list[int](), list[tuple[int, int, float]](), None
    for place, element in enumerate(chain.elements):
        if element.joint is not None or (element.follows is not None and element.axis is not axis):
            places.append(place)
            axis = element.axis
        if element.joint is not None:
            shares.append((len(places) - 1, element.joint, 1.0))
        elif element.follows is not None:
            shares.append((len(places) - 1, element.follows, element.ratio))
        axis = axis if element.axis is axis else None
    axes, zero = chain.axes[places], np.zeros((1, robot.dof))
    turns = [np.eye(4), *(ONTO_Z[axis % 3] for axis in axes), np.eye(4)]
    between = pairwise([0, *places, len(chain.elements)])
    parts = (chains.poses(chain, zero, part=slice(*ends))[0] for ends in between)
    fixed = [a.T @ part @ b for (a, b), part in zip(pairwise(turns), parts, strict=True)]
    return ReducedArm(
        chain=chain,
        places=frozen(np.array(places)),
        constants=frozen(np.array(fixed)),
        slides=frozen(axes > Axis.RZ),
        shares=frozen(np.array(shares)),
        limits=robot.limits,
        length=max(robot.reach, 1e-3),
    )


@inner
@no_type_check
def forward(constants, slides, shares, x, tool, axes, points):
    """Tool pose, axes and points of one configuration, into the arrays given."""
    entry = 0
    for i in range(3):
        for j in range(4):
            tool[i, j] = constants[0, i, j]
    for k in range(slides.shape[0]):
        for i in range(3):
            axes[k, i] = tool[i, 2]
            points[k, i] = tool[i, 3]
        c, s, d = 1.0, 0.0, 0.0
        while entry < shares.shape[0] and shares[entry, 0] == k:
            d += shares[entry, 2] * x[int(shares[entry, 1])]
            entry += 1
        if not slides[k]:
            c, s, d = np.cos(d), np.sin(d), 0.0
        m = constants[k + 1]
        for i in range(3):
            a = tool[i, 0] * c + tool[i, 1] * s
            b = tool[i, 1] * c - tool[i, 0] * s
            z = tool[i, 2]
            p = tool[i, 3] + z * d
            tool[i, 0] = a * m[0, 0] + b * m[1, 0] + z * m[2, 0]
            tool[i, 1] = a * m[0, 1] + b * m[1, 1] + z * m[2, 1]
            tool[i, 2] = a * m[0, 2] + b * m[1, 2] + z * m[2, 2]
            tool[i, 3] = a * m[0, 3] + b * m[1, 3] + z * m[2, 3] + p
