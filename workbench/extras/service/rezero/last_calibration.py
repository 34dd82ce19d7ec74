"""Prior knowledge from the last calibration of an arm some of whose joints may have moved since."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.linalg import block_diag

from workbench.arm.robot import Robot
from workbench.identification.prior import Prior

BEST, HELD, NOMINAL = 1e-4, 1e-5, 5e-4
"""Standard deviations of a calibration's constants at best, unless its error was smaller, of what it held, as
others took its place, and of a good data sheet's [rad or m]."""
LEAST_NOISE = 0.3
"""Part of a calibration's error that is the least noise of any axis."""
UNKNOWN = 0.05
"""Standard deviation of what nothing is known of [rad or m]: no row that shows it feels this."""


@dataclass(frozen=True, eq=False)
class LastCalibration:
    """Knowledge of an arm's constants, some of it released.

    Args:
        robot: The arm as calibrated.
        begin: The same with zeros near those that the rows show: where a zero that was let go is sought.
        known: Of geometry and zeros, which are the unknowns, by the record in the arm's file, as if nothing
            had moved.
    """

    robot: Robot
    begin: Robot
    known: Prior

    @classmethod
    def of(cls, robot: Robot, nominal: float = NOMINAL) -> "LastCalibration":
        """Knowledge by an arm's file, or of a data sheet's constants by their deviation [rad or m]."""
        record = robot.calibration
        recorded, found = ({}, {}) if record is None else (record.std, record.nominal)
        identified = (e.name for e in robot.elements if e.name in found)
        names = tuple(dict.fromkeys((*identified, *robot.default_free, *robot.joint_offsets)))
        held = nominal if record is None else HELD
        std = [max(recorded[n], BEST) if n in recorded else held for n in names]
        covariance = np.diag(np.square(std))
        if record is not None:
            at = [names.index(n) for n in found if n in names]
            size, vectors = np.linalg.eigh(record.covariance)
            best = BEST if record.error is None else np.clip(record.error.position, HELD, BEST)
            covariance[np.ix_(at, at)] = (vectors * np.maximum(size, best**2)) @ vectors.T
        return cls(robot, robot, Prior(names, robot.values(names), np.linalg.inv(covariance)))

    @property
    def error(self) -> Float[np.ndarray, "2"] | None:
        """The calibration's own mean error [m], [rad]; None if unknown."""
        record = self.robot.calibration
        return None if record is None or record.error is None else np.array(record.error)

    @property
    def least_noise(self) -> Float[np.ndarray, "2"]:
        """Part of the calibration's error that no other rows show to be less [m], [rad]."""
        return LEAST_NOISE * np.nan_to_num([HELD, HELD] if self.error is None else self.error, nan=HELD)

    def without(self, *loose: str) -> Prior:
        """The knowledge but that of some constants, which are sought about where the rows show them."""
        kept = self.known.keep(lambda n: n not in loose)
        values = np.concatenate([kept.values, self.begin.values(loose)])
        own = np.eye(len(loose)) / UNKNOWN**2
        return Prior((*kept.names, *loose), values, block_diag(kept.information, own))

    def shifts(
        self, loose: Sequence[str], values: Mapping[str, float], covariance: Float[np.ndarray, "p p"]
    ) -> tuple[Float[np.ndarray, " k"], Float[np.ndarray, " k"]]:
        """How far zeros moved since the calibration, and standard deviations.

            δ = z − z₀,      z₀ ~ N(ẑ₀ + B (g − ĝ), A⁻¹_zz),      B = −A⁻¹_zz A_zg

        A is the information of the calibration. Of a zero and the geometry g it may have known the sum alone,
        which moves by δ just as well.

        Args:
            loose: The zeros that were let go.
            values: All unknowns as found now, by name.
            covariance: Theirs.
        """
        known = self.known.keep(lambda n: n in values)
        mine = [known.names.index(n) for n in loose]
        others = [k for k, n in enumerate(known.names) if n not in loose]
        free = np.linalg.inv(known.information[np.ix_(mine, mine)])
        turn = np.zeros((len(mine), len(known.names)))
        turn[:, mine], turn[:, others] = np.eye(len(mine)), free @ known.information[np.ix_(mine, others)]
        found = np.array([values[n] for n in known.names]) - known.values
        at = [list(values).index(n) for n in known.names]
        spread = turn @ covariance[np.ix_(at, at)] @ turn.T + free
        return turn @ found, np.sqrt(np.diag(spread))


def link_constants(robot: Robot, joint: int) -> tuple[str, ...]:
    """Free constants between a joint (from 0; −1 for the base) and the next one, in any convention."""
    before = np.cumsum([e.joint is not None for e in robot.elements]) - 1
    own = (e for e, last in zip(robot.elements, before, strict=True) if last == joint and e.joint is None)
    return tuple(e.name for e in own if e.free)
