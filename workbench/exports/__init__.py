"""Formats of `--for`: the joint table here, those of controllers, drivers and simulators from elsewhere.

URDF and TOML, which are read too, are written in `arm/urdf_writer.py` and `arm/robot_toml.py`.
"""

from pathlib import Path

from workbench.base.arguments import checked_arguments
from workbench.base.errors import OptionError, RobotError
from workbench.data.arguments import RobotLike
from workbench.exports.dh_csv import DhCsv
from workbench.exports.export_format import AbstractForm, Exported, Job, export_robot
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


__all__ = ["FORMS", "AbstractForm", "Exported", "Job", "export", "export_robot", "form_named"]
