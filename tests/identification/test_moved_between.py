"""Rows that no reading explains since something was moved between them: the parts that fit are named."""

import numpy as np
import pytest
from refusals import refuses
from slow import slow

from tests.identification.test_missing_units import poses_of_ur5e
from workbench import Dataset, identify
from workbench.base.errors import DataError


def rows(seed, moved_at, *, of=60):
    """Joints and points of a UR5e, of which the instrument is carried elsewhere after some rows."""
    rng = np.random.default_rng(seed)
    q, poses = poses_of_ur5e(rng, of)
    points = poses[:, :3, 3]
    points[moved_at:] += 0.5, 0.2, 0.0
    return q, points + rng.normal(0.0, 3e-5, points.shape)


@pytest.mark.parametrize("moved_at", [slow(15), 30, slow(44)])
def test_both_parts_are_named(moved_at):
    q, points = rows(3, moved_at)
    with refuses(DataError, f"data rows 0–{moved_at - 1} fit", f"and {moved_at}–59 to", "session"):
        identify("ur5e", Dataset(q, points))
    names = np.where(np.arange(60) < moved_at, "before", "after")
    found = identify("ur5e", Dataset(q, points, session=names))
    assert found.best.held_out.position_mm.mean < 0.2


def test_rows_that_fit_nowhere_after_some_are_said_alone():
    q, points = rows(4, 60)
    points[35:] = np.random.default_rng(0).permutation(points[35:])
    with refuses(DataError, "data rows 0–34 fit", "those after them don't"):
        identify("ur5e", Dataset(q, points))


def test_nothing_is_said_of_rows_in_no_order():
    q, points = rows(5, 60)
    with refuses(DataError, "off with the best base and tool") as caught:
        identify("ur5e", Dataset(q, np.random.default_rng(1).permutation(points)))
    assert "data rows" not in str(caught.value)
