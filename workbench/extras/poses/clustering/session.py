"""A command of the app: targets of equal index (ARIA §4.2)."""

from workbench.base.errors import OptionError
from workbench.plate.patterns import MAX_TARGETS
from workbench.plate.plate import Plate
from workbench.session.command import AbstractTask, computed
from workbench.session.commands.target_placement import place_targets
from workbench.session.page_state import Severity
from workbench.session.state import Session
from workbench.session.target_steps import check_free


class ClusterTargets(AbstractTask[Plate]):
    """Replace the targets by poses with equal O in mutually different cubes of the region.

    Args:
        number: How many.
        seed: Of the search.
    """

    number: int = 10
    seed: int = 0

    is_plate_search = True
    stored = Plate
    title = computed(lambda self: f"Search {self.number} poses of equal index")

    def check(self, session: Session) -> None:
        check_free(session)
        maximum = min(MAX_TARGETS, session.plate.region.cubes)
        if not 2 <= self.number <= maximum:
            raise OptionError(f"the number of poses must be 2 to {maximum}, got {self.number}")

    def compute(self, session: Session) -> Plate:
        from workbench.extras.poses.clustering.design import cluster_region

        plate = session.plate
        found = cluster_region(session.robot, plate.region, number=self.number, solid=plate, seed=self.seed)
        return found.plate(plate)

    def finish(self, session: Session, result: Plate) -> Session:
        check_free(session)
        session = place_targets(session, result.targets)
        parts = (f"the targets are now {len(result)} poses of equal index", *result.notes)
        return session.with_message(Severity.INFO, "; ".join(parts))
