"""Prior knowledge from the last calibration of an arm some of whose joints may have moved since."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from workbench.arm.robot import Robot
from workbench.base.errors import OptionError
from workbench.identification.prior import Prior
from workbench.identification.problem import Problem

TOLERANCE, NOMINAL = {"m": 1e-4, "rad": 1e-4}, {"m": 5e-4, "rad": 5e-4}
"""How well a calibration knows its constants at best, and a data sheet those that were never calibrated."""
REPLACED = 10.0
"""Times the tolerance by which the geometry next to a replaced joint may differ."""
UNKNOWN = 0.05
"""Standard deviation of what nothing is known of [rad or m]: no row that shows it feels this."""


@dataclass(frozen=True, eq=False)
class LastCalibration:
    """Prior knowledge of an arm's constants, some of it released.

    Args:
        robot: The arm as calibrated.
        begin: The same with zeros near those that the rows show: where a zero that was let go is sought.
        names: Constants that are unknowns: geometry and zeros.
        prior: Of all of them, as if nothing had moved.
        renewed: Standard deviation of the geometry next to replaced joints [rad or m].
    """

    robot: Robot
    begin: Robot
    names: tuple[str, ...]
    prior: Prior
    renewed: Mapping[str, float]

    @classmethod
    def of(
        cls,
        robot: Robot,
        begin: Robot,
        prior: Prior | None,
        tolerance: tuple[float, float] | None,
        replaced: Sequence[int],
    ) -> "LastCalibration":
        """Knowledge from an older result, and of what that does not speak of from a tolerance.

        Args:
            robot: The arm as calibrated; its constants are where the knowledge is centred.
            begin: The same with zeros near those that the rows show.
            prior: From an older result; None if there is none.
            tolerance: Standard deviations of lengths [m] and of angles [rad]; None: those that the record in
                the arm's file states, and of constants that were never identified the data sheet's.
            replaced: Joints that were replaced, counted from 0.
        """
        elements = {e.name: e for e in robot.elements}
        known = None if prior is None else prior.keep(lambda name: name in elements)
        if known is not None and not known.names:
            raise OptionError(f"the prior knowledge holds no constant of robot '{robot.name}'")
        names = tuple(
            dict.fromkeys((*robot.default_free, *robot.joint_offsets, *(known.names if known else ())))
        )
        given = None if tolerance is None else dict(zip(("m", "rad"), tolerance, strict=True))
        sigma = {
            n: given[elements[n].unit] if given else _recorded(robot, n, elements[n].unit) for n in names
        }
        information = np.diag([sigma[n] ** -2.0 for n in names])
        if known is not None:
            places = [names.index(n) for n in known.names]
            information[np.ix_(places, places)] = known.information
        near = [n for joint in replaced for link in (joint - 1, joint) for n in link_constants(robot, link)]
        return cls(
            robot,
            begin,
            names,
            Prior(names, robot.values(names), information),
            {n: REPLACED * sigma[n] for n in near},
        )

    def value(self, name: str) -> float:
        return float(self.prior.values[self.names.index(name)])

    def without(self, *loose: str) -> Prior:
        unknown = {**self.renewed, **dict.fromkeys(loose, UNKNOWN)}
        rest = self.prior.keep(lambda name: name not in unknown)
        names, size = (*rest.names, *unknown), len(rest.names)
        information = np.diag([1.0] * size + [sigma**-2.0 for sigma in unknown.values()])
        information[:size, :size] = rest.information
        values = np.concatenate([rest.values, self.begin.values(tuple(unknown))])
        return Prior(names, values, information)

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


def _recorded(robot: Robot, name: str, unit: str) -> float:
    """Standard deviation of a constant [rad or m] by the record of the arm's calibration."""
    known = {} if robot.calibration is None else robot.calibration.std
    return max(known[name], TOLERANCE[unit]) if name in known else NOMINAL[unit]


def link_constants(robot: Robot, joint: int) -> tuple[str, ...]:
    """Free constants between a joint (from 0; −1 for the base) and the next one, in any convention."""
    places = [next(i for i, e in enumerate(robot.elements) if e.joint == k) for k in range(robot.dof)]
    low = places[joint] + 1 if joint >= 0 else 0
    high = places[joint + 1] if joint + 1 < robot.dof else len(robot.elements)
    return tuple(e.name for e in robot.elements[low:high] if e.free)
