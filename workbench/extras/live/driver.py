"""A stand-in for a real arm's driver: samples of an actual arm that is steered from target to target.

From one target to the next all joints move together along the minimum-jerk curve

    q(s) = q_a + (q_b − q_a) (10 s³ − 15 s⁴ + 6 s⁵),   s = t / T,   peak speed 15/8 |q_b − q_a| / T,

then the arm stands still for a while and the last sample of that asks to be captured. Joint readings and
poses carry the noise of their sensors; the clock is that of the samples, so a seed gives the same stream.

Source of the curve: Flash, Hogan, J. Neurosci. 5(7), 1985, eq. (5).
"""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Float

from workbench.arm.motion import Motion
from workbench.arm.robot import JointKind, Robot
from workbench.base import se3
from workbench.base.errors import OptionError
from workbench.data.simulation.instruments import INSTRUMENTS
from workbench.data.simulation.simulate import simulate, simulate_targets, virtual_arm
from workbench.extras.live.sample import Sample
from workbench.plate.plate import Plate
from workbench.plate.simulated_measurement import measure_plate

PEAK = 15.0 / 8.0
"""Peak speed of the minimum-jerk curve over its mean speed."""
MIN_MOTION_TIME = 0.3
"""Minimum time of any motion [s]."""
STEERING = (3e-4, float(np.deg2rad(0.03)))
"""How near an operator steers to a target's pose: standard deviations [m], [rad]."""
TURNING, SLIDING = 1.0, 0.25
"""Peak speeds of revolute [rad/s] and prismatic joints [m/s]."""
DWELL = 1.0
"""How long the arm stands at each target [s]; its last sample asks to be captured."""
TRACKER = INSTRUMENTS["tracker-6d"]
"""What sees the tool all the while; an operator steers until the target's pose shows, more or less."""
JOINT_NOISE = 1e-5
"""Standard deviation of a joint reading [rad or m]."""


def drive(
    actual: Robot, targets: Float[np.ndarray, "targets n"], *, rng: np.random.Generator, rate: float = 50.0
) -> Iterator[Sample]:
    """Samples of an arm that visits joint positions one after the other, the last at each with `capture`.

    It begins with all joints at zero, or as near as their limits allow.

    Args:
        actual: The arm that moves.
        targets: Joint positions at the targets [rad or m].
        rng: Source of the noise.
        rate: Samples a second.
    """
    count, dwell, here = 0, max(int(np.ceil(DWELL * rate)), 1), np.clip(0.0, *actual.search_limits.T)
    for target in targets:
        path = np.concatenate([_approach(actual, here, target, rate), np.tile(target, (dwell, 1))])
        rows = simulate(actual, Motion(path), instrument=TRACKER, rng=rng, joint_noise=JOINT_NOISE)
        for k, q in enumerate(rows.q):
            yield Sample(
                time=count / rate,
                q=q,
                position=None if rows.position is None else rows.position[k],
                rotation=None if rows.rotation is None else rows.rotation[k],
                capture=k == len(path) - 1,
            )
            count += 1
        here = target


def _approach(actual: Robot, start: np.ndarray, end: np.ndarray, rate: float) -> np.ndarray:
    fastest = np.array([SLIDING if j.kind is JointKind.PRISMATIC else TURNING for j in actual.moving])
    lasts = max(PEAK * float((np.abs(end - start) / fastest).max()), MIN_MOTION_TIME)
    steps = int(np.ceil(lasts * rate))
    s = np.arange(1, steps + 1) / steps
    return start + (end - start) * (s**3 * (10.0 - 15.0 * s + 6.0 * s**2))[:, None]


def drive_plate(robot: Robot, plate: Plate, *, seed: int = 0) -> tuple[Robot, Iterator[Sample]]:
    """A virtual arm with hidden errors, steered to every target of a plate (ARIA 5.1).

    Args:
        robot: Nominal arm.
        plate: The fixture, in the robot's base.
        seed: Of the hidden errors, the steering and the noise.

    Returns:
        The actual arm, and its samples as they come.
    """
    if not len(plate):
        raise OptionError(f"plate '{plate.name}' has no targets to drive to; add [[target]] tables")
    rng, exact = np.random.default_rng(seed), INSTRUMENTS["ideal"]
    actual = virtual_arm(robot, rng=rng)
    _, rows = measure_plate(robot, plate, instrument=exact, actual=actual, seed=seed)
    turn = se3.rotvec_to_matrix(rng.normal(0.0, STEERING[1], (len(plate), 3)))
    places = plate.poses[:, :3, 3] + rng.normal(0.0, STEERING[0], (len(plate), 3))
    steered = se3.pose(turn @ plate.poses[:, :3, :3], places)
    q = simulate_targets(actual, steered, instrument=exact, rng=rng, near=rows.q).q
    return actual, drive(actual, q, rng=rng)
