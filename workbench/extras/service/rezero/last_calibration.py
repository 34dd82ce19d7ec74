"""Prior knowledge from the last calibration of an arm some of whose joints may have moved since."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from workbench.arm.robot import Robot
from workbench.identification.prior import Prior
from workbench.identification.problem import Problem

BEST, NOMINAL = 1e-4, 5e-4
"""Standard deviations of a calibration's constants at best, and of a data sheet's [rad or m]."""
REPLACED = 10.0
"""Times that standard deviation by which the geometry next to a replaced joint may differ."""
UNKNOWN = 0.05
"""Standard deviation of what nothing is known of [rad or m]: no row that shows it feels this."""


@dataclass(frozen=True, eq=False)
class LastCalibration:
    """Knowledge of an arm's constants, some of it released.

    Args:
        robot: The arm as calibrated.
        begin: The same with zeros near those that the rows show: where a zero that was let go is sought.
        std: Of every unknown, geometry and zeros, by the record in the arm's file, as if nothing had moved.
        renewed: Of the geometry next to replaced joints [rad or m].
    """

    robot: Robot
    begin: Robot
    std: Mapping[str, float]
    renewed: Mapping[str, float]

    @classmethod
    def of(cls, robot: Robot, begin: Robot, replaced: Sequence[int]) -> "LastCalibration":
        """Knowledge by an arm's file.

        Args:
            robot: The arm as calibrated.
            begin: The same with zeros near those that the rows show.
            replaced: Joints that were replaced, counted from 0.
        """
        recorded = {} if robot.calibration is None else robot.calibration.std
        names = dict.fromkeys((*robot.default_free, *robot.joint_offsets))
        std = {n: max(recorded[n], BEST) if n in recorded else NOMINAL for n in names}
        near = (n for joint in replaced for link in (joint - 1, joint) for n in link_constants(robot, link))
        return cls(robot, begin, std, {n: REPLACED * std[n] for n in near})

    @property
    def names(self) -> tuple[str, ...]:
        """Constants that are unknowns: geometry and zeros."""
        return tuple(self.std)

    def value(self, name: str) -> float:
        return float(self.robot.values((name,))[0])

    def without(self, *loose: str) -> Prior:
        """The knowledge but that of some constants, which are sought about where the rows show them."""
        unknown = {**self.renewed, **dict.fromkeys(loose, UNKNOWN)}
        sigma = {**self.std, **unknown}
        values = [(self.begin if n in unknown else self.robot).values((n,))[0] for n in sigma]
        return Prior(tuple(sigma), np.array(values), np.diag([s**-2.0 for s in sigma.values()]))

    def problem(
        self, like: Problem, x: Float[np.ndarray, " p"], loose: Sequence[str], **choices: Any
    ) -> Problem:
        """A problem like another one, from its answer on, with the knowledge but that of some constants.

        Args:
            like: Has robot, rows, frames and noise.
            x: Its answer.
            loose: Constants of which nothing is known.
            **choices: Other rows (`data`) or frames, as `Problem.again` takes them.
        """
        return self.without(*loose).on(like.again(robot=like.robot_at(x), free=self.names, **choices))


def link_constants(robot: Robot, joint: int) -> tuple[str, ...]:
    """Free constants between a joint (from 0; −1 for the base) and the next one, in any convention."""
    places = [next(i for i, e in enumerate(robot.elements) if e.joint == k) for k in range(robot.dof)]
    low = places[joint] + 1 if joint >= 0 else 0
    high = places[joint + 1] if joint + 1 < robot.dof else len(robot.elements)
    return tuple(e.name for e in robot.elements[low:high] if e.free)
