"""Joints exchanged or inverted, units and axes: named where one mistake explains the rows, else none is.

The rows are computed by other code, a product of matrices, of arms with errors of making of 1 mm and 1 mrad.
"""

from dataclasses import replace

import numpy as np
import pytest

from workbench.arm.robot import Robot
from workbench.data.dataset import Dataset
from workbench.identification.checks import likely_mistakes
from workbench.identification.checks.arm_match import arm_match

H = np.pi / 2
ARMS = {
    "puma": ([(0, 0.67, 0, H), (0, 0, 0.43, 0), (0, 0.15, 0.02, -H), (0, 0.43, 0, H), (0, 0, 0, -H),
              (0, 0.06, 0, 0)], "rrrrrr"),
    "seven": ([(0, 0.36, 0, -H), (0, 0, 0, H), (0, 0.42, 0, H), (0, 0, 0, -H), (0, 0.4, 0, -H), (0, 0, 0, H),
               (0, 0.126, 0, 0)], "rrrrrrr"),
    "scara": ([(0, 0.3, 0.35, 0), (0, 0, 0.25, np.pi), (0, 0.1, 0, 0), (0, 0, 0, 0)], "rrpr"),
    "gantry": ([(0, 1, 0, -H), (-H, 1, 0, -H), (H, 0.5, 0, 0), (0, 0.2, 0, H), (0, 0, 0.1, -H),
                (0, 0.15, 0, 0)], "ppprrr"),
}  # fmt: skip


def turn(axis: int, angle: float) -> np.ndarray:
    i, j = [(1, 2), (2, 0), (0, 1)][axis]
    pose = np.eye(4)
    pose[i, i] = pose[j, j] = np.cos(angle)
    pose[i, j], pose[j, i] = -np.sin(angle), np.sin(angle)
    return pose


def shift(*xyz: float) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, 3] = xyz
    return pose


def measured(name: str, *, with_rotation: bool) -> tuple[Robot, Dataset]:
    table, kinds = ARMS[name]
    rng = np.random.default_rng(3)
    made = np.array(table, float) + rng.uniform(-1e-3, 1e-3, (len(table), 4))
    span = np.array([1.8 if kind == "r" else 0.4 for kind in kinds])
    q = rng.uniform(-span, span, (50, len(kinds)))
    base, tool = shift(1.2, -0.7, 0.4) @ turn(2, 0.8) @ turn(0, 0.3), shift(0.05, 0.08, 0.11) @ turn(1, 0.4)
    poses = []
    for row in q:
        here = base
        for (theta, d, a, alpha), kind, value in zip(made, kinds, row, strict=True):
            here = here @ turn(2, theta + value * (kind == "r")) @ shift(0, 0, d + value * (kind == "p"))
            here = here @ shift(a, 0, 0) @ turn(0, alpha)
        poses.append(here @ tool)
    seen = np.array(poses)
    xyz = seen[:, :3, 3] + rng.normal(0.0, 5e-5, (50, 3))
    joints = [
        {
            "type": "prismatic" if kind == "p" else "revolute",
            **dict(zip(("theta", "d", "a", "alpha"), row, strict=True)),
        }
        for row, kind in zip(table, kinds, strict=True)
    ]
    rows = Dataset(q=q, position=xyz, rotation=seen[:, :3, :3] if with_rotation else None, source=name)
    return Robot.from_dh(joints, name=name), rows


def mistakes(data: Dataset, kinds: str):
    """What may be wrong in a file: the words that name it, and the rows."""
    n = len(kinds)
    for i, j in ((0, 1), (1, 2), (n - 2, n - 1)):
        if kinds[i] == kinds[j]:
            order = np.arange(n)
            order[[i, j]] = j, i
            yield f"q{i + 1} and q{j + 1} look exchanged", replace(data, q=data.q[:, order])
    for joints in ((0,), (2,), (0, n - 1)):
        signs = np.where(np.isin(np.arange(n), joints), -1.0, 1.0)
        names = " and ".join(f"q{k + 1}" for k in joints)
        yield f"{names} seem", replace(data, q=data.q * signs)
    yield "inch labelled mm", replace(data, position=data.position / 25.4)
    yield (
        "rad labelled degrees",
        replace(data, q=data.q * np.where([k == "r" for k in kinds], np.pi / 180, 1.0)),
    )
    if data.rotation is None:
        yield "two of x, y, z look exchanged", replace(data, position=data.position[:, [1, 0, 2]])
    else:
        yield "x and y look exchanged", replace(data, position=data.position[:, [1, 0, 2]])


@pytest.mark.parametrize(
    ("name", "with_rotation"), [("puma", True), ("seven", False), ("scara", False), ("gantry", False)]
)
def test_a_mistake_is_named_or_none_is_and_never_another(name, with_rotation):
    robot, data = measured(name, with_rotation=with_rotation)
    named = total = 0
    for expected, rows in mistakes(data, ARMS[name][1]):
        found, total = arm_match(robot, rows), total + 1
        if not found.mistake:
            continue
        named += 1
        assert found.is_foreign
        assert expected in found.mistake, (expected, found.text)
        assert found.mistake_error < 0.005 < found.error
        assert found.mistake in found.text
    assert named >= 0.6 * total, (named, total)


@pytest.mark.parametrize("name", ARMS)
def test_rows_that_fit_are_not_searched(name, monkeypatch):
    monkeypatch.setattr(likely_mistakes, "_readings", None)
    robot, data = measured(name, with_rotation=False)
    found = arm_match(robot, data)
    assert found.error < 0.005
    assert not found.is_foreign
