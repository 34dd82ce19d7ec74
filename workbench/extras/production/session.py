"""Plates tried on virtual arms, and weighed against each other, in a session; opening one of these."""

from dataclasses import dataclass, replace
from typing import final

import numpy as np

from workbench.base.errors import OptionError
from workbench.base.wording import plural
from workbench.extras.production.plate_trial import try_plate
from workbench.extras.production.report import yield_sentence
from workbench.extras.production.tradeoff import Choice, Tradeoff, weigh_choices
from workbench.extras.production.yield_inputs import check_seats
from workbench.plate.plate import AUTO
from workbench.plate.target_readings import usual_sigma
from workbench.session.command import AbstractChange, AbstractTask, computed
from workbench.session.commands.plate import AbstractPlateTrial
from workbench.session.commands.target_placement import place_plate
from workbench.session.judgement import PASSING_SHARE
from workbench.session.live_score import PlateTrial
from workbench.session.page_state import Severity
from workbench.session.part import AbstractPart
from workbench.session.state import Session
from workbench.session.target_steps import check_free


@final
@dataclass(frozen=True, eq=False)
class Weighed(AbstractPart):
    """Plates that could be made, with their errors."""

    found: Tradeoff


def choices_of(session: Session) -> tuple[Choice, ...]:
    """The plates weighed last."""
    kept = session.part(Weighed)
    return () if kept is None else kept.found.choices


JUDGED_POSES = 200
"""Poses of the region at which arms are judged on the page: their branches take half of the time."""
MAX_ARMS = 100_000
"""More arms than this are refused: the page would be busy for hours."""


class TryPlate(AbstractPlateTrial):
    """Find the yield: the share of virtual arms that keep the wanted error after a calibration on this plate.

    Args:
        arms: How many virtual arms.
        seed: Of everything random.
    """

    arms: int = 1000
    seed: int = 0

    title = computed(lambda self: f"Try the plate on {plural(self.arms, 'virtual arm')}")

    def check(self, session: Session) -> None:
        if not 1 <= self.arms <= MAX_ARMS:
            raise OptionError(f"the number of virtual arms must be 1 to {MAX_ARMS}, got {self.arms}")
        if session.choices.wanted is None:
            raise OptionError(
                "no required error is set to test the arms against; set 'Required [mm]' first",
                option="wanted",
            )
        check_seats(session.robot, session.plate.has_seats)
        for i, state in enumerate(session.states):
            if not state.measurable:
                raise OptionError(f"target {i + 1} is {state.obstacle}; move it, then try the plate")

    def compute(self, session: Session) -> PlateTrial:
        plate, noise = session.plate, session.noise
        q = np.stack([state.q for state in session.states])
        found = try_plate(
            session.robot,
            plate.with_joints(q, tuple(state.branch or AUTO for state in session.states)),
            arms=self.arms,
            sigma=(noise.position, noise.rotation),
            wanted=session.choices.wanted,
            poses=JUDGED_POSES,
            seed=self.seed,
        )
        errors = np.full(plate.region.cubes, np.nan)
        errors[found.cells] = found.observed[:, 0]
        return PlateTrial(
            plate=plate,
            noise=noise,
            wanted=session.choices.wanted,
            arms=found.arms,
            share=found.share,
            unreached=int((~found.reached).sum()),
            used=float(np.quantile(found.used, PASSING_SHARE, method="inverted_cdf")),
            position=float(found.position.mean()),
            errors=errors,
            text=yield_sentence(found),
            blame=found.blame or "",
        )


class WeighPlates(AbstractTask[Tradeoff]):
    """Search plates of several sizes and manufacturing methods, and compare their errors.

    Args:
        numbers: Of targets.
        places: Random blocks from which each search begins.
        seed: Of the searches.
    """

    title = "Compare plates"

    numbers: tuple[int, ...] = (8, 12)
    places: int = 150
    seed: int = 0

    def compute(self, session: Session) -> Tradeoff:
        return weigh_choices(
            session.robot, session.plate, numbers=self.numbers, places=self.places, seed=self.seed
        )

    def finish(self, session: Session, result: Tradeoff) -> Session:
        text = f"{len(result.choices)} plates compared; {len(result.front)} are Pareto-optimal"
        return session.with_part(Weighed(result)).with_message(Severity.INFO, text)


class OpenChoice(AbstractChange):
    """Replace the current plate by one from the comparison; Undo restores the current one.

    Args:
        number: Of the choice, counted from 0, the least work first.
    """

    number: int

    title = computed(lambda self: f"Open plate {self.number + 1} of the comparison")

    def check(self, session: Session) -> None:
        check_free(session)
        count = len(choices_of(session))
        if not 0 <= self.number < count:
            raise OptionError(
                f"the plate must be 1 to {count}, got {self.number + 1}"
                if count
                else "no plates have been compared yet; press Compare plates first",
                option="number",
                found=self.number,
            )

    def apply(self, session: Session) -> Session:
        choice = choices_of(session)[self.number]
        plate = replace(choice.design.plate, name=choice.name, region=session.plate.region)
        opened, weighed = place_plate(session, plate, selected=0), usual_sigma(plate)[0]
        if np.isclose(weighed, opened.noise.position):
            return opened
        return opened.with_message(
            Severity.INFO,
            f"this plate was compared with an instrument of {1e3 * weighed:g} mm; the predicted error is "
            f"with yours, {1e3 * opened.noise.position:g} mm: change its noise to see the same error",
        )
