"""Bars of the constants that were changed: what each moves the tool by."""

import numpy as np
import pytest

from workbench import Motion, measure_poses, tool_poses
from workbench.identification.identify import identify
from workbench.identification.report.charts import changed_constants


@pytest.fixture(scope="module")
def fit(aria):
    return identify(aria, measure_poses(aria, 40, seed=3)[1]).best.fit


def test_each_size_is_what_the_change_moves_the_tool_by(fit):
    """A length by its own change; base and tool have no bar."""
    found = changed_constants(fit)
    assert [one.moved for one in found] == sorted((one.moved for one in found), reverse=True)
    motion = Motion(fit.problem.data.q)
    here = tool_poses(fit.calibrated, motion)[:, :3, 3]
    for one in found:
        place = fit.problem.names.index(one.name)
        assert one.change == fit.x[place] - fit.parameters[place].nominal
        there = tool_poses(fit.calibrated.with_values({one.name: fit.parameters[place].nominal}), motion)
        assert one.moved == pytest.approx(np.linalg.norm(here - there[:, :3, 3], axis=1).mean())
    lengths = [one for one in found if one.unit == "m"]
    assert lengths
    assert all(one.moved == pytest.approx(abs(one.change)) for one in lengths)
    assert {one.name.split(".")[0] for one in found} <= {f"joint{k}" for k in range(1, 7)}
