"""Measured files of arms: by a tracker, and with an effect that something beside joint positions drives."""

from pathlib import Path

import numpy as np

from workbench import Motion, Robot, load_robot, measure_poses, write_measurements
from workbench.arm.effects.backlash import Backlash
from workbench.data.simulation.instruments import instrument_named
from workbench.data.simulation.simulate import simulate

DRIVEN = {
    "temperature": ("thermal-growth::1e-4", 3),
    "time": ("base-drift", 3),
    "payload": ("joint-compliance:2:3e-4", 4),
    "direction": (Backlash((1,), (1.5e-3,), by="motion"), 3),
}
"""An effect that each column drives, and the seed of arm, poses and noise."""


def tracked_file(actual: Robot, path: Path, rng: np.random.Generator, *, rows: int, reach: float) -> Path:
    """Poses of an arm, joints up to so far from 0, that a tracker measures."""
    q = rng.uniform(*np.clip(actual.limits, -reach, reach).T, (rows, actual.dof))
    measured = simulate(actual, Motion(q), instrument=instrument_named("tracker-6d"), rng=rng)
    return write_measurements(measured, path)


def driven_file(driver: str, folder: Path) -> tuple[Path, str]:
    """90 poses of an ARIA arm with the effect that this column drives, and the effect's name."""
    effect, seed = DRIVEN[driver]
    _, rows = measure_poses(load_robot("aria"), 90, instrument="tracker-6d", effects=(effect,), seed=seed)
    assert getattr(rows, driver) is not None
    name = effect.partition(":")[0] if isinstance(effect, str) else effect.name
    return write_measurements(rows, folder / f"{driver}.csv"), name
