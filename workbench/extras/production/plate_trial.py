"""Trying a plate on virtual arms, as one call."""

from dataclasses import replace

import numpy as np

from workbench.arm.effects import AbstractEffect
from workbench.arm.robot import Robot
from workbench.base.arguments import Angle, Length, LengthAndAngle, Like, Seed, checked_arguments
from workbench.base.errors import DataError, OptionError
from workbench.base.progress import part_of
from workbench.base.threads import one_thread
from workbench.data.accuracy_requirement import Requirement
from workbench.data.arguments import RobotLike, WantedLike
from workbench.data.simulation.simulate import ANGLE_ERROR, MAX_LENGTH_ERROR
from workbench.extras.production.production_yield import ARMS, Yield, check_number, try_production
from workbench.extras.production.yield_inputs import ErrorSizes, YieldJob, constrained_by
from workbench.plate.arguments import PlateLike
from workbench.plate.plate import ANCHOR_SIGMA, Plate
from workbench.plate.poses.sampling import in_base
from workbench.plate.region_poses import plate_region_poses
from workbench.plate.target_branches import choose_branches, measurable
from workbench.plate.target_readings import assumptions, usual_sigma
from workbench.plate.tolerances import Production

JUDGED_POSES = 500
"""Poses of the tool in the region, in all their branches, at which arms are judged."""


@checked_arguments()
@one_thread()
def try_plate(
    robot: RobotLike,
    plate: PlateLike,
    *,
    arms: int = ARMS,
    sigma: Like[LengthAndAngle] | None = None,
    joint_sigma: float = 0.0,
    production: Production | None = None,
    undeclared: tuple[AbstractEffect, ...] = (),
    length: Like[Length] = MAX_LENGTH_ERROR,
    angle: Like[Angle] = ANGLE_ERROR,
    wanted: WantedLike | None = None,
    towards: PlateLike | None = None,
    poses: int = JUDGED_POSES,
    scheduler: str | None = None,
    seed: Seed = 0,
) -> Yield:
    """How many arms of a production run meet the requirement after a calibration with a plate.

    Args:
        robot: Nominal arm with limits.
        plate: Targets and region; targets without joint positions take the branches that tell most.
        arms: How many virtual arms.
        sigma: How well a target returns and is read: standard deviations [m], [rad]; usual ones of what is
            read at the targets if None.
        joint_sigma: Of the joint readings [rad or m].
        production: Its tolerances; as the plate says if None. Targets that say how well they are known keep
            that.
        undeclared: Effects that every actual arm has and the calibration does not know.
        length: Maximum manufacturing error of a length [m]; 5 mm in ARIA §2.4.
        angle: Maximum manufacturing error of an angle [rad]; 5° there.
        wanted: What every pose has to keep; ARIA eq. (3) if None.
        towards: Plate about whose targets' orientations the poses of the region are turned by up to 60°, so
            that plates compare; this one if None.
        poses: Poses of the tool in the region, in all their branches, at which arms are judged.
        scheduler: Address of a Dask scheduler; this machine's cores if None.
        seed: Of everything random.
    """
    check_number(arms)
    for name, value in (("length", length), ("angle", angle)):
        if value < 0.0:
            raise OptionError(f"{name} must be at least 0, got {value:g}", option=name, found=value)
    if poses < 1:
        raise OptionError(f"poses must be at least 1, got {poses}", option="poses", found=poses)
    plate = plate if production is None else replace(plate, production=production)
    sigma = sigma or usual_sigma(plate)
    q = planned_joints(robot, plate, sigma)
    wanted_region = plate if towards is None else replace(towards, region=plate.region)
    bank = plate_region_poses(robot, wanted_region, poses)
    errors = ErrorSizes(
        seat_position=sigma[0],
        seat_rotation=sigma[1],
        joint=joint_sigma,
        target_position=plate.known[:, 0],
        target_rotation=plate.known[:, 1],
        play=plate.play,
        away=None if plate.anchors is None else plate.from_anchors @ robot.base.pose[:3, :3].T,
        anchor=0.0 if plate.anchors is None else ANCHOR_SIGMA,
        undeclared=replace(robot, effects=undeclared) if undeclared else None,
    )
    job = YieldJob(
        robot=replace(robot, effects=()),
        names=robot.default_free,
        poses=robot.base.pose @ plate.poses,
        q=q,
        constrained=constrained_by(plate),
        errors=errors,
        sigma=errors.assumed,
        length=length,
        angle=angle,
        bank=bank,
        cells=plate.region.cells(in_base(robot, bank)[:, :3, 3]),
        wanted=wanted or Requirement().wanted,
    )
    found = try_production(job, arms=arms, seed=seed, scheduler=scheduler)
    held = [assumptions(plate, sigma)]
    if joint_sigma:
        held.append(f"joint readings {np.rad2deg(joint_sigma):.2g}°")
    held += [f"undeclared {effect.phrase}" for effect in undeclared]
    return replace(found, assumptions="; ".join(held))


def planned_joints(robot: Robot, plate: Plate, sigma: tuple[float, float]) -> np.ndarray:
    """Joint positions at which each target is to be measured: the plate's own, or the mix that tells most."""
    own = [target.q for target in plate.targets if target.q is not None]
    if own and len(own) == len(plate):
        return np.stack(own)
    can = measurable(robot, plate)
    if can.lacking:
        number, why = next(iter(can.lacking.items()))
        raise DataError(f"target {number + 1} is {why}; move it, then try the plate", target=number)
    rng = np.random.default_rng(0)
    goal = plate_region_poses(robot, plate)
    with part_of(0.0, 0.0):
        return choose_branches(robot, plate, can.solutions, goal=goal, rng=rng, sigma=sigma).q
