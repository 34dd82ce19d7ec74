"""Commands for whole plates: smallest error, trials on virtual arms."""

from dataclasses import field, replace
from typing import Any

import numpy as np

from workbench.base.errors import DataError, OptionError
from workbench.base.types import Outcome
from workbench.identification.problem_blocks import Noise
from workbench.plate.plate import Plate, Target
from workbench.report.blocks import Tone
from workbench.report.numbers import compared
from workbench.session.command import AbstractChange, AbstractTask
from workbench.session.live_score import PlateTrial
from workbench.session.page_state import Severity
from workbench.session.stages import plate_judgement
from workbench.session.start import is_default_plate
from workbench.session.state import Session
from workbench.session.target_steps import check_free, is_better, place_plate, rescore

FoundPlate = tuple[Plate, Plate | None, str]
"""The plate that a search began with, the one that it found, if any, and what that lacks, or why there is
none."""


class ImprovePlate(AbstractTask[FoundPlate]):
    """Let the program place all targets but the locked ones for the smallest predicted error in the region.

    The plate itself is moved, too, where it is the one that the arm began on, or not good enough.

    Args:
        seed: Of the search.
        found: The best plate that it had found when it was cancelled; None: it went on to its end.
    """

    title = "Improve this plate"
    is_filed = True

    seed: int = 0
    found: Plate | None = field(default=None, repr=False)

    def check(self, session: Session) -> None:
        check_free(session)
        if all(target.locked for target in session.plate.targets):
            raise OptionError("all targets are locked; unlock those that may be moved")

    def compute(self, session: Session) -> FoundPlate:
        from workbench.plate.design import optimise_plate

        if self.found is not None:
            return session.plate, self.found, ""
        noise, judged = session.noise, plate_judgement(session)
        is_bad = judged is not None and judged.tone is Tone.CAREFUL
        is_lacking = not all(state.measurable for state in session.states)
        try:
            design = optimise_plate(
                session.robot,
                session.plate,
                production=session.plate.production,
                sigma=(noise.position, noise.rotation),
                moves=is_default_plate(session) or is_bad or is_lacking,
                seed=self.seed,
            )
        except DataError as error:  # no target keeps what it must
            return session.plate, None, str(error)
        is_other = design.cost < design.start_cost or design.outcome is not Outcome.CANCELLED
        return session.plate, design.plate if is_other else None, design.narrowed

    def stopped(self, result: FoundPlate) -> "ImprovePlate | None":
        return None if result[1] is None else replace(self, found=result[1])

    def finish(self, session: Session, result: FoundPlate) -> Session:
        (begun, plate, lacks), old = result, session.plate
        searched = session if self.found else session.updated("history", searched=old)
        if plate is None:
            return searched.with_message(Severity.WARNING, lacks)
        found_for = dict(zip(map(_place, begun.targets), plate.targets, strict=True))
        targets = [t if t.locked else found_for.get(_place(t), t) for t in old.targets]
        is_changed = {*map(_place, old.targets)} != found_for.keys()
        if is_changed and not np.array_equal(begun.xyz, plate.xyz):
            text = "targets were changed during the search, which moved the plate: they stay; search again"
            return session.with_message(Severity.WARNING, text)
        found = replace(old, targets=tuple(targets), xyz=old.xyz if is_changed else plate.xyz)
        better = place_plate(session, found)
        if not is_better(better, session):
            beside = " beside the targets that were changed during the search" if is_changed else ""
            so_far = " before it was cancelled" if self.found else ""
            return searched.with_message(Severity.INFO, f"the search found no better plate{beside}{so_far}")
        before, now = 1e3 * session.score.position, 1e3 * better.score.position
        text = "the best plate until the search was cancelled: " if self.found else ""
        text += f"predicted error in the region {compared(before)} → {compared(now)} mm"
        is_moved = (away := 1e3 * float(np.linalg.norm(found.xyz - old.xyz))) > 0.5
        where, little = f"the plate was moved by {away:.0f} mm; " * is_moved, f"; little room: {lacks}"
        better = better if self.found else better.updated("history", searched=better.plate)
        is_shown = session.measurements.loaded is None and not is_moved and not lacks  # by the strip
        severity = Severity.LOG if is_shown else Severity.INFO
        return better.with_message(severity, f"{where}{text}{little if lacks else ''}")


def _place(target: Target) -> tuple[Any, ...]:
    """By which a target is known as not changed."""
    return *target.xyz.tolist(), *target.rpy.tolist(), target.branch, target.kind


class AbstractPlateTrial(AbstractTask[PlateTrial]):
    """Try the plate on virtual arms, as an extra does: the next step is the first such command."""

    is_filed = True

    def finish(self, session: Session, result: PlateTrial) -> Session:
        return session.with_part(result).with_message(Severity.LOG, result.text)


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
        for what, most in (("position", LARGEST_POSITION), ("rotation", LARGEST_ROTATION)):
            if not 0.0 < (value := getattr(self, what)) <= most:
                wrong = f"must be above 0 and at most {most:.3g}, got {value:g}"
                raise OptionError(f"the instrument's {what} noise {wrong}")

    def apply(self, session: Session) -> Session:
        noise = Noise(self.position, self.rotation)
        return rescore(replace(session, noise=noise))
