import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from refusals import refuses
from scipy.spatial.transform import Rotation

from workbench import Dataset, load_robot
from workbench.base.errors import DataError
from workbench.data.plausibility import checked, refuse_joint_units, repeated_rows

LIMITS = np.array([[-6.28, 6.28], [-2.0, 2.0], [-np.inf, np.inf]])
ARM = SimpleNamespace(limits=LIMITS, reach=0.9, moving=())


def dataset(rows=20, *, angle=1.0, length=1.0, **more):
    rng = np.random.default_rng(1)
    given = {
        "q": angle * rng.uniform(-1.5, 1.5, (rows, 3)),
        "row": np.arange(rows),
        "position": length * (rng.uniform(-0.5, 0.5, (rows, 3)) + np.array([4.0, 2.0, 1.0])),
        "rotation": Rotation.random(rows, rng).as_matrix(),
    }
    return Dataset(**(given | more))


SLIDE = np.column_stack([dataset().q[:, :2], np.linspace(0, 800, 20)])


@pytest.mark.parametrize(
    ("data", "word", "where"),
    [(dataset(angle=57.3), "q1[deg]", {"joint": 1}), (dataset(q=SLIDE), "mm labelled m", {"joint": 2})],
)
def test_what_no_arm_does_names_joint_or_row(data, word, where):
    limits = np.array([*LIMITS[:2], [0.0, 1.0]]) if where == {"joint": 2} else LIMITS
    with refuses(DataError, word, **where):
        checked(SimpleNamespace(**vars(ARM) | {"limits": limits}), data)


@pytest.mark.parametrize(
    ("units", "joint"),
    [(("rad", "mm", "m"), 2), (("rad", "deg", "deg"), 3), (("", "inch"), 2), (("rad", "deg", "cm"), 0)],
)
def test_a_column_of_another_quantity_than_its_joint(tmp_path, units, joint):
    """A slide in radians is read as metres: so writes who does not know the arm."""
    joints = "".join(
        f'[[joint]]\ntype = "{kind}"\ntheta = 0.0\nd = 0.1\na = {a}\nalpha = 1.5\nlimits = [-1, 1]\n'
        for kind, a in (("revolute", 0.2), ("revolute", 0.3), ("prismatic", 0.0))
    )
    (tmp_path / "a.toml").write_text(f'name = "a"\nconvention = "dh"\n{joints}')
    robot = load_robot(tmp_path / "a.toml")
    if not joint:
        return refuse_joint_units(robot, None, units, "a.csv")
    with refuses(DataError, f"joint {joint}", f"q{joint}[{units[joint - 1]}]"):
        refuse_joint_units(robot, None, units, "a.csv")


@pytest.mark.parametrize(
    ("data", "word"),
    [
        (dataset(q=dataset().q * [1, 1, 0]), r"joint\(s\) 3 never move"),
        (dataset(q=dataset().q + np.array([0, 1.0, 0])), "joint 2 is outside its limits"),
        (dataset().take(np.array([*range(20), 3])), "1 duplicate row ignored"),
    ],
)
def test_what_is_odd_is_noted(data, word):
    notes = checked(ARM, data).notes
    assert len(notes) == 1
    assert re.search(word, notes[0])


@pytest.mark.parametrize(("settling", "notes"), [(0.0, 0), (1e-3, 1)])
def test_readings_that_began_before_the_arm_stood_still(settling, notes):
    rows = dataset(60, q=np.repeat(dataset().q[:12], 5, axis=0))
    place = np.repeat(rows.position[::5], 5, axis=0) + 2e-5 * np.random.default_rng(3).normal(size=(60, 3))
    place[:, 0] += settling * np.tile(np.exp(-np.arange(5.0)), 12)
    found = checked(ARM, replace(rows, position=place)).notes
    assert len(found) == notes
    assert notes == 0 or "leave out rows 0, 1, 5, 6, 10, 11" in found[0]


def test_independent_readings_at_equal_joints_are_no_copies():
    q = np.zeros((3, 3))
    still = Dataset(q=q, tilt={1: np.array([[0.0, 1e-4], [0.0, 2e-4], [0.0, 1e-4]])})
    assert repeated_rows(still) == [(0, 2)]
    assert repeated_rows(replace(still, time=np.arange(3.0))) == []
    assert repeated_rows(replace(still, session=np.array(list("aab")))) == []
    seen = checked(ARM, replace(still, q=q + 1.0))
    assert seen.included.tolist() == [True, True, False]
    assert seen.reason[2] == "repeats data row 0 to the last digit"
    markers = np.array([[[1.0, 2, 3], [4, 5, 6]], [[1, 2, 3], [7, 8, 9]], [[np.nan] * 3, [4, 5, 6]]])
    seen = checked(ARM, Dataset(q=q + 1.0, markers=markers))
    assert np.c_[np.isnan(seen.markers[..., 0]), seen.included].tolist() == [[0, 0, 1], [1, 0, 1], [1, 1, 0]]
