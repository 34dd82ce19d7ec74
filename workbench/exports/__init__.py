"""Export formats for controllers, drivers and programs: one file per format, and one line here."""

from workbench.base.errors import OptionError
from workbench.base.registry import Registry
from workbench.exports.compensation import CHeader, PythonModule
from workbench.exports.export_format import AbstractForm, Exported, Job, export_robot
from workbench.exports.kinematics_yaml import FRANKA, OPENARM, UR, XARM
from workbench.exports.offsets import MotorCalibration, OffsetsCard
from workbench.exports.simulators import Mjcf, XacroProperties
from workbench.exports.tables import DhCsv, DhLatex, UrCalibration

FORMS: Registry[AbstractForm] = Registry(
    "form",
    AbstractForm,
    UR,
    XARM,
    FRANKA,
    OPENARM,
    UrCalibration(),
    MotorCalibration(),
    Mjcf(),
    XacroProperties(),
    DhCsv(),
    DhLatex(),
    OffsetsCard(),
    PythonModule(),
    CHeader(),
    group="workbench.exports",
)
"""The forms by what follows `--for`."""


def form_named(name: str) -> AbstractForm:
    """The form that `--for` names; another name is refused with the list of all."""
    if name not in FORMS:
        raise OptionError(f"there is no form '{name}'; choose {', '.join(FORMS)}")
    return FORMS[name]


__all__ = ["FORMS", "AbstractForm", "Exported", "Job", "export_robot", "form_named"]
