"""Joint coordinates as people read them."""

import numpy as np

from workbench.arm.joint_units import joint_text, shown_joints, shown_units, sliding_numbers
from workbench.arm.robot import Robot

TABLE = [{"type": "revolute"}, {"type": "prismatic"}]


def test_angles_are_degrees_and_lengths_millimetres():
    arm = Robot.from_dh([row | {"theta": 0.0, "d": 0.1, "a": 0.2, "alpha": 0.0} for row in TABLE])
    q = np.array([[-np.pi / 6.0, 0.25], [0.0, -0.001]])
    np.testing.assert_allclose(shown_joints(arm, q), [[-30.0, 250.0], [0.0, -1.0]], atol=1e-12)
    assert shown_units(arm) == ("°", " mm")
    assert sliding_numbers(arm) == [1]
    assert joint_text(arm, q[0]) == "−30.0°, 250.0 mm"
