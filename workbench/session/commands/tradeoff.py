"""Commands that weigh plates that could be made, and open one of them (error against price)."""

from dataclasses import replace
from typing import Any

import numpy as np

from workbench.base.errors import OptionError
from workbench.base.progress import Cancel
from workbench.session.command import AbstractChange, AbstractTask, Progress, computed
from workbench.session.reach import place_all
from workbench.session.state import Session, Severity
from workbench.session.target_steps import check_free, move_targets


class WeighPlates(AbstractTask):
    """Search plates of several sizes, made in several ways, and set their error against their price.

    Args:
        numbers: Of targets.
        places: Random blocks from which each search begins.
        seed: Of the searches.
    """

    title = "Weigh plates against their price"

    numbers: tuple[int, ...] = (8, 12)
    places: int = 150
    seed: int = 0

    def compute(self, session: Session, *, progress: Progress, cancel: Cancel) -> Any:
        from workbench.plate.tradeoff import weigh_choices

        return weigh_choices(
            session.robot,
            session.plate,
            numbers=self.numbers,
            places=self.places,
            seed=self.seed,
            progress=lambda share: progress(share, "searching plates"),
            cancel=cancel,
        )

    def finish(self, session: Session, result: Any) -> Session:
        words = f"{len(result.choices)} plates weighed; {len(result.front)} of them are beaten by none"
        return replace(session, tradeoff=result).tell(Severity.INFO, words)


class OpenChoice(AbstractChange):
    """Put a plate that was weighed in the place of the present one; Undo brings that back.

    Args:
        number: Of the choice, counted from 0, the cheapest first.
    """

    number: int

    title = computed(lambda self: f"Open plate {self.number + 1} of those weighed")

    def check(self, session: Session) -> None:
        check_free(session)
        count = 0 if session.tradeoff is None else len(session.tradeoff.choices)
        if not 0 <= self.number < count:
            raise OptionError(
                f"the plate must be 1 to {count}, got {self.number + 1}"
                if count
                else "no plates have been weighed yet; press Weigh plates first"
            )

    def apply(self, session: Session) -> Session:
        assert session.tradeoff is not None
        choice = session.tradeoff.choices[self.number]
        plate = replace(choice.design.plate, name=choice.name, region=session.plate.region)
        rng = np.random.default_rng(0)
        states = place_all(session.robot, plate, region_q=session.region_q, rng=rng)
        return move_targets(session, plate, states, selected=0)
