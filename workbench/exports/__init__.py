"""Formats of `--for`: the joint table here, those of controllers, drivers and simulators from elsewhere.

URDF and TOML, which are read too, are written in `arm/urdf_writer.py` and `arm/robot_toml.py`.
"""

from pathlib import Path

import numpy as np

from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base.arguments import checked_arguments
from workbench.base.errors import OptionError, RobotError, understood
from workbench.data.arguments import RobotLike
from workbench.data.dataset import Dataset
from workbench.exports.dh_csv import DhCsv
from workbench.exports.export_format import AbstractForm, Exported, Job, export_robot
from workbench.identification.checks.arm_match import require_same_arm
from workbench.parts import PartTable

FORMS: PartTable[AbstractForm] = PartTable("exports", AbstractForm, DhCsv())
"""The forms by what follows `--for`."""


def form_named(name: str) -> AbstractForm:
    """The form that `--for` names; another name is refused with the list of all."""
    if name not in FORMS:
        raise OptionError(f"unknown form '{name}'; choose {', '.join(FORMS)}")
    return FORMS[name]


@checked_arguments()
def export(
    robot: RobotLike,
    form: str,
    path: Path | str,
    *,
    nominal: RobotLike | None = None,
    into: Path | str | None = None,
    force: bool = False,
) -> Exported:
    """Write a calibration for a controller, driver, simulator or program, as `workbench export --for` does.

    Args:
        robot: As calibrated.
        form: What follows `--for`, such as `mjcf`.
        path: File to write.
        nominal: The controller's own model, for forms that need it.
        into: A file of this form, of which `path` becomes a copy with the calibrated numbers.
        force: Whether to write what its calibration says should not be used.

    Raises:
        RobotError: the form's geometry should not be used, and `force` is not given.
        OptionError: an unknown form, or one that lacks something.
    """
    chosen = form_named(form)
    if not force and (reason := chosen.refusal(robot)):
        raise RobotError(f"{Path(path).name} is not written: {reason}")
    source = None if into is None else chosen.text_of(Path(into))
    return export_robot(chosen, path, Job(robot=robot, nominal=nominal, source=source))


def applied(nominal: Robot, path: Path, form: str) -> Robot:
    """A known arm with the calibration stored in its controller or driver.

    Its own constants say it where they can, to a nanometre: frames and masses stay, and links near one
    another, where the table of a controller may have d of kilometres between axes that are nearly parallel.
    """
    from workbench.identification.algorithms.ols import Ols
    from workbench.identification.problem import Noise, Problem

    text = form_named(form).text_of(path)
    with understood(f"a file of the form {form}", str(path)):
        arm = form_named(form).read(text, Job(robot=nominal, nominal=nominal, source=text))
    require_same_arm(arm, nominal)
    q = np.random.default_rng(0).uniform(-np.pi, np.pi, (10 * nominal.dof, nominal.dof))
    poses = tool_poses(arm.bare, Motion(q))
    rows = Dataset(q, poses[:, :3, 3], rotation=poses[:, :3, :3])
    problem = Problem.build(nominal.bare, rows, free=nominal.default_free, noise=Noise(1e-6, 1e-6))
    found = nominal.with_values(problem.named(Ols().search(problem).x))
    return arm if np.abs(tool_poses(found.bare, Motion(q)) - poses).max() > 1e-9 else found


__all__ = ["FORMS", "AbstractForm", "Exported", "Job", "applied", "export", "export_robot", "form_named"]
