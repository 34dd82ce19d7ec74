"""Joints that give way and geometry: one after the other, or both at once.

The thesis measures first how the joints give way, takes that into account, and fits the geometry to what is
left (Katana fig. 4.9). Poses of a good instrument also let both be fitted together, without inclinometers.

    errors = compare_orders(robot, data, held_out, known=tilting.effects, joints=(1, 2, 3, 4), noise=noise)
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from workbench.arm.effects import AbstractEffect
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.data.dataset import Dataset
from workbench.data.simulation.instruments import INSTRUMENTS, Instrument, Observes
from workbench.data.simulation.simulate import simulate, virtual_arm
from workbench.extras.katana.load_test.experiment import (
    ANGLE,
    LENGTH,
    draw_joints,
    observable_sizes,
    read_plan,
    tilting_of,
)
from workbench.extras.katana.load_test.joint_tilting_fit import fit_tilting, tilting_effects, unknown_sizes
from workbench.extras.katana.load_test.postures import plan_load_test
from workbench.extras.katana.load_test.tolerance import with_centre_tolerance
from workbench.identification.errors.row_errors import row_errors
from workbench.identification.problem import Noise
from workbench.plate.poses.iso_cube import iso_cube_poses, largest_cube

POSES, HELD_OUT = 118, 50
"""Poses that are fitted, as the thesis has, and poses that judge."""
TRACKER = Instrument(
    name="0.01 mm tracker", observes=Observes.POSE, sigma_position=1e-5, sigma_rotation=1.2e-4
)
"""0.01 mm, and what that in three markers on a circle of 60 mm radius turns a pose by."""


class Orders(NamedTuple):
    """Mean position error on held-out poses [mm].

    Args:
        geometry: Of the geometry alone, the joints taken for stiff.
        tilt_first: Of the geometry after what was known of the joints.
        together: Of both from the poses alone.
    """

    geometry: float
    tilt_first: float
    together: float


def compare_orders(
    robot: Robot,
    data: Dataset,
    held_out: Dataset,
    *,
    known: Sequence[AbstractEffect],
    joints: Sequence[int],
    tipping: Sequence[int] = (),
    noise: Noise,
) -> Orders:
    """Fit poses in each order, and judge the models on others.

    Args:
        robot: Nominal arm.
        data: Measured poses.
        held_out: Poses that take no part.
        known: How the joints give way, from the inclinometers.
        joints: Joints that are fitted together with the geometry, from 0.
        tipping: Joints whose clearance alone is, as nothing turns them.
        noise: Of the poses.
    """
    models = (
        fit_tilting(robot, data, requested=(), noise=noise).fit.calibrated,
        fit_tilting(robot.with_effects(*known), data, requested=(), noise=noise).fit.calibrated,
        fit_tilting(
            robot, data, requested=unknown_sizes(joints, tipping=tipping), noise=noise
        ).fit.calibrated,
    )
    return Orders(*(1e3 * float(row_errors(model, held_out).position.mean()) for model in models))


def order_study(robot: Robot, *, arms: int, seed: int = 0) -> tuple[Orders, ...]:
    """Both orders over virtual arms: inclinometers read without added mass, then 118 poses by ISO 9283.

    Joints that gravity does not turn tip in their clearance alone: what friction would hold is left out.

    Args:
        robot: Nominal arm with masses and limits.
        arms: How many, each with its own geometry, joints and noise.
        seed: Of arms, poses and noise.
    """
    rng = np.random.default_rng(seed)
    robot = with_centre_tolerance(robot.with_effects())
    plan, cube = plan_load_test(robot, rng=rng), largest_cube(robot, rng=rng)
    meter, (sigma, turn) = INSTRUMENTS["inclinometer"], TRACKER.deviations
    noise = Noise(sigma, float(turn or 1.0))
    out = []
    for _ in range(arms):
        joints = draw_joints(observable_sizes(plan), rng)
        actual = virtual_arm(robot, rng=rng, length=LENGTH, angle=ANGLE)
        actual = actual.with_effects(*tilting_effects(joints))
        readings = read_plan(actual, plan, instrument=meter, rng=rng)
        known = tilting_of(robot, plan, readings, instrument=meter)
        q = iso_cube_poses(robot, POSES + HELD_OUT, rng=rng, cube=cube).q
        rows = simulate(actual, Motion(rng.permutation(q)), instrument=TRACKER, rng=rng)
        out.append(
            compare_orders(
                robot,
                rows.take(np.arange(POSES)),
                rows.take(np.arange(POSES, len(rows))),
                known=known.effects,
                joints=plan.joints,
                tipping=plan.unturned,
                noise=noise,
            )
        )
    return tuple(out)
