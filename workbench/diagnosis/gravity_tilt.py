"""Direction of gravity in the arm's base, compared with what its file says.

A direction that differs by more than a few of the file's standard deviations contradicts it, and is then
estimated with the wide prior `WIDE_SIGMA`, since the file's prior would pull it half-way back. The odds that
the file is wrong follow from the size s of the two estimated angles and its standard error e,

    log odds = log N(s; 0, e² + f²) − log N(s; 0, e² + t²),      f = WIDE_SIGMA, t the file's tolerance

of a normal distribution in both angles.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import final

import numpy as np
from jaxtyping import Float

from workbench.arm.effects.effect import AbstractEffect
from workbench.arm.gravity import angles_between, levelled
from workbench.arm.joint import MIN_DEVIATION
from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base.advice import beside
from workbench.base.wording import capital
from workbench.diagnosis.claims.cause import MIN_NOISE_SHARE, Cause
from workbench.diagnosis.confidence import MAX_ODDS
from workbench.diagnosis.drivers.driver import Driver
from workbench.identification.fit import Fit
from workbench.identification.frame_freedom import gravity_names
from workbench.identification.problem import Noise, Problem

CONTRADICTION = 3.0
"""Differences above this many of the file's standard deviations contradict the file."""
MIN_MENTIONED_ERRORS = 4.0
"""Differences above this many standard errors are mentioned."""
WIDE_SIGMA = 0.5
"""Standard deviation of gravity's direction if the file is wrong [rad]."""
UPRIGHT = float(np.deg2rad(1.0))
"""Angle between the file's gravity and the measuring frame's vertical up to which these agree."""


@dataclass(frozen=True, eq=False)
class GravityTilt:
    """Estimated direction of gravity for one placement of the arm.

    Args:
        session: Name of the session; empty where all share one placement.
        angles: Estimated tilt [rad].
        covariance: Of the angles.
        tolerance: Standard deviation in the file [rad].
        is_upright: Whether the file's gravity is along the z axis of the measuring frame, as if the file were
            right and the instrument level.
    """

    session: str
    angles: Float[np.ndarray, "2"]
    covariance: Float[np.ndarray, "2 2"]
    tolerance: float
    is_upright: bool = False

    @property
    def size(self) -> float:
        """Angle between estimated gravity and the file's [rad]."""
        return float(np.linalg.norm(self.angles))

    @property
    def error(self) -> float:
        """Its standard error [rad]."""
        along = self.angles / max(self.size, 1e-300)
        return float(np.sqrt(along @ self.covariance @ along))

    @property
    def is_contradicted(self) -> bool:
        return self.size > CONTRADICTION * self.tolerance and self.size > MIN_MENTIONED_ERRORS * self.error

    @property
    def odds(self) -> float:
        """Odds that the file is wrong (module docstring)."""
        wide, narrow = (self.error**2 + width**2 for width in (WIDE_SIGMA, self.tolerance))
        gain = 0.5 * self.size**2 * (1.0 / narrow - 1.0 / wide) - np.log(wide / narrow)
        return float(np.exp(np.clip(gain, 0.0, np.log(MAX_ODDS))))

    @property
    def text(self) -> str:
        where = f"in session {self.session} the arm" if self.session else "the arm"
        size, error = np.rad2deg([self.size, self.error])
        asks = "; state whether the instrument is level: its frame agrees with the file" * self.is_upright
        tilted = "seems tilted" if self.is_upright else "is tilted"
        return f"{where} {tilted} {size:.3g} ± {error:.2g}° from what its file states{asks}"


def freed(problem: Problem, fit: Fit) -> Problem:
    """The problem with gravity's direction free, if a fit contradicts the file's."""
    mounting = problem.robot.mounting
    if problem.frames.levelled or mounting.gravity_tolerance >= WIDE_SIGMA:
        return problem
    far = CONTRADICTION * mounting.gravity_tolerance
    if not any(np.linalg.norm(fit.x[mine]) > far for _, mine in _angles(fit)):
        return problem
    mounting = replace(mounting, gravity_tolerance=WIDE_SIGMA)
    return replace(problem, robot=replace(problem.robot, mounting=mounting))


def tilts_of_gravity(fit: Fit, given: Robot) -> Iterator[GravityTilt]:
    """Estimated tilt for every placement; empty where gravity was not estimated."""
    arm, tolerance = fit.calibrated, max(given.mounting.gravity_tolerance, MIN_DEVIATION)
    for session, mine in _angles(fit):
        stated, found = (r.in_session(session).gravity for r in (given, arm))
        covariance = fit.covariance[np.ix_(mine, mine)]
        level = levelled(stated, arm.in_session(session).base.rotation)
        is_upright = float(np.linalg.norm(angles_between(stated, level))) < UPRIGHT
        yield GravityTilt(session, angles_between(stated, found), covariance, tolerance, is_upright)


def _angles(fit: Fit) -> Iterator[tuple[str, list[int]]]:
    """Session (empty where all share one placement), and indices of its angles in x."""
    names, frames = fit.problem.names, fit.problem.frames
    for angles in dict.fromkeys(gravity_names(s, frames) for s in fit.problem.data.sessions):
        if angles[0] in names:
            yield angles[0].partition("[")[2].partition("]")[0], [names.index(n) for n in angles]


@final
@dataclass(frozen=True)
class GravityDirection(AbstractEffect):
    """The two angles of gravity (`arm/gravity.py`); it has no columns of its own."""

    name = "gravity-direction"
    does = "the arm is tilted", "the arm is tilted"
    whole_arm = True
    names = ("gravity.x", "gravity.y")

    def elements(self, chain):
        return ()

    def law(self, chain, motion, wrenches):
        return np.zeros((len(motion), 0, 2))

    def sentence(self, chain, motion):
        angle = np.rad2deg(np.linalg.norm(self.coefficients))
        return f"The arm is tilted {angle:.3g}° from what its file states"


@beside("notes on the direction of gravity", ())
def standing_notes(fit: Fit, given: Robot) -> list[str]:
    """Notes on arms tilted significantly, but within the file's tolerance or against the measuring frame."""
    clear = (s for s in tilts_of_gravity(fit, given) if s.size > MIN_MENTIONED_ERRORS * s.error)
    return [s.text for s in clear if s.is_upright or not s.is_contradicted]


@beside("the direction of gravity as a cause", ())
def gravity_direction_causes(fit: Fit, given: Robot, noise: Noise, laws: Sequence[Cause]) -> Iterator[Cause]:
    """Placements in which the file's gravity is significantly wrong, which explains a third of the residual
    noise or more; no surer than what loads do."""
    arm, motion = fit.calibrated, Motion.of(fit.problem.data)
    most = max((c.odds for c in laws if c.driver is Driver.LOAD), default=1.0)
    for found in tilts_of_gravity(fit, given):
        is_far = found.size > WIDE_SIGMA
        if (found.is_upright and not is_far) or not found.is_contradicted:
            continue
        here = arm.in_session(found.session) if found.session else arm
        rows = motion.take(fit.problem.data.in_session(found.session)) if found.session else motion
        moved = (tool_poses(a, rows)[:, :3, 3] for a in (here, here.under(given.gravity)))
        explained = 1e3 * float(np.sqrt((np.subtract(*moved) ** 2).sum(1).mean()))
        if explained >= 1e3 * MIN_NOISE_SHARE * np.sqrt(3.0) * noise.position:
            effect = GravityDirection((), tuple(found.angles.tolist()))
            pull = ", ".join(f"{part:.2f}" for part in here.gravity / np.linalg.norm(here.gravity))
            along = f": gravity pulls along ({pull}) of its base" if is_far else ""
            size, *asks = found.text.split(";")
            is_turned = np.pi - found.size < CONTRADICTION * max(found.tolerance, found.error)
            other = "the same rows say that drives push back more than loads bend them" * is_turned
            yield Cause(
                effects=(effect,),
                odds=min(found.odds, most),
                contribution_mm=explained,
                text=";".join([capital(size + along), *asks]),
                look_alikes=(),
                is_added=False,
            ).doubted(other)
