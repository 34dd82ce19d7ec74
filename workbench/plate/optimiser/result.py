"""The result of the plate optimiser: the plate, its predicted error, and its margins."""

from dataclasses import dataclass, field, replace
from typing import final

import numpy as np
from jaxtyping import Float

from workbench.arm.inverse import solve as inverse
from workbench.arm.inverse.branch import margins
from workbench.base.types import Outcome, frozen
from workbench.plate.optimiser.candidates import Candidates, Neighbours, Setting
from workbench.plate.plate import Plate, Target
from workbench.plate.predicted_error import predicted_error
from workbench.plate.target_readings import assumptions, linearise_targets
from workbench.report.result_display import AbstractReported

NOTHING = frozen(np.zeros(0))
MAX_CLEARANCE = 0.5
"""Of a target, stated at most [m]."""


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class PlateDesign(AbstractReported):
    """A plate that was designed.

    Args:
        plate: Targets with the posture in which each is measured.
        cost: Predicted root mean square position error over the poses that matter [m].
        rotation: And rotation error [rad].
        start_cost: Cost of the given plate in its best branches, collisions or not; infinite if it
            has not as many reachable targets [m].
        clearance: Minimum distance of the arm from plate, table, blocks and itself at each target and during
            the retreat from it [m]; the probe against its own block does not count. Empty if unchecked.
        limit_margin: Minimum distance of a joint from its limits at each target [rad or m].
        spacing: Minimum distance of two targets on the plate [m].
        assumptions: What these errors include: instrument, making, and play in the seats.
        narrowed: The margins that it keeps where the usual ones left no plate, and why; else empty.
        notes: What else is worth knowing, one sentence each.
    """

    plate: Plate
    cost: float
    rotation: float
    start_cost: float
    clearance: Float[np.ndarray, " targets"] = field(default_factory=lambda: NOTHING)
    limit_margin: Float[np.ndarray, " targets"] = field(default_factory=lambda: NOTHING)
    spacing: float = np.inf
    assumptions: str = ""
    outcome: Outcome = Outcome.CONVERGED
    narrowed: str = ""
    notes: tuple[str, ...] = ()

    @property
    def gain(self) -> float:
        """How many times smaller the predicted error is than the given plate's."""
        return self.start_cost / self.cost


def describe(
    setting: Setting, targets: Candidates, *, goal: Float[np.ndarray, "rows n"], **fields
) -> PlateDesign:
    """The design of chosen targets, with all its margins measured.

    Args:
        goal: Joint positions of poses that matter [rad or m].
        fields: The other fields of the design.
    """
    robot, plate = setting.robot, _plate(setting, targets)
    rows = linearise_targets(robot, plate, targets.q, names=setting.names, sigma=setting.sigma)
    error, every = predicted_error(rows, robot, goal), range(len(targets))
    near, xy = Neighbours(setting, targets), targets.places[:, :2]
    around = [setting.around(stops).min() for stops in targets.placements]
    clear = [min(MAX_CLEARANCE, gap, *(near.gap(i, j) for j in every)) for i, gap in enumerate(around)]
    gaps = np.linalg.norm(xy[:, None] - xy[None], axis=2) + np.diag(np.full(len(xy), np.inf))
    return PlateDesign(
        plate=plate,
        assumptions=assumptions(plate, setting.sigma),
        cost=error.position_rms,
        rotation=error.rotation_rms,
        clearance=frozen(np.array(clear)),
        limit_margin=frozen(margins(targets.q, robot.limits).min(1)),
        spacing=float(gaps.min(initial=np.inf)),
        **fields,
    )


def _plate(setting: Setting, targets: Candidates) -> Plate:
    """The plate, each target in the branch in which its posture lies."""
    results = inverse.solve_many(setting.robot, setting.robot.base.pose @ targets.poses)
    nearest = [inverse.nearest_branch(r, q) for r, q in zip(results, targets.q, strict=True)]
    names = [str(old) if b is None else b.name for b, old in zip(nearest, targets.branches, strict=True)]
    made = [
        Target.at(pose, branch=branch, q=frozen(q.copy()), kind=setting.kind)
        for pose, q, branch in zip(targets.poses, targets.q, names, strict=True)
    ]
    return replace(setting.plate, name=f"{setting.plate.name}, optimised", targets=tuple(made))
