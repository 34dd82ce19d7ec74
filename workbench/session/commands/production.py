"""The command that tries the present plate on a production of virtual arms."""

from collections.abc import Hashable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from workbench.base.errors import OptionError
from workbench.plate.plate import AUTO
from workbench.session.command import (
    AbstractTask,
    Cancel,
    Cancelled,
    Progress,
)
from workbench.session.state import Session, Severity, Trial

MOST_ARMS = 100_000
"""More arms than this are refused: the page would be busy for hours."""


@dataclass(frozen=True)
class TryPlate(AbstractTask):
    """Find the yield: the share of virtual arms that meet ARIA eq. (3) after a calibration on this plate.

    Args:
        arms: How many virtual arms.
        seed: Of everything random.
    """

    arms: int = 1000
    seed: int = 0

    @property
    def title(self) -> str:
        return f"Try the plate on {self.arms} virtual arms"

    @property
    def key(self) -> Hashable | None:
        return None

    def check(self, session: Session) -> None:
        if not 1 <= self.arms <= MOST_ARMS:
            raise OptionError(f"{self.arms} virtual arms can't be tried here; give 1 to {MOST_ARMS}")
        missed = [i + 1 for i, state in enumerate(session.states) if not state.reached]
        if missed:
            raise OptionError(f"target {missed[0]} is out of reach; move it, then try the plate")

    def compute(self, session: Session, *, progress: Progress, cancel: Cancel) -> Any:
        from workbench.plate.design import try_plate

        plate, noise = session.plate, session.noise
        q = np.stack([state.q for state in session.states])
        found = try_plate(
            session.robot,
            plate.with_joints(q, tuple(state.branch or AUTO for state in session.states)),
            arms=self.arms,
            sigma=(noise.position, noise.rotation),
            seed=self.seed,
            progress=lambda share: progress(share, "making, calibrating and judging arms"),
            cancel=cancel,
        )
        if cancel():
            raise Cancelled
        return Trial(plate, noise, found)

    def finish(self, session: Session, result: Any) -> Session:
        from workbench.plate.report.design import yield_sentence

        session = replace(session, trial=result)
        return session.tell(Severity.INFO, yield_sentence(result.found))
