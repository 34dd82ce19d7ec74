"""Joint coupling: one joint moves along with another, as the motors of a wrist do.

Δv_i = c q_j,      joints = (i, j), c [unit of joint i per unit of joint j]
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, final

from workbench.arm.chain import Chain
from workbench.arm.effects.axes import Wrenches, driven_names, turns
from workbench.arm.effects.effect import AbstractEffect, Candidate, Law, moved_joints, offered
from workbench.arm.motion import Motion

if TYPE_CHECKING:
    from workbench.arm.robot import Robot

WRIST_JOINTS = 3
"""Number of last joints whose motors may be coupled with each other, neighbours or not."""


@final
@dataclass(frozen=True)
class JointCoupling(AbstractEffect):
    """One coefficient: motion of the first joint per motion of the second."""

    name = "joint-coupling"
    usual_joint = -1
    largest = 0.05
    """Relative to the other joint's travel. Controllers compensate coupled gears; what remains is an error of
    the ratio, or the pull of a cable. Between a revolute and a prismatic joint, in rad/m or m/rad."""

    @cached_property
    def names(self) -> tuple[str, ...]:
        return tuple(f"joint{self.joints[0] + 1}.by_joint{j + 1}" for j in self.joints[1:2])

    def units(self, chain: Chain) -> tuple[str, ...]:
        pair = ["rad" if turns(chain, j) else "m" for j in self.joints]
        return ("1" if pair[0] == pair[1] else "/".join(pair),)

    def elements(self, chain: Chain) -> tuple[str, ...]:
        return driven_names(chain, self.joints[:1])

    def law(self, chain: Chain, motion: Motion, wrenches: Wrenches) -> Law:
        return motion.q[:, self.joints[1], None, None].copy()

    def mistake(self, chain: Chain) -> str | None:
        if len(self.joints) != 2:
            return f"has {len(self.joints)} joints but needs two: which one moves, and by which one"
        return None

    @property
    def plain(self) -> str:
        moved, by = (j + 1 for j in self.joints)
        return f"joint {moved} moves along with joint {by}"

    @classmethod
    def offers(cls, arm: "Robot", motion: Motion) -> Iterator[Candidate | str]:
        last = arm.dof - WRIST_JOINTS
        pairs = (
            cls((joint, other))
            for joint in moved_joints(motion)
            for other in range(arm.dof)
            if other != joint and (abs(other - joint) == 1 or min(other, joint) >= last)
        )
        return offered(pairs, arm, motion)

    @classmethod
    def example(cls, arm: "Robot", joint: int, rng) -> "JointCoupling":
        return cls((joint, joint - 1 if joint else 1), (1.0,))
