"""Touches: joint positions and the name of what was touched; finding those that slipped.

Each touch is left out in turn. The one whose numbers the others explain least is set apart where chance would
leave that much in one file of a hundred, by the F test of its numbers against what the others leave.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float
from scipy import special

from workbench.arm.frame import Frame
from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base.errors import DataError
from workbench.data.dataset import Dataset
from workbench.data.plausibility import refuse_joint_quantities, refuse_joint_units
from workbench.data.readers import read_measurements
from workbench.data.readers.assemble import joint_columns, joint_units
from workbench.data.readers.read import read_fields

CHANCE = 0.01
"""Probability of setting a good touch apart in a file without bad ones."""
MAX_SHARE_APART = 0.25
"""Share of the touches that may be set apart."""
EXACT = 1e-7
"""Scatter below which touches agree exactly [m]."""
SCATTERED = 0.01
"""Scatter, as a part of the reach, that no point explains."""
LEVEL = 0.95
"""Probability of the intervals that are shown."""


@dataclass(frozen=True, eq=False)
class Touches:
    """Joint positions at which something was touched.

    Args:
        names: What was touched, one a row; empty where the file does not say.
        rows: Number of each in its file, counted from 0.
    """

    q: Float[np.ndarray, "rows n"]
    names: tuple[str, ...]
    rows: tuple[int, ...]
    source: str

    def __len__(self) -> int:
        return len(self.q)

    def flanges(self, robot: Robot) -> Float[np.ndarray, "rows 4 4"]:
        """Poses of the flange in the robot's base."""
        return tool_poses(robot.with_frames(base=Frame(), tool=Frame()), Motion(self.q))

    def tips(self, robot: Robot) -> Float[np.ndarray, "rows 3"]:
        """Positions of the tool's tip in the robot's base [m]."""
        return tool_poses(robot.with_frames(base=Frame()), Motion(self.q))[:, :3, 3]


def read_touches(source: Path | Dataset, robot: Robot) -> Touches:
    """Touches of a file that needs no more than joints; `contact` (or `point`) names what was touched."""
    if isinstance(source, Dataset):
        robot.check_joints(source.q, source.source)
        names = source.contact if source.contact is not None else source.point
        kept, q, rows = source.included, source.q, source.row
        where, units = source.source, source.joint_units
    else:
        fields = read_fields(source)
        q, where, units = joint_columns(fields, robot.dof), str(source), joint_units(fields)
        names = fields.values.get("contact", fields.values.get("point"))
        kept, rows = np.isfinite(q).all(1), np.arange(len(q))
        if "exclude" in fields.values:
            kept = kept & read_measurements(source, joints=robot.joint_names).included
    if not kept.any():
        raise DataError(f"{where}: there is no touch; give joint positions (q1[deg] …), one touch a line")
    refuse_joint_quantities(units, robot, where)
    refuse_joint_units(q[kept], robot.limits, where)
    labels = [""] * len(q) if names is None else [str(name).strip() for name in names]
    chosen = np.flatnonzero(kept)
    return Touches(q[chosen], tuple(labels[k] for k in chosen), tuple(int(rows[k]) for k in chosen), where)


def slipped(
    square: Callable[[Sequence[int]], tuple[float, int]], count: int, *, maximum: float = MAX_SHARE_APART
) -> tuple[list[int], list[int]]:
    """Touches that agree, and those that do not, the worst first.

    Args:
        square: Squared residuals that a fit of some touches leaves [m²], and its numbers to spare; a
            negative count where they don't determine the fit.
        count: How many touches there are.
        maximum: Share of them that may be set apart.
    """
    kept, apart = list(range(count)), list[int]()
    while len(apart) < int(maximum * count + 1e-9):
        whole, spare = square(kept)
        tests = []
        for each in kept:
            left, fewer = square([k for k in kept if k != each])
            own = spare - fewer
            if fewer >= 1 and own >= 1:
                ratio = max(whole - left, 0.0) / own / (max(left, fewer * EXACT**2) / fewer)
                tests.append((float(special.fdtrc(own, fewer, ratio)), each))
        if not tests or min(tests)[0] * len(tests) > CHANCE:
            break
        worst = min(tests)[1]
        kept.remove(worst)
        apart.append(worst)
    return kept, apart


def half_width(square: float, spare: int) -> float:
    """Half of the 95 % interval of a number of unit weight: Student's; infinite where nothing is to spare."""
    if spare < 1:
        return np.inf
    return float(np.sqrt(max(square, spare * EXACT**2) / spare) * special.stdtrit(spare, 0.5 + 0.5 * LEVEL))


def numbered(touches: Touches, which: Sequence[int]) -> str:
    """`touch 4`, `touches 2, 5`, counted from 1 as in the file."""
    numbers = ", ".join(str(touches.rows[k] + 1) for k in which)
    return f"touch{'es' if len(which) > 1 else ''} {numbers}"
