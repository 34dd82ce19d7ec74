"""Touches: joint positions and the name of what was touched; finding those that slipped.

Each touch is left out in turn, then any two, three …. Those whose numbers the others explain worst are set
aside where chance would leave that much in one file of a hundred, by the F test of their numbers against what
the others leave.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations
from math import comb
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy import special

from workbench.arm.frame import Frame
from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base.arguments import Like
from workbench.base.errors import DataError, OptionError
from workbench.data.dataset import Dataset
from workbench.data.plausibility import refuse_joint_units
from workbench.data.readers.assemble import assemble
from workbench.data.readers.read import read_fields
from workbench.identification.report.results_json import reading_json
from workbench.report.blocks import Block, ResultTable, headed, lines
from workbench.report.json import Json, document

Touches = Path | Like[Dataset]
CHANCE = 0.01
"""Probability of setting a good touch aside in a file without bad ones."""
MAX_SHARE_SLIPPED, MAX_TRIED = 0.25, 1000
"""Share of the touches that may be set aside, and number of ways to set as many aside."""
EXACT_SCATTER = 1e-7
"""Scatter below which touches agree exactly [m]."""
SCATTERED = 0.01
"""Scatter, as a part of the reach, that no point explains."""
NOMINAL = "no calibration is on record for this arm: if it is nominal, its own errors add, often 1 mm"


def names_of(touches: Dataset) -> tuple[str, ...]:
    """What was touched, one a row; empty where the file has none."""
    return ("",) * len(touches) if touches.contact is None else tuple(map(str, touches.contact))


def flanges(robot: Robot, q: Float[np.ndarray, "rows n"]) -> Float[np.ndarray, "rows 4 4"]:
    """Poses of the flange in the robot's base."""
    return tool_poses(robot.with_frames(base=Frame(), tool=Frame()), Motion(q))


def read_touches(source: Path | Dataset, robot: Robot, columns: str | None, wanted: float | None) -> Dataset:
    """Touches of a file of joints; `contact` (or `point`) names what was touched; `wanted` is positive."""
    if wanted is not None and not wanted > 0.0:
        raise OptionError(f"wanted must be positive, got {wanted:g} m", option="wanted", found=wanted)
    if not isinstance(source, Dataset):
        fields = read_fields(source, columns=columns, joints=robot)
        source = assemble(fields, joints=robot, beside={"touch": np.zeros(fields.rows)})
    kept, where = source.said.take(source.included), source.source
    robot.check_joints(kept.q, where)
    if not len(kept):
        raise DataError(f"{where}: there is no touch; give joint positions (q1[deg] …), one touch a line")
    refuse_joint_units(robot, kept.q, kept.joint_units, where)
    names = kept.point if kept.contact is None else kept.contact
    labels = None if names is None else np.char.strip(names)
    return Dataset(kept.q, row=kept.row, contact=labels, source=where)


@dataclass(frozen=True, eq=False)
class TouchSolution:
    """What some touches determine.

    Args:
        left: What it leaves of their numbers [m].
        covariance: For numbers of unit variance.
    """

    x: np.ndarray
    left: Float[np.ndarray, " numbers"]
    covariance: Float[np.ndarray, "p p"]

    @property
    def spare(self) -> int:
        """Numbers beyond those that are needed."""
        return len(self.left) - len(self.covariance)

    def chance(self, freer: "TouchSolution") -> float:
        """How often chance leaves so much more than a solution with fewer touches or more unknowns."""
        own, left = self.spare - freer.spare, float(freer.left @ freer.left)
        more = max(float(self.left @ self.left) - left, 0.0)
        ratio = more / own / (max(left, freer.spare * EXACT_SCATTER**2) / freer.spare)
        return float(special.fdtrc(own, freer.spare, ratio))

    @property
    def half(self) -> Float[np.ndarray, " p"]:
        """Half of the 95 % intervals, Student's; infinite where no number is to spare."""
        if self.spare < 1:
            return np.full(len(self.covariance), np.inf)
        variance = max(float(self.left @ self.left), self.spare * EXACT_SCATTER**2) / self.spare
        return special.stdtrit(self.spare, 0.975) * np.sqrt(variance * np.abs(np.diag(self.covariance)))


def solve_without_slipped(
    solve: Callable[[list[int]], TouchSolution | None], count: int, refusal: str
) -> tuple[TouchSolution, tuple[int, ...]]:
    """The solution of the touches that agree, and those that slipped, the worst first.

    Args:
        solve: The solution of some touches; None where they don't determine it.
        count: How many touches there are.
        refusal: Message if all together don't.
    """
    kept, slipped = list(range(count)), list[int]()
    if (whole := solve(kept)) is None:
        raise DataError(refusal)
    size, most = 1, int(MAX_SHARE_SLIPPED * count + 1e-9)
    while len(slipped) + size <= most and comb(len(kept), size) <= MAX_TRIED:
        tests = []
        for some in combinations(kept, size):
            rest = solve([k for k in kept if k not in some])
            if rest is not None and 1 <= rest.spare < whole.spare:
                tests.append((whole.chance(rest), some, rest))
        if not tests or min(tests, key=lambda t: t[:2])[0] * len(tests) > CHANCE:
            size += 1  # as several hide each other
            continue
        _, worst, whole = min(tests, key=lambda t: t[:2])
        kept, size = [k for k in kept if k not in worst], 1
        slipped += worst
    return whole, tuple(slipped)


@dataclass(frozen=True, eq=False)
class TouchErrors:
    """What each touch is off.

    Args:
        robot: The arm that touched.
        errors: Distances from where the solution has them [m].
        slipped: Touches that were left out, the worst first.
    """

    robot: Robot
    touches: Dataset
    errors: Float[np.ndarray, " rows"]
    slipped: tuple[int, ...]

    @property
    def scatter(self) -> float:
        """Root mean square of those that count [m]."""
        return float(np.sqrt((np.delete(self.errors, self.slipped) ** 2).mean()))

    @property
    def notes(self) -> tuple[str, ...]:
        """What else should be known, one sentence each."""
        return (*self.touches.notes, *[NOMINAL] * (self.robot.calibration is None))

    @property
    def _each(self) -> list[dict[str, Any]]:
        slipped = [k in self.slipped for k in range(len(self.errors))]
        each = zip(self.touches.row, names_of(self.touches), self.errors, slipped, strict=True)
        return [dict(zip(("row", "name", "error", "slipped"), one, strict=True)) for one in each]

    def blocks(self, sentence: str, *more: Block) -> list[Block]:
        """The result's sentence, each touch, what else was found, and notes."""
        cells = [
            (str(t["row"] + 1), t["name"], f"{1e3 * t['error']:.3f}", "slipped, left out" * t["slipped"])
            for t in self._each
        ]
        table = ResultTable("Touches", ("touch", "of", "off by [mm]", ""), cells, words=2)
        which = f"touch{'es' * (len(self.slipped) > 1)} {', '.join(cells[k][0] for k in self.slipped)}"
        slipped = [f"{which} slipped; left out"] * bool(self.slipped)
        title = f"{self.robot.name}: {sentence}"
        return headed(title, table, *more, *lines("warning", slipped), notes=self.notes)

    def json(self, schema: str, message: str, **found: Any) -> Json:
        said = {"message": message, "scatter": self.scatter, "robot": self.robot.name, **found}
        return document(schema, **reading_json(self.touches), **said, touches=self._each, notes=[*self.notes])
