"""The ARIA paper done again: its tables, its ways of choosing poses, its comparison of Fig. 7.

    found = reproduce_aria(arms=100)
    found.findings          # printed and ours, one by one
    aria_output(found).write("aria")

The paper's numbers that come from the real arm have no counterpart: they are listed with that reason.
"""

from dataclasses import dataclass, replace

import numpy as np

import workbench as wb
from studies import aria_tables as tables
from studies.aria_arms import Acquisition, Comparison, Judges, compare_acquisitions
from studies.aria_claims import claims, clustering_claims
from studies.finding import Finding
from studies.output import Sheet
from workbench.arm.built_in_arms import load_robot
from workbench.arm.robot import Robot
from workbench.base.errors import OptionError
from workbench.base.progress import part_of, progress
from workbench.data.prediction import RowComponents
from workbench.data.simulation.instruments import INSTRUMENTS
from workbench.data.simulation.simulate import simulate_targets
from workbench.extras.poses.choose_poses import choose_poses
from workbench.extras.poses.clustering import Clustering, cluster_region
from workbench.plate.plate import Plate
from workbench.plate.plate_toml import load_plate
from workbench.plate.poses.sampling import random_poses
from workbench.plate.region_poses import plate_region_poses

ARMS = 100
"""Virtual arms of the comparison with noise."""
EXACT_ARMS = 10
"""And of the one without noise, where all arms are found again to rounding."""
SIDE = 0.1
"""Side L of the cubes [m]."""
ANYWHERE = 300
"""Random joint positions that stand for the whole joint space."""


@dataclass(frozen=True, eq=False, kw_only=True)
class AriaReproduction:
    """The paper done again: Fig. 7 without noise (exact), as in the paper, and with a plate's noise.

    Errors on Table 4 are Fig. 11's, of a virtual arm with its constants: nominal, then each algorithm.
    """

    robot: Robot
    plate: Plate
    arms: int
    seed: int
    findings: tuple[Finding, ...]
    sheets: tuple[Sheet, ...]
    clustering: Clustering
    exact: tuple[Comparison, ...]
    noisy: tuple[Comparison, ...]
    on_table_4: tuple[RowComponents, ...]


def reproduce_aria(*, arms: int = ARMS, seed: int = 0) -> AriaReproduction:
    """Do the paper again on virtual arms."""
    if arms < 1:
        raise OptionError(f"arms must be at least 1, got {arms}", option="arms", found=arms)
    robot, plate = load_robot("aria"), load_plate("table2")
    with part_of(0.0, 0.1, "choosing poses"):
        clustering = cluster_region(robot, replace(plate.region, cube=SIDE), seed=seed)
    methods = acquisitions(robot, plate, clustering, seed)
    tool = methods[2]
    rng = np.random.default_rng(seed)
    judges = Judges(plate_region_poses(robot, plate), random_poses(robot, ANYWHERE, rng=rng))
    few = min(arms, EXACT_ARMS)

    def compared(instrument: str, count: int, begin: float, share: float) -> tuple[Comparison, ...]:
        with part_of(begin, share):
            return compare_acquisitions(
                robot, methods, INSTRUMENTS[instrument], judges, arms=count, seed=seed
            )

    exact, noisy = compared("ideal", few, 0.1, 0.1), compared("plate", arms, 0.2, 0.7)
    progress(0.9, "comparing with the printed numbers")
    *real, on_table_4 = tables.real_example(robot, tool)
    parts = (
        (tables.nominal(robot), None),
        (tables.requirement(), None),
        (tables.jacobian(robot, tool.q), None),
        tables.tool(robot, plate, tool.q),
        (clustering_claims(clustering, robot, plate), None),
        tables.virtual_example(robot, tool),
        (claims(exact, noisy), None),
        tuple(real),
    )
    return AriaReproduction(
        robot=robot,
        plate=plate,
        arms=arms,
        seed=seed,
        findings=tuple(finding for findings, _ in parts for finding in findings),
        sheets=tuple(sheet for _, sheet in parts if sheet is not None),
        clustering=clustering,
        exact=exact,
        noisy=noisy,
        on_table_4=on_table_4,
    )


def acquisitions(
    robot: Robot, plate: Plate, clustering: Clustering, seed: int
) -> tuple[Acquisition, Acquisition, Acquisition, Acquisition]:
    """The paper's three ways of §4.1.2 to 4.3, and Table 2 in the mix of branches that tells most."""
    standard = choose_poses(robot, len(plate), index="O", seed=seed).q
    rng = np.random.default_rng(seed)
    one_branch = simulate_targets(robot, plate.poses, instrument=INSTRUMENTS["ideal"], rng=rng).q
    return (
        Acquisition(name="standard", title="standard: eqs. (17), (18)", q=standard),
        Acquisition(
            name="clustering",
            title="workspace clustering",
            q=clustering.best.q,
            imposed=clustering.plate().poses,
        ),
        Acquisition(name="arbitrary", title="arbitrary choice: Table 2", q=one_branch, imposed=plate.poses),
        Acquisition(
            name="mixed",
            title="Table 2, branches mixed (ours)",
            q=wb.score(robot, plate, seed=seed).measured.q,
            imposed=plate.poses,
        ),
    )
