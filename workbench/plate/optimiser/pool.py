"""Pool: many random blocks on a plate, in every branch that reaches them and keeps all constraints."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from workbench.arm.inverse import solve as inverse
from workbench.plate.optimiser.blocks import Blocks, Places, places_of, tool_poses_at
from workbench.plate.optimiser.candidates import Candidates, Setting
from workbench.plate.optimiser.search import Cancelled
from workbench.plate.plate import Plate

BATCH = 50
"""Places that are solved between two looks at `cancel`."""


class Ways(NamedTuple):
    """Postures at blocks.

    Args:
        slots: Block of each, counted from 0.
        places: That block.
        q: Joint positions [rad or m].
        branches: Names.
    """

    slots: np.ndarray
    places: Places
    q: np.ndarray
    branches: np.ndarray


class Pool(NamedTuple):
    """Candidates, and what became of the other ways.

    Args:
        candidates: Those that keep all constraints.
        kept: Which of all ways kept each constraint.
    """

    candidates: Candidates
    kept: dict[str, np.ndarray]


def draw_pool(
    setting: Setting,
    blocks: Blocks,
    half: np.ndarray,
    number: int,
    *,
    rng: np.random.Generator,
    progress: Callable[[float], None] | None = None,
    cancel: Callable[[], bool] | None = None,
) -> Pool:
    """Candidates from so many random blocks whose centres lie within ±half [m].

    Raises:
        Cancelled: asked to stop.
    """
    found: Candidates | None = None
    kept: dict[str, list[np.ndarray]] = {}
    done = 0
    while done < number:
        if cancel is not None and cancel():
            raise Cancelled
        places = blocks.draw(min(BATCH, number - done), half, rng=rng)
        ways = all_ways(setting, places)
        good, flags = setting.examine(ways.places, ways.q, ways.branches)
        found = good if found is None else found.join(good)
        for name, values in flags.items():
            kept.setdefault(name, []).append(values)
        done += len(places)
        if progress is not None:
            progress(done / number)
    assert found is not None
    return Pool(found, {name: np.concatenate(parts) for name, parts in kept.items()})


def all_ways(setting: Setting, places: Places) -> Ways:
    """Every branch within the joint limits at every block."""
    poses = setting.robot.base.pose @ tool_poses_at(setting.plate, places)
    results = inverse.solve_many(setting.robot, poses)
    slots = [i for i, result in enumerate(results) for _ in result.within_limits]
    branches = [branch for result in results for branch in result.within_limits]
    q = np.array([branch.q for branch in branches]).reshape(-1, setting.robot.dof)
    names = np.array([branch.name for branch in branches], dtype="U80")
    return Ways(np.array(slots, np.int64), places[slots], q, names)


def start_ways(setting: Setting, plate: Plate) -> Ways:
    """The ways of a plate that is already there; a target with joint positions has these alone."""
    ways = all_ways(setting, places_of(plate, plate.poses))
    keep = np.ones(len(ways.q), bool)
    for slot, target in enumerate(plate.targets):
        mine = np.flatnonzero(ways.slots == slot)
        if target.q is not None and len(mine):
            turns = np.abs(np.angle(np.exp(1j * (ways.q[mine] - target.q)))).max(1)
            keep[mine] = turns == turns.min()
    return Ways(*(part[keep] for part in ways))
