"""What happened while rows were measured, where it is seen: in the scene, in its legend, in the chart."""

from dataclasses import replace

import numpy as np
import pytest
from refusals import mentions

from workbench import Motion, load_robot, tool_poses
from workbench.arm.effects.events import FrameStep, ToolStep
from workbench.base import se3
from workbench.session.comparison import Comparison, ModelStage, compare
from workbench.views.appearance.colours import EVENT, css
from workbench.views.drawables.events import place_and_step
from workbench.views.drawables.measured import _points
from workbench.views.page.panels.legend import events

STEP = (3e-4, -5e-4, 2e-4, 0.0, 0.0, 0.0)


@pytest.fixture(scope="module")
def arm():
    robot = load_robot("aria")
    turned = se3.pose(se3.rotvec_to_matrix(np.array([0.3, -0.2, 1.0])), np.array([0.4, -0.1, 0.2]))
    base = replace(robot.base, rotation=turned[:3, :3], xyz=turned[:3, 3])
    tool = replace(robot.tool, rotation=se3.rotvec_to_matrix(np.array([0.5, 0.4, -0.7])))
    return robot.with_frames(base=base, tool=tool)


@pytest.mark.parametrize("event", [FrameStep((), STEP, row=5), ToolStep((), STEP[:3], row=5)])
def test_the_arrow_is_the_step_of_the_tool_from_before_to_after(arm, event):
    q = np.array([0.3, -0.8, 0.6, 0.2, 0.9, -0.4])
    known = arm.with_effects(event)
    poses = tool_poses(known, Motion(np.stack([q, q]), row=np.array([4, 5])))
    seen = arm.base.rotation.T @ (poses[1] - poses[0])[:3, 3]
    place, step = place_and_step(arm, q, event, arm.base.rotation)
    assert step == pytest.approx(seen, abs=1e-9)
    tool = (se3.inverse(arm.base.pose) @ poses[1])[:3, 3]
    assert place == pytest.approx(tool if isinstance(event, ToolStep) else np.zeros(3), abs=1e-12)


def rows(arm, happened, order=None) -> Comparison:
    """Ten rows, measured in their order or in another one."""
    q = np.random.default_rng(0).uniform(-1.0, 1.0, (10, 6))
    from workbench.data.dataset import Dataset

    data = Dataset(q=q, position=tool_poses(arm, Motion(q))[:, :3, 3] + 1e-4, time=order)
    return compare(data, None, arm, arm, dict.fromkeys(ModelStage, arm), happened)


def test_points_before_the_last_event_are_smaller(arm):
    two = (FrameStep((), STEP, row=3), ToolStep((), STEP[:3], row=7))
    compared = rows(arm, two)
    drawn = [_points(compared, ModelStage.EFFECTS, frozenset(), False, before) for before in (True, False)]
    assert [points.numbers.tolist() for points in drawn] == [list(range(7)), [7, 8, 9]]
    assert drawn[0].radius < 0.7 * drawn[1].radius
    text = events(two, compared)
    assert text.count(css(EVENT)) == 2
    assert mentions(text, "row 3")
    assert mentions(text, "row 7")
