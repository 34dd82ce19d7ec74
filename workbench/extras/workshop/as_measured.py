"""A plate as measured after manufacture: the measured targets replace the nominal ones."""

from dataclasses import replace
from enum import StrEnum

import numpy as np

from workbench.base import se3
from workbench.base.errors import DataError
from workbench.plate.measured_plate import MeasuredTargets
from workbench.plate.plate import Plate, Target

FARTHEST = 0.02
"""Deviation from the drawing above which the frame or the units must be wrong [m]."""
MAX_TURNED = float(np.deg2rad(10.0))
"""The same of an orientation [rad]."""


class PlateFrame(StrEnum):
    """Frame in which a plate was measured: the robot's base, or from the centre of the plate's top."""

    BASE = "base"
    PLATE = "plate"


def as_measured(nominal: Plate, measured: MeasuredTargets, *, frame: PlateFrame = PlateFrame.BASE) -> Plate:
    """The nominal plate with its targets where the machine found them.

    Region, branches, joint angles and kinds stay. A measured target is known as well as the machine knows it,
    however it was made, and turned within the tolerance where no orientation was measured. A
    target that was not measured stays nominal, with a note. Joint angles then are starting points for the
    inverse kinematics.
    """
    beyond = [number for number in measured.numbers if number > len(nominal)]
    if beyond:
        raise DataError(
            f"{measured.source}: target {beyond[0]} is not on plate '{nominal.name}', which has "
            f"{len(nominal)}; is it the list of another plate?"
        )
    rows = [number - 1 for number in measured.numbers]
    poses = measured.poses if frame is PlateFrame.BASE else nominal.pose @ measured.poses
    if not measured.turned:
        poses = se3.pose(nominal.poses[rows][:, :3, :3], poses[:, :3, 3])
    deviations = se3.pose_error(poses, nominal.poses[rows])
    _refuse_far(deviations, measured, nominal, frame)
    targets = list(nominal.targets)
    for i, row in enumerate(rows):
        position, rotation = measured.sigma[i].tolist()
        sigma = (position, rotation if measured.turned else float(nominal.known[row, 1]))
        there = Target.at(poses[i])
        targets[row] = replace(targets[row], xyz=there.xyz, rpy=there.rpy, sigma=sigma)
    left = sorted(set(range(1, len(nominal) + 1)) - set(measured.numbers))
    notes = [_deviation_note(deviations, measured)]
    if left:
        notes.append(f"targets {', '.join(map(str, left))} were not measured and stay nominal")
    return replace(
        nominal,
        name=f"{nominal.name} (as measured)",
        targets=tuple(targets),
        notes=(*nominal.notes, *notes, *measured.notes),
    )


def _refuse_far(deviations: np.ndarray, measured: MeasuredTargets, nominal: Plate, frame: PlateFrame) -> None:
    far, turned = np.linalg.norm(deviations[:, :3], axis=1), np.linalg.norm(deviations[:, 3:], axis=1)
    wrong = np.flatnonzero((far > FARTHEST) | (turned > MAX_TURNED))
    if not len(wrong):
        return
    row = int(wrong[0])
    other = PlateFrame.PLATE if frame is PlateFrame.BASE else PlateFrame.BASE
    raise DataError(
        f"{measured.source}: target {measured.numbers[row]} is {1e3 * far[row]:.1f} mm and "
        f"{np.rad2deg(turned[row]):.1f}° from its place on '{nominal.name}' in the {frame} frame; check its "
        f"number and units, or read it with --frame {other}"
    )


def _deviation_note(deviations: np.ndarray, measured: MeasuredTargets) -> str:
    far = np.linalg.norm(deviations[:, :3], axis=1)
    worst = int(np.argmax(far))
    turn = np.rad2deg(np.linalg.norm(deviations[:, 3:], axis=1).max())
    turned = f", up to {turn:.3f}°" if measured.turned else ""
    return (
        f"{len(far)} targets are taken from {measured.source}; they differ from the drawing by "
        f"{1e3 * np.sqrt(np.mean(far**2)):.3f} mm rms, at most {1e3 * far[worst]:.3f} mm "
        f"(target {measured.numbers[worst]}){turned}"
    )
