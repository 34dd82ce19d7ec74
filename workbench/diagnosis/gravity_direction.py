"""Wrong direction of gravity in the robot's file (`diagnosis/gravity_tilt.py`)."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import final

import numpy as np

from workbench.arm.effects.effect import AbstractEffect
from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base.advice import beside
from workbench.base.wording import capital
from workbench.diagnosis.claims.cause import Cause
from workbench.diagnosis.claims.claimed_causes import MIN_NOISE_SHARE
from workbench.diagnosis.drivers.driver import Driver
from workbench.diagnosis.gravity_tilt import MIN_MENTIONED_ERRORS, WIDE_SIGMA, tilts_of_gravity
from workbench.identification.fit import Fit
from workbench.identification.problem import Noise


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
    """Placements in which the file's gravity is significantly wrong; no surer than what loads do.

    Args:
        given: The arm as given.
        noise: Residual noise; a third of it must be explained.
        laws: The other causes.
    """
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
            other = "the same rows say that drives push back more than loads bend them" * found.is_opposite
            yield Cause(
                effects=(effect,),
                odds=min(found.odds, most),
                contribution_mm=explained,
                text=";".join([capital(size + along), *asks]),
                look_alikes=(),
                is_added=False,
            ).doubted(other)
