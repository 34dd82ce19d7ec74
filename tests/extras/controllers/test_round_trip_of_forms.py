"""Forms and the program of a saved calibration are the arm of its file, evaluated by other code."""

import numpy as np
import pytest
import round_trip as trip
from test_round_trip import MICRON, TURN, at_observed, check_form, measured, saved

import workbench as wb
from tests.exports import readers
from tests.extras.controllers.test_controllers import refusing
from tests.extras.controllers.test_programs import in_python
from workbench.arm.robot_toml import robot_text
from workbench.base.errors import OptionError, RobotError
from workbench.exports import FORMS, Job, export_robot

assert measured  # fixtures
assert saved


def ur_controller(nominal: wb.Robot, text: str) -> readers.Kinematics:
    table = trip.toml_arm(robot_text(nominal)).table["joint"]
    return readers.ur_controller(
        text, np.array([[j[c] for c in ("theta", "d", "a", "alpha")] for j in table])
    )


READERS = {
    "mjcf": lambda nominal, text: trip.mjcf_arm(text),
    "ur-calibration": ur_controller,
    "ur-kinematics": lambda nominal, text: readers.kinematics_file(text, "kinematics", ""),
    "xarm-kinematics": lambda nominal, text: readers.kinematics_file(text, "kinematics", ""),
    "franka-kinematics": lambda nominal, text: readers.kinematics_file(text, "", "kinematic"),
}


@pytest.mark.parametrize("form", READERS)
def test_a_form_is_as_far_from_the_calibrated_arm_as_it_says(saved, form, tmp_path):
    nominal = wb.load_robot(saved[0].robot)
    try:
        check_form(form, *saved, tmp_path, lambda text: READERS[form](nominal, text))
    except (OptionError, RobotError):
        assert form in refusing(nominal)


def test_the_program_computes_the_arm_of_the_file(saved, tmp_path):
    """In its own base; where orientations were not measured, at the point that was, on the best base."""
    measured, files = saved
    arm, nominal = wb.load_robot(str(files.toml)), wb.load_robot(measured.robot)
    form = FORMS["python-module"]
    maximum = export_robot(form, tmp_path / "any", Job(robot=arm, nominal=nominal)).position or 0.0
    rows, (_, wanted) = at_observed(files)
    still = np.zeros_like(rows.q)
    found = in_python(arm, nominal, tmp_path).forward(rows.q, temperature=20.0, direction=still)
    base = trip.aligned(found[:, :3, 3], wanted[:, :3, 3])
    placed = base @ found
    missed = np.linalg.norm(placed[:, :3, 3] - wanted[:, :3, 3], axis=1)
    assert np.sqrt((missed**2).mean()) < maximum + MICRON
    if measured.rows.rotation is not None:
        assert trip.pose_difference(placed, wanted) < (MICRON, TURN)
