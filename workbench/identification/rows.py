"""Which rows a run uses, which it holds out, and what it says of those it leaves."""

from collections.abc import Mapping, Sequence

import numpy as np

from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import Frame, Robot
from workbench.base.errors import DataError, OptionError
from workbench.data.dataset import Dataset
from workbench.data.observations import OBSERVATIONS, ContactObservation, PlaneObservation
from workbench.data.observations.distance import DistanceObservation
from workbench.identification.errors import count_measured
from workbench.identification.holdout import split, split_sessions
from workbench.plate.region import Region

Excluded = list[tuple[int, str]]


def usable(data: Dataset) -> np.ndarray:
    """Rows that carry an observation which can be compared with a pose."""
    return np.any([kind.applies(data) for kind in OBSERVATIONS], axis=0)


def choose_rows(
    robot: Robot, data: Dataset, exclude: Mapping[int, str], region: Region | None
) -> tuple[np.ndarray, Excluded]:
    """Rows to use, and those kept out with their reasons.

    Raises:
        OptionError: a row to exclude that the data do not have.
        DataError: nothing is left.
    """
    keep = data.included.copy()
    excluded = [
        (int(data.row[i]), str(data.reason[i]) if data.reason is not None and data.reason[i] else "file")
        for i in np.flatnonzero(~keep)
    ]
    for row, reason in exclude.items():
        place = np.flatnonzero(data.row == row)
        if not len(place):
            raise OptionError(f"there is no row {row} to exclude; rows are 0 … {int(data.row.max())}")
        if keep[place[0]]:
            keep[place[0]] = False
            excluded.append((int(row), reason))
    nothing = keep & ~usable(data)
    if nothing.any() and not nothing[keep].all():
        excluded += [(int(r), "nothing was measured that shows the tool's pose") for r in data.row[nothing]]
        keep &= ~nothing
    if region is not None:
        outside = keep & ~inside(robot, data, region)
        excluded += [(int(r), "outside the region") for r in data.row[outside]]
        keep &= ~outside
    if not keep.any():
        raise DataError(f"{data.source}: every row is excluded or outside the region; nothing is left to fit")
    return np.flatnonzero(keep), excluded


def inside(robot: Robot, data: Dataset, region: Region) -> np.ndarray:
    """Rows whose nominal tool position lies in a region of the robot's base."""
    return region.contains(
        tool_poses(robot.with_frames(base=Frame()).with_effects(), Motion(data.q))[:, :3, 3]
    )


def divide(used: Dataset, held_out: float | Dataset | tuple[str, ...], seed: int):
    """Training rows and held-out rows of the used ones."""
    if isinstance(held_out, Dataset):
        return np.arange(len(used)), np.arange(0)
    if isinstance(held_out, tuple):
        return split_sessions(used, held_out)
    return split(used, held_out, rng=np.random.default_rng(seed))


def check_enough(robot: Robot, data: Dataset, free: Sequence[str] | None) -> None:
    """Refuse a fit of more parameters than measured numbers."""
    count = len(robot.default_free if free is None else free)
    measured = count_measured(data)
    if measured < count:
        need = int(np.ceil(count / (measured / len(data))))
        raise DataError(
            f"{data.source}: {len(data)} rows give {measured} numbers for {count} parameters of the "
            f"arm; measure at least {need} poses, hold fewer out, or free fewer parameters"
        )


def unused_observations(data: Dataset) -> list[str]:
    """Sentences on what rows carry beside the observation that is used."""
    left = np.ones(len(data), bool)
    words = []
    for kind in OBSERVATIONS:
        applies = kind.applies(data)
        beside = applies & ~left & (kind.unused_words != "")
        if beside.any():
            words.append(f"{int(beside.sum())} rows also carry {kind.unused_words}, which are not used there")
        left &= ~applies
    if all(not kind.sees_tool for kind in OBSERVATIONS if kind.applies(data).any()):
        words.append("only tilts of links were measured: errors of position are not known, and shown as 0")
    return words


KNOWN_SHARE = 0.2
"""Known lengths that are this share of all lengths of the arm give it its scale."""


def held_scale(robot: Robot, data: Dataset, free: Sequence[str], known: Mapping[str, float]) -> str | None:
    """The length that must be held because the rows show no scale: contacts with unknown places only.

    Shrinking arm and places together changes no contact, so a free fit ends in a point. Lengths of the arm
    that are known, such as that of a fixed last link, give the scale.
    """
    kinds = {kind for kind in OBSERVATIONS if kind.applies(data).any()}
    without_scale = bool(kinds) and kinds <= {ContactObservation, PlaneObservation}
    if not without_scale or any(n.startswith("contact[") for n in known):
        return None
    lengths = [e for e in robot.elements if e.unit == "m" and e.matrix is None]
    unknown = [e for e in lengths if e.name in free]
    total, open_ones = (sum(abs(e.value) for e in part) for part in (lengths, unknown))
    if not unknown or total - open_ones >= KNOWN_SHARE * total:
        return None
    return max(unknown, key=lambda e: abs(e.value)).name


def placed(data: Dataset, known: Mapping[str, float]) -> np.ndarray:
    """Rows whose anchor or contact has a known place; all rows of other observations."""
    keep = np.ones(len(data), bool)
    for kind, labels, word in (
        (DistanceObservation, data.anchor, "anchor"),
        (ContactObservation, data.contact, "contact"),
        (PlaneObservation, data.contact, "contact"),
    ):
        applies = kind.applies(data)
        if applies.any() and labels is not None:
            there = np.array([f"{word}[{label}].x" in known for label in labels])
            keep &= ~applies | there
    return keep
