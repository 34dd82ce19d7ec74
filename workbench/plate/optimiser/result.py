"""The result of the plate optimiser: the plate, its predicted error, and its margins."""

from dataclasses import dataclass, field, replace
from typing import final

import numpy as np
from jaxtyping import Float

from workbench.arm.inverse import solve as inverse
from workbench.arm.inverse.branch import margins
from workbench.base.types import Outcome, frozen
from workbench.plate.optimiser.candidates import Candidates, Neighbours, Setting
from workbench.plate.optimiser.target_blocks import SHAPE, Places, places_of, shapes_of
from workbench.plate.plate import Kind, Plate, Target
from workbench.plate.predicted_error import PredictedError, predicted_error
from workbench.plate.target_readings import linearise_reading
from workbench.report.result_display import AbstractReported

NOTHING = frozen(np.zeros(0))


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
        start_kept: Whether the given plate keeps all constraints.
        clearance: Minimum distance of the arm from plate, table, blocks and itself at each target and during
            the retreat from it [m]; the probe against its own block does not count.
        limit_margin: Minimum distance of a joint from its limits at each target [rad or m].
        spacing: Minimum distance of two targets on the plate [m].
        assumptions: What these errors include: instrument, making, and play in the seats.
        history: Criterion after every round of the search [m].
        narrowed: The margins that it keeps where the usual ones left no plate, and why; else empty.
        notes: What else is worth knowing, one sentence each.
    """

    plate: Plate
    cost: float
    rotation: float
    start_cost: float
    start_kept: bool = False
    clearance: Float[np.ndarray, " targets"] = field(default_factory=lambda: NOTHING)
    limit_margin: Float[np.ndarray, " targets"] = field(default_factory=lambda: NOTHING)
    spacing: float = np.inf
    assumptions: str = ""
    history: tuple[float, ...] = ()
    outcome: Outcome = Outcome.CONVERGED
    narrowed: str = ""
    notes: tuple[str, ...] = ()

    @property
    def gain(self) -> float:
        """How many times smaller the predicted error is than the given plate's."""
        return self.start_cost / self.cost

    @property
    def plate_shapes(self) -> int:
        mounted = self.plate.mounted
        places = places_of(self.plate, np.stack([target.pose for target in mounted]))
        places[[target.kind is not Kind.SEAT for target in mounted], SHAPE[-1]] = (
            0.0  # balls and points have none
        )
        return len(shapes_of(places))


def set_error(
    setting: Setting, q: Float[np.ndarray, "targets n"], places: Places, goal: Float[np.ndarray, "rows n"]
) -> PredictedError:
    """Predicted error over the goal after a calibration with targets in postures."""
    rows = linearise_reading(
        setting.robot, q, setting.reading, target_sigma=setting.sigma(places), names=setting.names
    )
    return predicted_error(rows, setting.robot, goal)


def branches_of(setting: Setting, targets: Candidates) -> list[str]:
    """Name of the branch that each posture lies in."""
    results = inverse.solve_many(setting.robot, setting.robot.base.pose @ targets.poses)
    nearest = [inverse.nearest_branch(r, q) for r, q in zip(results, targets.q, strict=True)]
    return [str(old) if b is None else b.name for b, old in zip(nearest, targets.branches, strict=True)]


def describe(
    setting: Setting, targets: Candidates, *, goal: Float[np.ndarray, "rows n"], **fields
) -> PlateDesign:
    """The design of chosen targets, with all its margins measured.

    Args:
        setting: What the search did not change.
        targets: The chosen ones.
        goal: Joint positions of poses that matter [rad or m].
        fields: The other fields of the design.
    """
    error, plate = set_error(setting, targets.q, targets.places, goal), _plate(setting, targets)
    near, blocks = Neighbours(setting, targets), range(len(targets) if setting.reading.blocks else 0)
    between = [[near.gap(i, j) for j in blocks] for i in range(len(targets))]
    around = [setting.around(stops).min() for stops in targets.placements]
    xy = targets.places[:, :2]
    gaps = np.linalg.norm(xy[:, None] - xy[None], axis=2) + np.diag(np.full(len(xy), np.inf))
    return PlateDesign(
        plate=plate,
        assumptions=f"{setting.reading.text}; {plate.assumptions}",
        cost=error.position_rms,
        rotation=error.rotation_rms,
        clearance=frozen(np.array([min([*row, own]) for row, own in zip(between, around, strict=True)])),
        limit_margin=frozen(margins(targets.q, setting.robot.limits).min(1)),
        spacing=float(gaps.min(initial=np.inf)),
        **fields,
    )


def _plate(setting: Setting, targets: Candidates) -> Plate:
    made = [
        Target.at(pose, branch=branch, q=frozen(q.copy()), kind=setting.reading.kind)
        for pose, q, branch in zip(targets.poses, targets.q, branches_of(setting, targets), strict=True)
    ]
    name = f"{setting.plate.name}, optimised"
    return replace(
        setting.plate,
        name=name,
        targets=tuple(made),
        production=setting.production,
        anchors=setting.reading.anchors,
    )
