"""Commands for whole plates: smallest error, trials on virtual arms."""

from dataclasses import replace

import numpy as np

from workbench.base.errors import OptionError
from workbench.identification.problem_blocks import Noise
from workbench.plate.plate import Target
from workbench.session.command import AbstractChange, AbstractTask
from workbench.session.commands.target_placement import place_targets
from workbench.session.reach import from_limit
from workbench.session.score import PlateTrial
from workbench.session.state import Session, Severity
from workbench.session.target_steps import check_free, is_better, rescore


class ImprovePlate(AbstractTask[tuple[Target, ...]]):
    """Let the program place all targets but the locked ones for the smallest predicted error in the region.

    Args:
        seed: Of the search.
    """

    title = "Improve this plate"
    is_plate_search = True

    seed: int = 0

    def check(self, session: Session) -> None:
        check_free(session)
        if all(target.locked for target in session.plate.targets):
            raise OptionError("all targets are locked; unlock those that may be moved")

    def compute(self, session: Session) -> tuple[Target, ...]:
        from workbench.plate.design import optimise_plate

        noise = session.noise
        found = optimise_plate(
            session.robot,
            session.plate,
            production=session.plate.production,
            sigma=(noise.position, noise.rotation),
            seed=self.seed,
        )
        return found.plate.targets

    def finish(self, session: Session, result: tuple[Target, ...]) -> Session:
        check_free(session)
        pairs = zip(session.plate.targets, result, strict=True)
        better = place_targets(session, tuple(old if old.locked else new for old, new in pairs))
        if not is_better(better.score, session.score):
            return session.tell(Severity.INFO, "the search found no better plate")
        before, now = 1e3 * session.score.position, 1e3 * better.score.position
        severity = (
            Severity.LOG if session.measurements.loaded is None else Severity.INFO
        )  # else the strip says it
        text = f"predicted error in the region: {before:.3g} → {now:.3g} mm"
        left = min(from_limit(session.robot, s.q) for s in better.states if s.reached)
        return better.tell(severity, f"{text}; joints stay {left.text} or more from their limits")


class AbstractPlateTrial(AbstractTask[PlateTrial]):
    """Try the plate on virtual arms, as an extra does: the guide suggests the first such command."""

    def finish(self, session: Session, result: PlateTrial) -> Session:
        return replace(session, trial=result).tell(Severity.LOG, result.text)


LARGEST_POSITION, LARGEST_ROTATION = 0.1, float(np.deg2rad(10.0))


class SetNoise(AbstractChange):
    """Set the instrument's noise; the predicted errors are updated.

    Args:
        position: Standard deviation of a coordinate [m].
        rotation: Standard deviation of a rotation about an axis [rad].
    """

    title = "Set the instrument's noise"
    key = "noise"

    position: float
    rotation: float

    def check(self, session: Session) -> None:
        for what, value, largest in (
            ("position", self.position, LARGEST_POSITION),
            ("rotation", self.rotation, LARGEST_ROTATION),
        ):
            if not 0.0 < value <= largest:
                raise OptionError(
                    f"the instrument's {what} noise must be above 0 and at most {largest:.3g}, got {value:g}"
                )

    def apply(self, session: Session) -> Session:
        noise = Noise(self.position, self.rotation)
        return rescore(replace(session, noise=noise))
