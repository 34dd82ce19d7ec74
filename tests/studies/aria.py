"""The ARIA paper done again: its tables, its ways of choosing poses, its comparison of Fig. 7.

    found = reproduce_aria(arms=100)
    found.findings          # printed and ours, one by one

The paper's numbers that come from the real arm have no counterpart: they are listed with that reason.
"""

from dataclasses import dataclass, replace

import numpy as np

import workbench as wb
from studies import aria_tables as tables
from studies.aria_arms import Acquisition, Comparison, compare_acquisitions
from studies.aria_claims import claims, clustering_claims
from studies.finding import Finding
from workbench import Plate, Robot, load_plate, load_robot
from workbench.base.errors import OptionError
from workbench.base.progress import part_of, progress
from workbench.data.simulation.instruments import INSTRUMENTS
from workbench.extras.poses.choose_poses import choose_poses
from workbench.extras.poses.clustering import Clustering, cluster_region
from workbench.plate.region_poses import plate_region_poses
from workbench.plate.target_branches import plate_solutions

ARMS = 100
"""Virtual arms of the comparison with noise."""
EXACT_ARMS = 10
"""And of the one without noise, where all arms are found again to rounding."""
SIDE = 0.1
"""Side L of the cubes [m]."""


@dataclass(frozen=True, eq=False, kw_only=True)
class AriaReproduction:
    """The paper done again: Fig. 7 without noise (exact), as in the paper, and with a plate's noise."""

    findings: tuple[Finding, ...]
    clustering: Clustering
    exact: tuple[Comparison, ...]
    noisy: tuple[Comparison, ...]


def reproduce_aria(*, arms: int = ARMS, seed: int = 0) -> AriaReproduction:
    """Do the paper again on virtual arms."""
    if arms < 1:
        raise OptionError(f"arms must be at least 1, got {arms}", option="arms", found=arms)
    robot, plate = load_robot("aria"), load_plate("table2")
    with part_of(0.0, 0.1, "choosing poses"):
        clustering = cluster_region(robot, replace(plate.region, cube=SIDE), seed=seed)
    methods = acquisitions(robot, plate, clustering, seed)
    tool = methods[2]
    judges = plate_region_poses(robot, plate)
    few = min(arms, EXACT_ARMS)

    def compared(instrument: str, count: int, begin: float, share: float) -> tuple[Comparison, ...]:
        with part_of(begin, share):
            return compare_acquisitions(
                robot, methods, INSTRUMENTS[instrument], judges, arms=count, seed=seed
            )

    exact, noisy = compared("ideal", few, 0.1, 0.1), compared("plate", arms, 0.2, 0.7)
    progress(0.9, "comparing with the printed numbers")
    findings = (
        *tables.nominal(robot),
        *tables.requirement(),
        *tables.jacobian(robot, tool.q),
        *tables.tool(robot, plate, tool.q),
        *clustering_claims(clustering, robot, plate),
        *tables.virtual_example(robot, tool),
        *claims(exact, noisy),
        *tables.real_example(robot, tool),
    )
    return AriaReproduction(findings=findings, clustering=clustering, exact=exact, noisy=noisy)


def acquisitions(
    robot: Robot, plate: Plate, clustering: Clustering, seed: int
) -> tuple[Acquisition, Acquisition, Acquisition, Acquisition]:
    """The paper's three ways of §4.1.2 to 4.3, and Table 2 in the mix of branches that tells most."""
    standard = choose_poses(robot, len(plate), index="O", seed=seed).q
    branches = [{branch.name: branch for branch in own} for own in plate_solutions(robot, plate)]
    shared = set.intersection(*map(set, branches))
    best = max(sorted(shared), key=lambda name: min(own[name].margin for own in branches))
    one_branch = np.stack([own[best].q for own in branches])
    return (
        Acquisition(title="standard: eqs. (17), (18)", q=standard),
        Acquisition(title="workspace clustering", q=clustering.best.q, imposed=clustering.plate().poses),
        Acquisition(title="arbitrary choice: Table 2", q=one_branch, imposed=plate.poses),
        Acquisition(
            title="Table 2, branches mixed (ours)",
            q=wb.score(robot, plate, seed=seed).measured.q,
            imposed=plate.poses,
        ),
    )
