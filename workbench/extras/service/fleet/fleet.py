"""Many arms over time: which one is worst, which joint wears, when to measure again."""

from collections.abc import Sequence
from dataclasses import replace
from datetime import timedelta
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

import workbench.extras.service.fleet.report  # noqa: F401 how results are shown
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base.arguments import Length, Like
from workbench.base.errors import OptionError
from workbench.base.parallel import spread
from workbench.data.arguments import RobotLike
from workbench.data.simulation.hidden_effects import varied_state
from workbench.extras.service.fleet.history import History, Unread, arms_of, read_histories, values_of
from workbench.extras.service.fleet.movement import Movement, movements, scatter_factor, threshold
from workbench.extras.service.fleet.result import ArmReport, Fleet
from workbench.plate.poses.sampling import random_poses
from workbench.report.result_display import plot_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PIECE = 8
"""Arms that a worker reads at a time."""
ALLOWED = 1e-4
"""Displacement of the tool by a drift after which to measure again, by default [m]."""
POSES = 40
"""Poses over which the tool's displacement is averaged."""
SAFE_ERRORS = 1.645
"""Standard errors by which a rate is taken larger, to be on the safe side."""
MAX_DAYS_AHEAD = 3650
"""Days beyond which no date is named."""


def compare_fleet(
    folder: Path | str,
    *,
    robot: RobotLike | None = None,
    allowed: Like[Length] = ALLOWED,
    workers: int | None = None,
    scheduler: str | None = None,
) -> Fleet:
    """Compare the calibrations of one or many arms over time.

    The numbers do not depend on how many workers there are, or where; those of a cluster must see the folder
    under the same name.

    Args:
        folder: ARM/DATE.toml or ARM/DATE.csv, or DATE.… of a single arm; see `history`.
        robot: Nominal arm, with which measurements are identified.
        allowed: Displacement of the tool by a drift after which to measure again [m].
        workers: Processes on this machine; as many as it has cores if None.
        scheduler: Address of a Dask scheduler.

    Raises:
        FileError: no folder, or nothing in it.
        OptionError: no scheduler answers, no workers, or `allowed` is not positive.
    """
    if allowed <= 0.0:
        raise OptionError(
            f"the allowed displacement must be positive, got {1e3 * allowed:g} mm",
            option="allowed",
            found=allowed,
        )
    files = [(name, tuple(path.absolute() for path in paths)) for name, paths in arms_of(folder).items()]
    pieces = [(files[i : i + PIECE], robot) for i in range(0, len(files), PIECE)]
    read = spread(read_histories, pieces, workers=workers, scheduler=scheduler, text="reading files")
    found = [arm for piece in read for arm in piece]
    histories = [arm for arm in found if isinstance(arm, History)]
    factor, minimum = scatter_factor(histories), threshold(histories)
    return Fleet(
        arms=tuple(_report(h, movements(h, factor=factor, minimum=minimum), allowed) for h in histories),
        unread=tuple(arm for arm in found if isinstance(arm, Unread)),
        factor=factor,
        minimum=minimum,
        allowed=allowed,
    )


def _report(history: History, moved: Sequence[Movement], allowed: float) -> ArmReport:
    """An arm's movements with what they do to its tool."""
    if not moved:
        return ArmReport(history=history, moved=(), tool=0.0, again=None)
    rng = np.random.default_rng(0)
    at = varied_state(history.robot, random_poses(history.robot, POSES, rng=rng), rng=rng)
    shifts = {m.name: m.shift for m in moved}
    fast = {m.name: m.rate * (1.0 + SAFE_ERRORS * m.std / abs(m.shift)) for m in moved if m.rate != 0.0}
    span = max(float(history.days[-1]), 1.0)
    rate = _displacement(history.robot, at, {name: span * value for name, value in fast.items()}) / span
    left = allowed / rate if rate > 0.0 else np.inf
    return ArmReport(
        history=history,
        moved=tuple(replace(m, tool=_displacement(history.robot, at, {m.name: m.shift})) for m in moved),
        tool=_displacement(history.robot, at, shifts),
        again=history.dates[-1] + timedelta(days=int(left)) if left < MAX_DAYS_AHEAD else None,
    )


def _displacement(robot: Robot, at: Motion, shifts: dict[str, float]) -> float:
    """Root mean square displacement of the tool by changes of constants [m]."""
    now = zip(shifts, values_of(robot, shifts), strict=True)
    before = robot.with_values({n: value - shifts[n] for n, value in now})
    moved = robot.predict(at)[:, :3, 3] - before.predict(at)[:, :3, 3]
    return float(np.sqrt((moved**2).sum(1).mean()))


@plot_of.register(Fleet)
def _figure(fleet: Fleet, arm: str | None = None) -> "Figure":
    from workbench.extras.service.fleet.page import fleet_figure

    return fleet_figure(fleet, arm)
