"""The Katana thesis done again on virtual arms: its tables, its influences, its claims.

    found = reproduce_katana(arms=40)
    found.findings          # printed and ours, one by one

Numbers that come from the real arm alone have no counterpart; each is listed with a reason.
"""

from dataclasses import dataclass

import numpy as np

from studies import katana_claims as claims
from studies import katana_printed as printed
from studies import katana_setup as setup
from studies import katana_tables as tables
from studies.finding import Finding
from studies.influence_study import InfluenceStudy, influence_study
from studies.katana_influence import Influence, influence
from studies.katana_study import AS_BAD, EACH_DIRECTION, EACH_SIDE, KatanaStudy, katana_study
from studies.katana_tracking import TrackingStudy, tracking_study
from studies.katana_tracking_claims import tracking_findings
from workbench import Motion, load_robot
from workbench.base.errors import OptionError
from workbench.base.progress import part_of
from workbench.plate.poses.iso_cube import CubePoses, iso_cube_poses

ARMS = 40
"""Virtual arms of each reading of the printed play."""
WEIGHED = 200
"""Virtual arms on which influence-based identification is compared with least squares."""
FOLLOWING = 2
"""One arm in so many follows the paths of chapter 5."""
NUMBERS = (6, 12, 118)
"""Numbers of poses of that comparison."""


@dataclass(frozen=True, eq=False, kw_only=True)
class KatanaReproduction:
    """The thesis done again.

    The printed play is counted once, from one side to the other, and twice, to either side; the first again
    with arms that begin as badly as the thesis's.
    """

    findings: tuple[Finding, ...]
    once: KatanaStudy
    twice: KatanaStudy
    as_bad: KatanaStudy
    influences: Influence
    weights: InfluenceStudy
    cube: CubePoses
    tracking: TrackingStudy


def reproduce_katana(*, arms: int = ARMS, weighed: int = WEIGHED, seed: int = 0) -> KatanaReproduction:
    """Do the thesis again on virtual arms."""
    if arms < 2 or weighed < 2:
        few = min(arms, weighed)
        raise OptionError(f"arms must be at least 2 to show a spread, got {few}", option="arms", found=few)

    def studied(begin: float, text: str, *, play: float = EACH_DIRECTION, share: float = 1.0) -> KatanaStudy:
        with part_of(begin, 0.15, text):
            return katana_study(arms=arms, play=play, share=share, seed=seed)

    once = studied(0.0, "arms calibrated in every way")
    twice = studied(0.15, "the same with twice the play", play=EACH_SIDE)
    as_bad = studied(0.3, "arms that begin as badly as the thesis's", share=AS_BAD)
    with part_of(0.45, 0.25):
        weights = influence_study(arms=weighed, numbers=NUMBERS, seed=seed)
    with part_of(0.7, 0.3):
        tracking = tracking_study(arms=max(arms // FOLLOWING, 2), seed=seed)
    robot = load_robot("katana450")
    cube = iso_cube_poses(robot, rng=np.random.default_rng(seed))
    influences = influence(robot, Motion(cube.q), names=printed.CONSTANTS)
    return KatanaReproduction(
        findings=(
            *_errors(once, twice, as_bad, cube),
            *claims.weights_compared(weights),
            *tracking_findings(tracking),
            *setup.arm(),
            *setup.equations(),
            *setup.influences(influences, cube),
            *setup.redundant(),
        ),
        once=once,
        twice=twice,
        as_bad=as_bad,
        influences=influences,
        weights=weights,
        cube=cube,
        tracking=tracking,
    )


def _errors(
    once: KatanaStudy, twice: KatanaStudy, as_bad: KatanaStudy, cube: CubePoses
) -> tuple[Finding, ...]:
    """Chapters 3 and 4: what calibration leaves."""
    return (
        *claims.reductions(once),
        *claims.reductions_from_as_bad(as_bad),
        claims.two_readings(once, twice),
        *tables.table_3_4(once),
        *tables.table_4_5(once),
        *tables.table_4_6(once),
        *claims.contradictions(cube.q),
    )
