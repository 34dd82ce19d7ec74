"""The real arm beside its model: as far off as measured, times the factor, and turned where it gives way."""

import numpy as np
import pytest

from workbench import Motion, load_robot, tool_poses
from workbench.arm.effects import EFFECTS
from workbench.arm.kinematics.skeleton import height_above_floor
from workbench.base import se3
from workbench.session.commands.arm import ChooseRobot
from workbench.session.commands.data import MeasureVirtualArm
from workbench.session.commands.identify import Identify
from workbench.session.comparison import times_for
from workbench.views.appearance.bodies import body_frames
from workbench.views.appearance.colours import rounded
from workbench.views.drawables.measured import LONGEST_SAMPLE
from workbench.views.drawables.real_arm import bent_frames

Q = np.array([[0.4, 0.7, -0.9, -0.6, 0.8]])


@pytest.mark.parametrize(("times", "give", "off"), [(1.0, 0.0, 1e-5), (30.0, 0.0, 3e-4), (1e3, 1e-5, 0.05)])
def test_the_tool_is_off_by_what_was_measured_times_the_factor(times, give, off):
    robot, rng = load_robot("ur5"), np.random.default_rng(4)
    q, gap = rng.uniform(-1.5, 1.5, (5, 6)), 1e-4 * rng.standard_normal((5, 3))
    gap[2] = gap[2] if give else np.nan
    soft = robot.with_effects(EFFECTS["joint-compliance"]((1, 2, 4), (give,) * 3))
    tool = se3.inverse(robot.base.pose) @ tool_poses(robot, Motion(q))
    held = se3.inverse(body_frames(robot, q[0])[-1]) @ tool[0]
    there = (bent_frames(robot, soft, q, times, gap=gap)[:, -1] @ held)[:, :3, 3]
    assert np.allclose(there - tool[:, :3, 3], times * np.nan_to_num(gap), atol=off)


def test_the_joint_that_gives_way_is_the_one_that_turns():
    robot = load_robot("katana450")
    soft = robot.with_effects(EFFECTS["joint-compliance"]((1,), (1e-4,)))
    straight, bent = body_frames(robot, Q[0]), bent_frames(robot, soft, Q, 20.0)[0]
    steps = [se3.inverse(frames[:-1]) @ frames[1:] for frames in (straight, bent)]
    turned = np.linalg.norm(se3.matrix_to_rotvec((se3.inverse(steps[0]) @ steps[1])[:, :3, :3]), axis=1)
    assert turned[1] > 0.01
    assert np.delete(turned, 1).max() < 0.01 * turned[1]


def test_katana_stands_on_its_table_and_is_measured_and_identified(do):
    session = do(ChooseRobot("katana450"))
    assert session.score.measurable == 10
    assert all(not state.hit for state in session.states)
    assert height_above_floor(session.robot) == 0.2015
    assert session.plate.xyz[2] > -0.2015
    session = do(MeasureVirtualArm(3, more=30, errors=(3e-3, 0.05)), Identify(("opt2",)))
    assert session.results.identification.runs["opt2"].held_out.position_mm.mean < 0.5
    assert session.results.identification.nominal.held_out.position_mm.mean > 5.0
    times, errors = session.choices.overlay.exaggeration, session.results.comparison.stage_errors[:, 0]
    assert times * np.nanmean(errors) == pytest.approx(0.05 * session.robot.reach, rel=0.05)
    assert do(Identify(("ols",))).choices.overlay.exaggeration == times  # a better model is seen beside it


@pytest.mark.parametrize(
    ("errors", "times", "sample"),
    [([1e-3, np.nan, 3e-3], 25.0, 2e-3), ([1e-9], 1000.0, 1e-4), ([0.5], 1.0, 0.1), ([4.5e-4], 110.0, 5e-4)],
)
def test_factors_have_two_digits_and_samples_are_round_and_a_tenth_of_the_reach(errors, times, sample):
    assert times_for(np.array(errors), 1.0) == times
    assert rounded(LONGEST_SAMPLE / times, up=False) == pytest.approx(sample)
