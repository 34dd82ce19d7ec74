"""Trajectories from file to file, corrected (`workbench compensate`)."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from workbench.arm.joint_units import sliding
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.arguments import checked_arguments
from workbench.base.errors import OptionError
from workbench.base.files import check_ending, write_text
from workbench.base.threads import one_thread
from workbench.base.types import JointRows
from workbench.base.units import Quantity, conversion
from workbench.data.arguments import RobotLike, TrajectoryLike
from workbench.data.dataset import Dataset
from workbench.data.measuring_order import with_directions
from workbench.data.plausibility import refuse_joint_units
from workbench.data.readers.trajectory import Trajectory
from workbench.data.writer import ENDINGS
from workbench.extras.trajectories.correction import Compensation, correct
from workbench.extras.trajectories.path import Commanded, command_joints, command_poses


@checked_arguments()
@one_thread()
def compensate(
    calibrated: RobotLike,
    trajectory: TrajectoryLike,
    *,
    nominal: RobotLike | None = None,
    payload: float | None = None,
    temperature: float | None = None,
    positions_only: bool | None = None,
) -> Compensation:
    """Joint positions with which a calibrated arm reaches the poses of a trajectory.

    Args:
        calibrated: The arm that moves, with its effects.
        trajectory: Joint positions, which mean the nominal arm's poses there; or poses in the robot's base
            frame. If it has both, the joint positions are used.
        nominal: The arm as the controller computes it. Not required for poses: the calibrated geometry is
            used then.
        payload: Mass at the tool [kg]; that of the trajectory if None.
        temperature: Temperature [degC]; that of the trajectory if None.
        positions_only: Whether to ignore orientations; by default they are corrected if the calibration
            observed them, and by an arm near nominal if not.
    """
    commanded = _commanded(calibrated, trajectory, nominal, positions_only)
    state = _state(commanded.q, trajectory, payload=payload, temperature=temperature)
    found, lost = correct(commanded, motion=state), [n for n in trajectory.notes if "left out" in n]
    return replace(found, notes=(*found.notes, *lost))


def write_trajectory(found: Compensation, path: Path | str, units: Mapping[str, str]) -> Path:
    """Write the time, if known, and the corrected joints as a table.

    Args:
        units: Unit of each column of the trajectory's file, in its order: kept; SI for other columns.
    """
    slides, time = sliding(found.commanded.calibrated), found.motion.time
    values = ({} if time is None else {"time": time}) | {f"q{k}": q for k, q in enumerate(found.q.T, 1)}
    usual = ["s"] * (time is not None) + ["m" if each else "rad" for each in slides]
    kept = {name: unit for name, unit in units.items() if name in values}
    kept |= {name: unit for name, unit in zip(values, usual, strict=True) if name not in kept}
    sizes = [conversion(unit, Quantity.ANGLE, Quantity.LENGTH, Quantity.TIME).scale for unit in kept.values()]
    rows = np.column_stack([values[name] / size for name, size in zip(kept, sizes, strict=True)])
    text = [",".join(f"{name}[{unit}]" for name, unit in kept.items())]
    text += [",".join(f"{value:.15g}" for value in row) for row in rows.tolist()]
    return write_text(check_ending(path, "measurements are", *ENDINGS), "\n".join(text) + "\n")


def _commanded(
    calibrated: Robot, trajectory: Trajectory, nominal: Robot | None, positions_only: bool | None
) -> Commanded:
    time = trajectory.time
    if trajectory.q is not None:
        units = tuple(trajectory.units.get(f"q{k + 1}", "") for k in range(calibrated.dof))
        refuse_joint_units(calibrated, trajectory.q, units, trajectory.source)
        if nominal is None:
            how = "give the controller's model, which converts them to poses (--nominal ROBOT)"
            raise OptionError(f"{trajectory.source} contains joint positions; {how}")
        return command_joints(calibrated, nominal, trajectory.q, positions_only=positions_only, time=time)
    assert trajectory.position is not None  # a trajectory has one or the other
    turned = trajectory.rotation
    rotation = np.tile(np.eye(3), (len(trajectory.position), 1, 1)) if turned is None else turned
    return command_poses(
        calibrated,
        calibrated.with_effects() if nominal is None else nominal,
        se3.pose(rotation, trajectory.position),
        positions_only=True if turned is None else positions_only,
        time=time,
    )


def _state(q: JointRows, trajectory: Trajectory, **instead: float | None) -> Motion:
    """Drivers of effects along a path, some instead of the trajectory's; directions by the order of rows."""
    time = np.arange(float(len(q))) if trajectory.time is None else trajectory.time
    path = with_directions(Dataset(q=q, time=time))
    given = {name: np.full(len(q), value) for name, value in instead.items() if value is not None}
    drivers = {**trajectory.drivers, **given}
    return replace(Motion.with_drivers(q, drivers), direction=path.direction, time=trajectory.time)
