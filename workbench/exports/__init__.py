"""Formats of `--for`: the joint table here, those of controllers, drivers and simulators from elsewhere.

URDF and TOML, which are read too, are written in `arm/urdf_writer.py` and `arm/robot_toml.py`.
"""

from workbench.base.errors import OptionError
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


__all__ = ["FORMS", "AbstractForm", "Exported", "Job", "export_robot", "form_named"]
