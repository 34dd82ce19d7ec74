"""Kinematics at the package's root: whatever a notebook has at hand, or one clear sentence."""

import numpy as np
import pytest
from refusals import refuses

import workbench as wb
from workbench.arm.effects import EFFECTS
from workbench.arm.motion import Motion
from workbench.base.errors import DataError

ONE = [0, 1, -1, 0, 1, 0]


@pytest.mark.parametrize("given", [ONE, tuple(ONE), np.array(ONE), np.array(ONE, np.float32)], ids=type)
def test_one_pose_gives_one_answer(aria, given):
    rows = np.array([ONE], float)
    assert np.array_equal(wb.tool_poses(aria, given), wb.tool_poses(aria, rows)[0])
    assert np.array_equal(aria.predict(given), wb.tool_poses(aria, given))
    assert np.array_equal(wb.link_frames(aria, given), wb.link_frames(aria, rows)[0])
    for one, many in zip(
        wb.identification_jacobian(aria, given), wb.identification_jacobian(aria, rows), strict=True
    ):
        assert np.array_equal(one, many[0])


def test_what_drives_an_effect_is_said_by_a_motion(aria):
    grown = aria.with_effects(EFFECTS["thermal-growth"]((), (1e-4,)))
    with refuses(DataError, column="temperature[degC]"):
        grown.predict(ONE)
    warm = Motion(np.array([ONE], float), temperature=np.array([40.0]))
    assert not np.allclose(grown.predict(warm)[0], aria.predict(ONE))
