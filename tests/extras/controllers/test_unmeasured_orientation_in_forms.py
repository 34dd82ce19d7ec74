"""The program and model files of an arm measured with one reflector spoil nothing that it did not observe."""

import numpy as np
import pytest

import workbench as wb
from tests.exports.test_unmeasured_orientation import cell
from tests.extras.controllers.test_programs import in_python
from workbench.arm.usable_arm import usable_arm
from workbench.base.wording import in_mm
from workbench.exports import FORMS, Job, export_robot

assert cell  # a fixture


def test_the_generated_program_does_the_same(cell, tmp_path):
    arm, nominal = wb.load_robot(cell.saved), wb.load_robot("ur5")
    own = in_python(arm, nominal, tmp_path)
    cell.judge_corrected(own.correct(cell.q)[0], np.append(usable_arm(arm).robot.tool.xyz, 1.0))
    assert np.abs((own.ARM["base"] @ own.forward(cell.q) - wb.tool_poses(arm, cell.q))[:, :3, 3]).max() < 2e-5


def test_a_program_says_how_far_its_arm_is_from_the_saved_model(cell, tmp_path):
    arm, nominal = wb.load_robot(cell.saved), wb.load_robot("ur5")
    done = export_robot(FORMS["python-module"], tmp_path / "arm.py", Job(robot=arm, nominal=nominal))
    q = arm.calibration.observed.q
    before, after = (wb.tool_poses(each, q)[:, :3, 3] for each in (arm, usable_arm(arm).robot))
    missed = np.linalg.norm(before - after, axis=1).mean()
    assert done.left.position_mean == pytest.approx(missed)
    assert done.rows == len(q)
    assert "agrees" not in done.verdict
    assert in_mm(missed) in done.verdict
    assert in_mm(np.hypot(arm.calibration.error.position, missed)) in done.verdict
