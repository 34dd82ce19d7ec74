"""A calibrated arm beside the controller's model of it, so that their poses can be compared."""

from typing import NamedTuple

from workbench.arm.calibration_record import Expected
from workbench.arm.frame import Frame
from workbench.arm.inverse.damped_newton import Task
from workbench.arm.robot import Robot
from workbench.arm.usable_arm import away_text, expected_error, usable_arm
from workbench.base.errors import OptionError
from workbench.identification.checks.arm_match import require_same_arm


class ComparedArms(NamedTuple):
    """Two arms in the robot's base frame and with one tool.

    Args:
        calibrated: Usable part of the calibrated arm.
        nominal: The arm as the controller computes it.
        task: Part of a pose that the number of joints can meet and the calibration observed.
        expected: Error of that arm where it was measured; None if unknown.
        away: Its difference from the calibrated arm, if any.
    """

    calibrated: Robot
    nominal: Robot
    task: Task
    expected: Expected | None
    away: tuple[str, ...]
    notes: list[str]


def comparable(calibrated: Robot, nominal: Robot, *, positions_only: bool | None = None) -> ComparedArms:
    """Both arms in the robot's base frame and with the calibrated tool, without the instrument's drift."""
    usable = usable_arm(calibrated)
    require_same_arm(usable.robot, nominal)
    if positions_only is False and not usable.sees_rotation:
        raise OptionError(
            f"orientations of '{calibrated.name}' can't be corrected ({'; '.join(usable.notes)}); measure "
            "orientations too, or correct positions alone",
            option="positions_only",
        )
    place = bool(positions_only)
    effects = tuple(e for e in calibrated.effects if e.moves_arm)
    skipped = [e.name for e in calibrated.effects if not e.moves_arm]
    notes = [f"{name} is ignored: it moves the measuring frame, not the arm" for name in skipped]
    if not place and not usable.sees_rotation:
        why = "no measured orientation confirms it"
        notes.append(f"orientations of the path are met by the model only: {why}")
    here, arm = Frame(), usable.robot
    return ComparedArms(
        calibrated=arm.with_effects(*effects).with_frames(base=here),
        nominal=nominal.with_frames(base=here, tool=arm.tool),
        task=Task.POSITION if place else Task.default(nominal.dof),
        expected=expected_error(calibrated, usable.left),
        away=away_text("arm used", calibrated, usable.left, len(usable.q)),
        notes=[*usable.notes, *notes],
    )
