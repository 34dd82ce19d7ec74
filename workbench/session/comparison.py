"""Measured against predicted, row by row, in the frame of the robot's base: what the overlay shows.

Every session of measurements may have its own base and tool. The base of the shown fit (or, before there is
one, the nominal base) brings measured and predicted poses alike into the base's frame.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.types import frozen
from workbench.data.dataset import Dataset

STEPS = (1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0)
"""Exaggerations that are chosen by themselves."""
DRAWN_LENGTH = 0.12
"""Longest that a typical error is then drawn [m]."""


@dataclass(frozen=True, eq=False)
class Comparison:
    """All rows that can be looked at: fitted, then held out.

    Args:
        q: Joint positions [rad or m].
        number: Data row of each, counted from 0.
        held_out: Rows that were not fitted.
        measured: Measured positions [m]; NaN where none was measured.
        rotation: Measured orientations; None if none were measured.
        nominal: Poses that the nominal arm predicts, on the best base and with the best tool.
        calibrated: Poses that the calibrated arm predicts; None before there is one.
    """

    q: Float[np.ndarray, "rows n"]
    number: np.ndarray
    held_out: Bool[np.ndarray, " rows"]
    measured: Float[np.ndarray, "rows 3"]
    rotation: Float[np.ndarray, "rows 3 3"] | None
    nominal: Float[np.ndarray, "rows 4 4"]
    calibrated: Float[np.ndarray, "rows 4 4"] | None

    def __len__(self) -> int:
        return len(self.q)

    def errors(self, row: int) -> tuple[float, float]:
        """Position error of the nominal and of the calibrated arm [m]; NaN where unknown."""
        before = float(np.linalg.norm(self.measured[row] - self.nominal[row, :3, 3]))
        if self.calibrated is None:
            return before, np.nan
        return before, float(np.linalg.norm(self.measured[row] - self.calibrated[row, :3, 3]))


def exaggeration_for(comparison: Comparison) -> float:
    """A round factor that draws the nominal arm's typical error about as long as a hand is wide."""
    errors = np.linalg.norm(comparison.measured - comparison.nominal[:, :3, 3], axis=1)
    typical = np.nanmedian(errors) if np.isfinite(errors).any() else 0.0
    fitting = [step for step in STEPS if step * typical <= DRAWN_LENGTH]
    return max(fitting, default=STEPS[0])


def compare(
    data: Dataset,
    held_out: Bool[np.ndarray, " rows"],
    nominal: Robot,
    calibrated: Robot | None,
) -> Comparison:
    """Measured and predicted poses of all rows.

    Args:
        data: Fitted and held-out rows.
        held_out: Which of them were held out.
        nominal: The nominal arm, on its best base.
        calibrated: The calibrated arm, if there is one.
    """
    size = len(data)
    into_base, before, after = (np.tile(np.eye(4), (size, 1, 1)) for _ in range(3))
    for name in data.sessions:
        rows = np.arange(size) if data.session is None else np.flatnonzero(data.session == name)
        base = (calibrated or nominal).session_frames(name).base.pose
        into_base[rows] = se3.inverse(base)
        before[rows] = into_base[rows] @ _predicted(nominal, name, data.q[rows])
        if calibrated is not None:
            after[rows] = into_base[rows] @ _predicted(calibrated, name, data.q[rows])
    position = np.full((size, 3), np.nan) if data.position is None else data.position
    rotation = None if data.rotation is None else into_base[:, :3, :3] @ data.rotation
    return Comparison(
        q=data.q,
        number=data.row,
        held_out=frozen(held_out),
        measured=frozen(se3.apply(into_base, position)),
        rotation=None if rotation is None else frozen(rotation),
        nominal=frozen(before),
        calibrated=None if calibrated is None else frozen(after),
    )


def _predicted(robot: Robot, session: str, q: Float[np.ndarray, "rows n"]) -> Float[np.ndarray, "rows 4 4"]:
    frames = robot.session_frames(session)
    return tool_poses(robot.with_frames(base=frames.base, tool=frames.tool), q)


def joined(first: Dataset, second: Dataset | None) -> Dataset:
    """Joint positions and poses of two datasets of one kind; other columns of the second are dropped."""
    if second is None or not len(second):
        return first

    def both(name: str):
        a, b = getattr(first, name), getattr(second, name)
        return None if a is None or b is None else np.concatenate([a, b])

    names = ("position", "rotation", "session")
    return Dataset(
        q=np.concatenate([first.q, second.q]),
        row=np.concatenate([first.row, second.row + 1 + first.row.max(initial=-1)]),
        source=first.source,
        **{name: both(name) for name in names},
    )
