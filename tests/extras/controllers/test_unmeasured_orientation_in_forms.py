"""The program and model files of an arm measured with one reflector spoil nothing that it did not observe."""

import xml.etree.ElementTree as ET

import numpy as np
import pytest

import workbench as wb
from tests.exports import readers
from tests.exports.test_unmeasured_orientation import cell
from tests.extras.controllers.test_programs import in_python
from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.arm.usable_arm import usable_arm
from workbench.base.wording import in_mm
from workbench.exports import FORMS, Job, export_robot

assert cell  # a fixture


def missed(arm: wb.Robot) -> float:
    """Mean distance of the arm used from the saved one, over its measured poses [m]."""
    both = (tool_poses(each, Motion(arm.calibration.observed.q)) for each in (arm, usable_arm(arm).robot))
    before, after = (poses[:, :3, 3] for poses in both)
    return float(np.linalg.norm(before - after, axis=1).mean())


def test_the_generated_program_does_the_same(cell, tmp_path):
    arm, nominal = wb.load_robot(cell.saved), wb.load_robot("ur5")
    q = in_python(arm, nominal, tmp_path).correct(cell.q)[0]
    cell.judge_corrected(q, np.append(usable_arm(arm).robot.tool.xyz, 1.0))


def test_a_mujoco_model_is_no_worse_at_the_flange(cell, tmp_path):
    path, job = tmp_path / "arm.xml", Job(robot=wb.load_robot(cell.saved), nominal=wb.load_robot("ur5"))
    done = export_robot(FORMS["mjcf"], path, job)
    assert any("not measured" in note for note in done.notes)
    assert done.position < 2e-5
    pose = _bodies(path.read_text())
    cell.judge(np.array([pose(row) for row in cell.q]))


def _bodies(text: str) -> readers.Kinematics:
    """MJCF: nested bodies with their place in the one before, a hinge each, and the site of the flange."""

    def place(node):
        w, x, y, z = (float(v) for v in node.get("quat").split())
        out = np.eye(4)
        out[:3, :3] = [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
        out[:3, 3] = [float(v) for v in node.get("pos").split()]
        return out

    def pose(q):
        node, here, k = ET.fromstring(text).find("worldbody/body"), np.eye(4), 0
        while (inner := node.find("body")) is not None:
            node = inner
            axis = np.array([float(v) for v in node.find("joint").get("axis").split()])
            here, k = here @ place(node) @ readers.rot(int(np.argmax(axis)), q[k]), k + 1
        return here @ place(next(s for s in node.findall("site") if s.get("name") == "flange"))

    return pose


def test_a_program_says_how_far_its_arm_is_from_the_saved_model(cell, tmp_path):
    arm, nominal = wb.load_robot(cell.saved), wb.load_robot("ur5")
    done = export_robot(FORMS["python-module"], tmp_path / "arm.py", Job(robot=arm, nominal=nominal))
    assert done.left.position_mean == pytest.approx(missed(arm))
    assert done.rows == len(arm.calibration.observed.q)
    assert "agrees" not in done.verdict
    assert in_mm(missed(arm)) in done.verdict
    assert in_mm(np.hypot(arm.calibration.error.position, missed(arm))) in done.verdict
