"""Bars of the constants that were changed: what each moves the tool by."""

import numpy as np
import pytest

from workbench import Motion, identify, measure_poses, tool_poses
from workbench.identification.report.document import MAX_BARS, constant_bars


def test_each_size_is_what_the_change_moves_the_tool_by(aria):
    """The largest first, a length by its own change; base and tool have no bar."""
    fit = identify(aria, measure_poses(aria, 40, seed=3)[1]).best.fit
    motion, moved = Motion(fit.problem.data.q), list[float]()
    here = tool_poses(fit.calibrated, motion)[:, :3, 3]
    for p, value in zip(fit.parameters, fit.x, strict=True):
        if p.is_geometry:
            there = tool_poses(fit.calibrated.with_values({p.name: p.nominal}), motion)[:, :3, 3]
            moved.append(1e3 * np.linalg.norm(here - there, axis=1).mean())
            assert p.unit == "rad" or moved[-1] == pytest.approx(1e3 * abs(value - p.nominal))
    rows = constant_bars(fit).rows
    assert [row.value for row in rows] == pytest.approx(sorted(moved, reverse=True)[: MAX_BARS + 1])
    assert {row.name.partition(":")[0] for row in rows[:-1]} <= {f"Joint {k}" for k in range(1, 7)}
