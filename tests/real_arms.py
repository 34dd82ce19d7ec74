"""The measured arms beside the project: how they are read, and how their rows are divided.

robot, data = load(folder, "panda_3")       # directions of motion derived on the whole file
for train, held in splits(data, count=5):   # whole groups, where the data have them
"""

from argparse import ArgumentTypeError
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from workbench import Dataset, Robot, load_robot, read_measurements
from workbench.data.measuring_order import with_directions

SETS = {
    "ur10": ("ur10_ipa", "ur10"),
    "ur5": ("ur5_jacobi", "ur5"),
    "wam": ("wam_jacobi", "wam"),
    "panda_1": ("mukca/panda_1", "panda"),
    "panda_3": ("mukca/panda_3", "panda"),
    "iiwa14": ("mukca/kuka_14", "iiwa14"),
}
"""Folder and built-in arm of every set."""


def set_names(text: str) -> list[str]:
    """Names of sets from an option, commas between."""
    names = text.split(",")
    if unknown := [n for n in names if n not in SETS]:
        raise ArgumentTypeError(f"no set '{unknown[0]}'; choose from {', '.join(SETS)}")
    return names


def load(folder: Path, name: str) -> tuple[Robot, Dataset]:
    """An arm and all its rows.

    Args:
        folder: Where the sets are.
        name: One of `SETS`.
    """
    place, arm = SETS[name]
    robot = load_robot(arm)
    return robot, with_directions(read_measurements(folder / place / "measurements.csv", joints=robot.dof))


def folds(data: Dataset, seed: int = 0, count: int = 5) -> np.ndarray:
    """Which fold each row belongs to; whole groups."""
    groups = np.arange(len(data)) if data.group is None else np.unique(data.group, return_inverse=True)[1]
    order = np.random.default_rng(seed).permutation(groups.max() + 1)
    return (np.argsort(order) % count)[groups]


def splits(data: Dataset, seed: int = 0, count: int = 5) -> Iterator[tuple[Dataset, Dataset]]:
    """Rows to fit and rows held out, fold by fold."""
    fold = folds(data, seed, count)
    for k in range(count):
        yield data.take(fold != k), data.take(fold == k)


def plane(data: Dataset, folder: Path, x: float) -> tuple[Dataset, Dataset]:
    """Rows of the UR10's grid to fit, and those of one plane of it held out.

    Args:
        data: All rows.
        folder: Where the sets are.
        x: Commanded place of the plane in the grid [m].
    """
    path = folder / SETS["ur10"][0] / "original" / "measurements_grid.csv"
    commanded = np.array(
        [float(r.split(";")[1].replace(",", ".")) for r in path.read_text().splitlines()[1:]]
    )
    held = np.abs(commanded - x) < 1e-3
    if not held.any():
        raise ValueError(f"no plane of the grid lies at x = {x} m; there is {np.unique(commanded.round(3))}")
    return data.take(~held), data.take(held)
