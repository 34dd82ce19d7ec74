"""Commands that search whole plates: poses of equal index (ARIA §4.2), and the plate with the least error."""

from collections.abc import Hashable
from dataclasses import dataclass
from typing import Any

from workbench.base.errors import OptionError
from workbench.plate.patterns import MOST_TARGETS
from workbench.session.command import (
    AbstractTask,
    Cancel,
    Cancelled,
    Progress,
)
from workbench.session.commands.arrange import placed_anew
from workbench.session.state import Session, Severity
from workbench.session.target_steps import check_free, is_better


@dataclass(frozen=True)
class ClusterTargets(AbstractTask):
    """Replace the targets by poses with equal O in mutually different cubes of the region.

    Args:
        number: How many.
        seed: Of the search.
    """

    number: int = 10
    seed: int = 0

    @property
    def title(self) -> str:
        return f"Search {self.number} poses of equal index"

    @property
    def key(self) -> Hashable | None:
        return None

    def check(self, session: Session) -> None:
        check_free(session)
        most = min(MOST_TARGETS, session.plate.region.cubes)
        if not 2 <= self.number <= most:
            raise OptionError(f"{self.number} poses in different cubes can't be searched; give 2 to {most}")

    def compute(self, session: Session, *, progress: Progress, cancel: Cancel) -> Any:
        from workbench.plate.verbs import cluster_region

        plate = session.plate
        found = cluster_region(
            session.robot,
            plate.region,
            number=self.number,
            seed=self.seed,
            progress=lambda share: progress(share, "searching"),
            cancel=cancel,
        )
        if cancel():
            raise Cancelled
        return found.plate().targets

    def finish(self, session: Session, result: Any) -> Session:
        check_free(session)
        session = placed_anew(session, result)
        return session.tell(Severity.INFO, f"{len(result)} poses of equal index are the targets now")


@dataclass(frozen=True)
class ImprovePlate(AbstractTask):
    """Let the program place all targets for the least predicted error in the region, free of collisions.

    Args:
        seed: Of the search.
    """

    seed: int = 0

    @property
    def title(self) -> str:
        return "Improve this plate"

    @property
    def key(self) -> Hashable | None:
        return None

    def check(self, session: Session) -> None:
        check_free(session)
        locked = [i + 1 for i, target in enumerate(session.plate.targets) if target.locked]
        if locked:
            raise OptionError(f"the search places all targets anew; unlock target {locked[0]} first")

    def compute(self, session: Session, *, progress: Progress, cancel: Cancel) -> Any:
        from workbench.plate.design import optimise_plate

        noise = session.noise
        found = optimise_plate(
            session.robot,
            session.plate,
            sigma=(noise.position, noise.rotation),
            seed=self.seed,
            progress=lambda share: progress(share, "placing targets"),
            cancel=cancel,
        )
        if cancel():
            raise Cancelled
        return found.plate.targets

    def finish(self, session: Session, result: Any) -> Session:
        check_free(session)
        better = placed_anew(session, result)
        if not is_better(better.score, session.score):
            return session.tell(Severity.INFO, "the search found nothing better than the present plate")
        before, now = 1e3 * session.score.position, 1e3 * better.score.position
        return better.tell(Severity.INFO, f"predicted error in the region: {before:.3g} → {now:.3g} mm")
