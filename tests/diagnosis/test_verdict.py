"""What is said of what is left, where the rows know their noise, their groups or nothing at all."""

from dataclasses import replace

import numpy as np
import pytest

import workbench as wb
from workbench.arm.effects.encoder_scale import EncoderScale
from workbench.arm.effects.joint_compliance import JointCompliance
from workbench.arm.effects.joint_coupling import JointCoupling
from workbench.arm.effects.local_joint_error import LocalJointError
from workbench.arm.motion import Motion
from workbench.arm.robot_toml import read_toml
from workbench.diagnosis.diagnose import diagnose
from workbench.diagnosis.result import Verdict
from workbench.identification.problem import Noise
from workbench.plate.simulated_measurement import measure_poses

SLIDING = """
name = "column"
convention = "dh"
[[joint]]
type = "prismatic"
alpha = 1.2
[[joint]]
a = 0.3
"""


@pytest.fixture(scope="module")
def soft():
    """An ARIA that gives way in joint 2, measured with a noise that its rows state."""
    return wb.load_robot("aria"), measure_poses(
        wb.load_robot("aria"), 40, effects=("joint-compliance:2:5e-5",), seed=3
    )[1]


def named(found):
    return [(str(e.effect.name), e.effect.joints) for e in found.effects]


def test_what_is_left_is_compared_with_the_noise_that_rows_state(soft):
    robot, rows = soft
    found = diagnose(robot, rows, noise=Noise(1e-3, 1e-2))
    sigma = float(np.sqrt((rows.sigma[:, :3] ** 2).mean()))
    assert found.known_noise.position == pytest.approx(sigma)
    assert found.noise.position == pytest.approx(sigma, rel=0.2)
    assert found.verdict is Verdict.EXPLAINED
    doubted = diagnose(robot, replace(rows, sigma=rows.sigma / 3.0))
    assert doubted.verdict is Verdict.PARTLY
    assert "times what the known noise" in doubted.message


def test_rows_of_one_group_are_cross_validated_one_by_one(soft):
    robot, rows = soft
    found = diagnose(robot, replace(rows, group=np.full(len(rows), "all")), held_out=0.0)
    assert named(found) == [("joint-compliance", (1,))]
    assert sum("cross-validated row by row" in note for note in found.notes) == 1


def test_no_effect_is_added_where_the_geometry_explains_little(soft):
    """One robot moved twice, taken for one that stood still."""
    robot, rows = soft
    away = np.repeat([[0.0, 0.0, 0.0], [0.0, 0.2, 0.0]], len(rows) // 2, axis=0)
    found = diagnose(robot, replace(rows, position=rows.position + away, sigma=None))
    assert found.verdict is Verdict.UNEXPLAINED
    assert "No effects were added" in found.message
    assert found.effects == ()
    assert found.calibrated.effects == ()


@pytest.mark.parametrize(
    ("effect", "text"),
    [
        (EncoderScale((0,), (0.005,)), "Joint 1 slides 0.5 % too far"),
        (JointCompliance((0,), (2e-6,)), "Joint 1 deflects by 2 µm/N under the force along its axis"),
        (JointCoupling((0, 1), (1e-3,)), "Joint 1 moves along with joint 2: 0.001 mm/mrad of its angle"),
        (JointCoupling((1, 0), (1e-3,)), "Joint 2 moves along with joint 1: 0.001 mrad/mm of its travel"),
        (
            LocalJointError((0,), (-1e-3, 0.0, 1e-3), knots=(0.0, 0.1, 0.2), range=(0.0, 0.2)),
            "up to 1 mm that no other effect explains",
        ),
        (EncoderScale((1,), (-0.005,)), "Joint 2 turns 0.5 % too little"),
    ],
)
def test_sliding_joints_slide(tmp_path, effect, text):
    path = tmp_path / "column.toml"
    path.write_text(SLIDING)
    rows = Motion(np.column_stack([np.linspace(0.0, 0.2, 9), np.linspace(-1.0, 1.0, 9)]))
    assert text in effect.sentence(read_toml(path).chain, rows)


def test_all_arms_are_compared_on_the_same_rows(soft):
    """Three rows are so little off that they show only beside the effect: then no arm is judged by them."""
    robot, rows = soft
    off = rows.position.copy()
    off[[4, 17, 30]] += [0.0, 0.0, 1e-3]
    found = diagnose(robot, replace(rows, position=off), held_out=0.0)
    assert {4, 17, 30} <= set(found.outliers.tolist())
    assert found.before_fit.problem.data.row.size > found.after_fit.problem.data.row.size
    compared = found.nominal_rows[0], found.before_rows[0], found.after_rows[0]
    assert {len(each.position) for each in compared} == {len(rows) - len(found.outliers)}
    for errors, each in zip((found.nominal, found.before, found.after), compared, strict=True):
        assert errors.train.position_mm.mean == pytest.approx(1e3 * each.position.mean())
