"""Measured files of arms with an effect that something beside the joint positions drives."""

from pathlib import Path

from workbench import load_robot, measure_poses, write_measurements
from workbench.arm.effects.backlash import Backlash

DRIVEN = {
    "temperature": ("thermal-growth::1e-4", 3),
    "time": ("base-drift", 3),
    "payload": ("joint-compliance:2:3e-4", 4),
    "direction": (Backlash((1,), (1.5e-3,), by="motion"), 3),
}
"""An effect that each column drives, and the seed of arm, poses and noise."""


def driven_file(driver: str, folder: Path) -> tuple[Path, str]:
    """90 poses of an ARIA arm with the effect that this column drives, and the effect's name."""
    effect, seed = DRIVEN[driver]
    _, rows = measure_poses(load_robot("aria"), 90, instrument="tracker-6d", effects=(effect,), seed=seed)
    assert getattr(rows, driver) is not None
    name = effect.partition(":")[0] if isinstance(effect, str) else effect.name
    return write_measurements(rows, folder / f"{driver}.csv"), name
