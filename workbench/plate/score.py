"""The score of a plate: information of its targets about the arm, each measured once, and the predicted
error.

Two sets are scored: the targets in the branches to be measured (those in the plate's file, or the mix with
the smallest predicted error), and in the best single branch for all of them. A target that the arm can't
reach, or where it would collide with plate or blocks, can't be measured and is ignored.
"""

from collections.abc import Sequence
from functools import partial

import numpy as np
from jaxtyping import Float, Int

import workbench.plate.report.plates  # noqa: F401 how results are shown
from workbench.arm.robot import Robot
from workbench.base.arguments import Like, Seed, Sigma, checked_arguments
from workbench.base.errors import OptionError
from workbench.base.threads import one_thread
from workbench.base.types import frozen
from workbench.data.arguments import RobotLike
from workbench.plate.arguments import PlateLike
from workbench.plate.free_constants import identified_names, visible, visible_basis, visible_weight
from workbench.plate.observability import INDICES, I, O
from workbench.plate.plate import Plate
from workbench.plate.plate_score import PlateScore, SetScore
from workbench.plate.predicted_error import position_weight, predicted_error, rise_without_each
from workbench.plate.region_poses import plate_region_poses
from workbench.plate.target_branches import choose_branches, measurable, single_branches
from workbench.plate.target_readings import linearise_targets, sigma_of, usual_kind


def set_score(
    robot: Robot,
    plate: Plate,
    q: Float[np.ndarray, "rows n"],
    branches: Sequence[str | None],
    targets: Int[np.ndarray, " rows"],
    *,
    q_region: Float[np.ndarray, "poses n"],
    names: tuple[str, ...],
    sigma: tuple[float, float],
) -> SetScore:
    """The score of one row of joint positions for each of some targets; the others don't count.

    Args:
        q_region: Poses for which the error is predicted [rad or m]; without any it stays unknown.
        names: What is identified.
        sigma: Standard deviations of the instrument [m], [rad]; the production of the plate comes on top.
    """

    def spread(values: np.ndarray) -> np.ndarray:
        every = np.full((len(plate), *values.shape[1:]), np.nan)
        every[targets] = values
        return frozen(every)

    named = dict(zip(targets.tolist(), branches, strict=True))
    basis = visible_basis(robot, names)
    whole = linearise_targets(robot, plate, q, slots=targets, names=names, sigma=sigma)
    seen, is_own = visible(whole, basis), names == robot.default_free
    arm = whole if is_own else linearise_targets(robot, plate, q, slots=targets)  # O is of its own constants
    per_target, rises = O().per_pose(arm), np.full(len(q), np.nan)
    error, is_known = predicted_error(whole, robot, q_region), len(q_region) > 0
    indices = {name: index.value(seen) for name, index in INDICES.items() if name != O.name}
    indices = {O.name: float(per_target.mean()) if len(q) else 0.0, **indices}
    if is_known:
        weight = visible_weight(position_weight(robot, q_region, names, whole.weights), basis)
        rises = rise_without_each(seen, weight / np.outer(seen.weights, seen.weights))
        indices[I.name] = I(weight).value(seen)
    unseen = seen.unidentifiable if basis is None else basis @ seen.unidentifiable
    return SetScore(
        q=spread(q),
        branches=tuple(named.get(i) or "" for i in range(len(plate))),
        per_target=spread(per_target),
        rises=spread(rises),
        indices=indices,
        rank=seen.rank(),
        visible=len(seen.names),
        names=names,
        open=frozen(unseen * whole.weights[:, None]),
        error=error,
        position=error.position_rms if is_known else np.nan,
        rotation=error.rotation_rms if is_known else np.nan,
        linearisation=whole,
        arm=arm,
    )


@checked_arguments()
@one_thread()
def score(
    robot: RobotLike,
    plate: PlateLike,
    *,
    sigma: Like[Sigma] | None = None,
    base: bool | None = None,
    tool: bool | None = None,
    evaluation_poses: Float[np.ndarray, "rows n"] | None = None,
    seed: Seed = 0,
) -> PlateScore:
    """Score a plate for an arm, target by target and as a set.

    Args:
        robot: Nominal arm.
        plate: Its targets and region.
        sigma: Standard deviations of the instrument, position [m] and rotation [rad]; typical ones of what is
            read at the targets if None.
        base: Whether the base is unknown and identified too; as the robot says if None.
        tool: Whether the tool is.
        evaluation_poses: For which the error is predicted [rad or m]; those of the plate's region if None.
        seed: Of the mixes of branches that are tried.
    """
    if evaluation_poses is not None and not (len(evaluation_poses) and np.isfinite(evaluation_poses).all()):
        text = "evaluation_poses must be at least one row of finite joint positions"
        raise OptionError(text, option="evaluation_poses", found=evaluation_poses)
    sigma, rng = sigma_of(usual_kind(plate), sigma), np.random.default_rng(seed)
    names, can = identified_names(robot, base=base, tool=tool), measurable(robot, plate)
    q_region = plate_region_poses(robot, plate) if evaluation_poses is None else evaluation_poses
    choose = partial(choose_branches, names=names, sigma=sigma)
    choice = choose(robot, can.plate, can.solutions, goal=q_region, rng=rng)
    scored = partial(set_score, robot, plate, targets=can.rows, q_region=q_region, names=names, sigma=sigma)
    alike = min(choice.single, key=choice.single.__getitem__, default="")
    single = single_branches(can.solutions).get(alike)
    return PlateScore(
        plate=plate,
        robot=robot,
        measured=scored(choice.q, choice.branches),
        single=None if single is None else scored(single, (alike,) * len(can.rows)),
        sigma=sigma,
        can=can,
        outcome=choice.outcome,
    )
