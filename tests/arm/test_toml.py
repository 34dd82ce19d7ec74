"""Robot files: what the page of formats promises, round trips, and one error for each mistake."""

import contextlib
from dataclasses import replace

import numpy as np
import pytest
from checks import any_joints
from hypothesis import given, settings
from hypothesis import strategies as st

from workbench import Frame, Mounting, Robot, load_robot, tool_poses, write_toml
from workbench.arm.robot import JointKind
from workbench.arm.robot_toml import _RobotReader, read_toml, robot_from_table
from workbench.base import se3
from workbench.base.assets import built_in_robots
from workbench.base.errors import FileError
from workbench.base.types import Freedom, frozen

ARM = 'convention = "hayati"\n[[joint]]\nd = 0.1\n'
ELEMENTS = 'convention = "elementary"\n[[element]]\naxis = "rx"\njoint = 1\n'


def read(folder, text):
    path = folder / "robot.toml"
    path.write_text(text, encoding="utf-8")
    return read_toml(path)


def assert_same(first, second):
    """Everything that a robot's file can say is equal."""
    q = any_joints(first, 5)
    np.testing.assert_allclose(tool_poses(first, q), tool_poses(second, q), atol=1e-9)
    for name in ("name", "convention", "dof", "default_free", "link_ends"):
        assert getattr(first, name) == getattr(second, name)
    np.testing.assert_array_equal(first.limits, second.limits)
    np.testing.assert_array_equal(first.gravity, second.gravity)
    assert (first.base.free, first.tool.free) == (second.base.free, second.tool.free)
    for a, b in zip(first.joints, second.joints, strict=True):
        assert (a.name, a.kind, a.mass, a.max_moment) == (b.name, b.kind, b.mass, b.max_moment)
        np.testing.assert_array_equal(a.com, b.com)
    assert [e.name for e in first.elements] == [e.name for e in second.elements]
    np.testing.assert_array_equal(first.chain.values, second.chain.values)


def test_everything_that_the_page_of_formats_shows(tmp_path):
    robot = read(
        tmp_path,
        """
name = "ARIA"
convention = "hayati"
gravity = [0.0, 1.0, -9.81]
base = { xyz = [1, 2, 3], rpy = [0.1, 0.2, 0.3], free = true }
tool = { xyz = [0, 0, 0.2], free = "auto" }
session = [
    { name = "front-left", base = { xyz = [1, 0, 0] }, tool = { xyz = [0, 1, 0], rpy = [0, 0, 0.5] } },
    { name = "rear", base = { xyz = [2, 0, 0] } },
]
[[joint]]
theta = 0.1
d = 0.205
a = 0.02
alpha = 1.5707963267948966
beta = 0.01
free = ["theta", "d"]
limits = [-6.28, 6.28]
mass = 2.6
com = [0.0, -0.05, 0.0]
max_moment = 40.0
[[joint]]
type = "prismatic"
a = 0.3
limits = [0.0, 0.5]
[[joint]]
type = "fixed"
theta = 0.5
""",
    )
    assert (robot.name, robot.convention, robot.dof) == ("ARIA", "hayati", 2)
    np.testing.assert_array_equal(robot.gravity, [0.0, 1.0, -9.81])
    np.testing.assert_array_equal(robot.limits, [[-6.28, 6.28], [0.0, 0.5]])
    first = robot.joints[0]
    assert (first.mass, first.max_moment) == (2.6, 40.0)
    np.testing.assert_array_equal(first.com, [0.0, -0.05, 0.0])
    assert [j.kind for j in robot.joints] == [JointKind.REVOLUTE, JointKind.PRISMATIC, JointKind.FIXED]
    parts = ("1.theta", "1.d", "2.theta", "2.d", "2.a", "2.alpha")
    assert robot.default_free == tuple(f"joint{part}" for part in parts)
    np.testing.assert_allclose(robot.base.rpy, [0.1, 0.2, 0.3], atol=1e-15)
    assert (robot.base.free, robot.tool.free) == (Freedom.FREE, Freedom.AUTO)
    assert list(robot.sessions) == ["front-left", "rear"]
    np.testing.assert_allclose(robot.in_session("front-left").tool.rpy, [0, 0, 0.5], atol=1e-15)
    assert robot.in_session("rear").tool is robot.tool
    assert robot.in_session("unknown").base is robot.base


def test_defaults(tmp_path):
    robot = read(tmp_path, ARM)
    assert robot.name == "robot"
    np.testing.assert_array_equal(robot.gravity, [0, 0, -9.81])
    np.testing.assert_array_equal(robot.limits, [[-np.inf, np.inf]])
    np.testing.assert_array_equal(robot.base.pose, np.eye(4))
    assert (robot.base.free, robot.tool.free) == (Freedom.AUTO, Freedom.AUTO)
    assert robot.joints[0].mass is None
    assert not robot.has_masses


@pytest.mark.parametrize("name", built_in_robots())
def test_built_in_arms_round_trip(name, tmp_path):
    robot = load_robot(name)
    assert_same(robot, read_toml(write_toml(robot, tmp_path / "copy.toml")))


number = st.floats(-10, 10).map(lambda v: float(np.float64(v)))
joint = st.fixed_dictionaries(
    dict.fromkeys(("theta", "d", "a", "alpha", "beta"), number)
    | {
        "kind": st.sampled_from(["revolute", "prismatic", "fixed"]),
        "free": st.lists(st.sampled_from(["theta", "d", "a", "alpha", "beta"]), unique=True),
    }
)


@given(
    st.sampled_from(["hayati", "dh", "craig", "craig-hayati", "three-rotation"]),
    st.lists(joint, min_size=1, max_size=4).filter(lambda joints: any(j["kind"] != "fixed" for j in joints)),
    st.lists(number, min_size=6, max_size=6),
    st.text(max_size=20).filter(str.isprintable),
)
@settings(max_examples=40)
def test_any_table_round_trips(tmp_path_factory, convention, joints, frame, name):
    lines = [f'convention = "{convention}"']
    for entry in joints:
        lines += ["[[joint]]", f'type = "{entry["kind"]}"', f"free = {entry['free']}"]
        lines += [f"{c} = {entry[c]!r}" for c in ("theta", "d", "a", "alpha", "beta")]
    lines += ["[base]", f"xyz = {frame[:3]}", f"rpy = {frame[3:]}"]
    folder = tmp_path_factory.mktemp("any")
    robot = read(folder, "\n".join(lines))
    object.__setattr__(robot, "name", name)
    again = read_toml(write_toml(robot, folder / "copy.toml"))
    assert_same(robot, again)


def test_elementary_round_trips_with_names_freedom_and_masses(tmp_path):
    robot = read(
        tmp_path,
        """
convention = "elementary"
element = [
    {axis = "tz", value = 0.3, name = "column", free = true}, {axis = "rx", joint = 1, value = 0.2},
    {axis = "ry", value = 0.4, free = true}, {axis = "ty", joint = 2}, {axis = "RZ", value = -0.6},
]
joint = [{mass = 2.0, com = [0.1, 0.2, 0.3], limits = [-1, 1]}, {type = "prismatic", mass = 1.0}]
""",
    )
    assert robot.default_free == ("column", "element3.ry")
    assert [j.kind for j in robot.joints] == [JointKind.REVOLUTE, JointKind.PRISMATIC]
    again = read_toml(write_toml(robot, tmp_path / "copy.toml"))
    assert_same(robot, again)


def test_sessions_and_frames_in_any_orientation_round_trip(tmp_path):
    rng = np.random.default_rng(3)

    def frame():
        return Frame(
            frozen(rng.normal(size=3)), frozen(se3.rotvec_to_matrix(rng.normal(size=3))), Freedom.FREE
        )

    lock = frozen(se3.rpy_to_matrix(np.array([0.3, np.pi / 2, 0.2])))
    robot = load_robot("aria").with_frames(base=Frame(frozen(np.ones(3)), lock), tool=frame())
    sessions = {name: Mounting(base=frame(), tool=frame()) for name in "ab"}
    robot = replace(robot, sessions=sessions)
    again = read_toml(write_toml(robot, tmp_path / "copy.toml"))
    assert_same(robot, again)
    assert list(again.sessions) == ["a", "b"]
    for first, second in zip(robot.sessions.values(), again.sessions.values(), strict=True):
        np.testing.assert_allclose(first.base.pose, second.base.pose, atol=1e-14)
        np.testing.assert_allclose(first.tool.pose, second.tool.pose, atol=1e-14)


MISTAKES = {
    "no text": "\x00\x01",
    "no convention": "[[joint]]\nd = 1.0\n",
    "unknown convention": 'convention = "denavit"\n[[joint]]\n',
    "unknown key": "mass = 1\n" + ARM,
    "no joint": 'convention = "hayati"',
    "NaN": ARM + "a = nan",
    "too large": ARM + "a = " + "9" * 400,
    "true for a number": ARM + "a = true",
    "limits reversed": ARM + "limits = [1, -1]",
    "negative mass": ARM + "mass = -1",
    "free names nothing": ARM + 'free = ["gamma"]',
    "order where there is none": ARM + 'order = "zyx"',
    "two sessions of one name": ARM + '[[session]]\nname = "a"\n[[session]]\nname = "a"',
    "element in another convention": ARM + '[[element]]\naxis = "rx"',
    "no driven element": 'convention = "elementary"\n[[element]]\naxis = "rx"',
    "joint numbers begin at 2": ELEMENTS.replace("joint = 1", "joint = 2"),
    "gap in the joint numbers": ELEMENTS + '[[element]]\naxis = "rx"\njoint = 3',
    "joint twice": ELEMENTS + '[[element]]\naxis = "rx"\njoint = 1',
    "an element with the base's name": ELEMENTS + 'name = "base.x"',
    "3000 joints": 'name = "x"\nconvention = "dh"\n' + "[[joint]]\n" * 3000,
    "a number of thousands of digits": f"a = {'9' * 5000}",
    "brackets without end": "a = " + 1500 * "[",
    "another kind than the element's": ELEMENTS + '[[joint]]\ntype = "prismatic"',
}


@pytest.mark.parametrize("name", MISTAKES)
def test_each_mistake_is_one_file_error(name, tmp_path):
    with pytest.raises(FileError) as caught:
        read(tmp_path, MISTAKES[name])
    assert caught.value.path == str(tmp_path / "robot.toml")
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) <= 300


KEYS = st.sampled_from(["name", "convention", "joint", "element", "base", "session", "gravity"])
INNER = st.sampled_from(["axis", "joint", "value", "free", "type", "order", "name", "xyz", "limits"])
WORDS = st.sampled_from(["hayati", "elementary", "auto", "rx"])
VALUES = st.recursive(
    st.none() | st.booleans() | st.integers(-3, 3) | st.floats() | WORDS,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(INNER, inner, max_size=4),
    max_leaves=12,
)


@given(st.dictionaries(KEYS, VALUES))
@settings(max_examples=120)
def test_no_table_ends_in_another_error(data):
    data = _without_none({"convention": "elementary", **data})
    with contextlib.suppress(FileError):
        assert isinstance(robot_from_table(data, _RobotReader("x.toml")), Robot)


def _without_none(value):
    if isinstance(value, dict):
        return {k: _without_none(v) for k, v in value.items() if v is not None}
    return [_without_none(v) for v in value if v is not None] if isinstance(value, list) else value


EFFECTS_TOML = """
effect = [
{name = "joint-compliance", joints = [1], coefficients = [4.1e-5]},
{name = "joint-harmonic", joints = [1], order = 2, coefficients = [1e-3, 2e-3]},
{name = "local-joint-error", joints = [1], knots = [-1, 0, 1], range = [-0.9, 0.9], coefficients = [0, 1, 0]},
{name = "backlash", joints = [1], by = "motion", coefficients = [1e-3]},
{name = "thermal-growth", reference = 22.5, coefficients = [1e-5]},
]
"""


def test_effects_go_through_a_file(tmp_path):
    robot = read(tmp_path, EFFECTS_TOML + ARM)
    assert [str(e.name) for e in robot.effects] == [
        "joint-compliance", "joint-harmonic", "local-joint-error", "backlash", "thermal-growth"
    ]  # fmt: skip
    assert robot.effects[0].joints == (0,)
    assert robot.coefficients["joint1.sin2"] == 2e-3
    assert robot.effects[2].range == (-0.9, 0.9)
    assert robot.effects[4].reference == 22.5
    again = read_toml(write_toml(robot, tmp_path / "again.toml"))
    assert again.effects == robot.effects


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('name = "magic"\ncoefficients = [1.0]', "'magic'; known: joint-compliance"),
        ('name = ["a"]\ncoefficients = [1.0]', "known: joint-compliance"),
        ('name = "joint-compliance"\njoints = [1]', "no coefficients"),
        ('name = "joint-compliance"\njoints = [1]\ncoefficients = []', "no coefficients"),
        ('name = "joint-compliance"\njoints = [1]\ncoefficients = 3.0', "list of numbers"),
        ('name = "joint-compliance"\njoints = [1]\ncoefficients = ["a"]', "a number"),
        ('name = "joint-compliance"\njoints = [2]\ncoefficients = [1.0]', "joint 2"),
        ('name = "joint-compliance"\njoints = [0]\ncoefficients = [1.0]', "joint 0"),
        ('name = "joint-compliance"\njoints = 1\ncoefficients = [1.0]', "whole numbers"),
        ('name = "joint-compliance"\njoints = [1]\norder = 2\ncoefficients = [1.0]', "'order'"),
        ('name = "joint-harmonic"\njoints = [1]\norder = 2.5\ncoefficients = [1.0, 1.0]', "whole number"),
        ('name = "joint-harmonic"\njoints = [1]\ncoefficients = [1.0]', "needs 2"),
        ('name = "backlash"\njoints = [1]\nby = 3\ncoefficients = [1.0]', "by must be text"),
        ('name = "local-joint-error"\njoints = [1]\ncoefficients = [1.0]', "knots"),
    ],
)
def test_mistakes_in_effects_are_named(tmp_path, text, message):
    with pytest.raises(FileError, match=message):
        read(tmp_path, ARM + "[[effect]]\n" + text + "\n")
