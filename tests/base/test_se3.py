"""Rigid motions: hand-worked numbers, inverses, round trips at every angle that is special."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from workbench.base import se3

PI = np.pi
SPECIAL = [0.0, 1e-12, 1e-9, 1e-8, 1e-7, 1e-5, 9.9e-5, 1.01e-4, 1e-3, 0.5, PI / 2, 2.0]
NEAR_PI = [PI - 1e-3, PI - 1e-6, PI - 1e-8, PI - 1e-12]
AXES = [
    np.array(a, float) / np.linalg.norm(a) for a in [(1, 0, 0), (0, -1, 0), (0, 0, 1), (1, 2, -3), (-1, 1, 1)]
]

vectors = arrays(float, 3, elements=st.floats(-10, 10))
eulers = arrays(float, 3, elements=st.floats(-PI, PI))
sixes = arrays(float, 6, elements=st.floats(-PI, PI))
rotvecs = arrays(float, 3, elements=st.floats(-1.8, 1.8)).filter(lambda v: np.linalg.norm(v) < PI - 1e-3)


def at(six):
    """Transform with position six[:3] and roll, pitch, yaw six[3:]."""
    return se3.pose(se3.rpy_to_matrix(six[3:]), six[:3])


def exponential(v):
    """Matrix exponential of [v]x by its series, in extended precision."""
    k = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]], np.longdouble)
    term, total = np.eye(3, dtype=np.longdouble), np.eye(3, dtype=np.longdouble)
    for n in range(1, 60):
        term = term @ k / n
        total = total + term
    return total.astype(float)


def test_roll_pitch_yaw_by_hand():
    # yaw last: x of the body goes to y of the base
    np.testing.assert_allclose(se3.rpy_to_matrix(np.array([0, 0, PI / 2]))[:, 0], [0, 1, 0], atol=1e-15)
    np.testing.assert_allclose(se3.rpy_to_matrix(np.array([PI / 2, 0, 0]))[:, 1], [0, 0, 1], atol=1e-15)
    np.testing.assert_allclose(se3.rpy_to_matrix(np.array([0, PI / 2, 0]))[:, 2], [1, 0, 0], atol=1e-15)
    r, p, y = 0.3, -0.7, 1.9
    cr, sr, cp, sp, cy, sy = np.cos(r), np.sin(r), np.cos(p), np.sin(p), np.cos(y), np.sin(y)
    expected = (
        np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
        @ np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
        @ np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    )
    np.testing.assert_allclose(se3.rpy_to_matrix(np.array([r, p, y])), expected, atol=1e-15)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("gap", [0.0, 1e-16, 1e-13, 1e-12, 1e-11, 1e-9, 1e-8, 1e-7, 1e-5, 1e-3])
def test_rpy_round_trip_at_gimbal_lock(sign, gap):
    for roll, yaw in [(0.3, 1.1), (-2.0, 3.0), (0.0, 0.0), (PI, -PI / 2)]:
        rotation = se3.rpy_to_matrix(np.array([roll, sign * (PI / 2 - gap), yaw]))
        rpy = se3.matrix_to_rpy(rotation)
        assert abs(rpy[1]) <= PI / 2 + 1e-15
        np.testing.assert_allclose(se3.rpy_to_matrix(rpy), rotation, atol=1e-14)


@given(eulers)
@settings(max_examples=60)
def test_quaternion_round_trip(rpy):
    rotation = se3.rpy_to_matrix(rpy)
    quaternion = se3.matrix_to_quaternion(rotation)
    assert quaternion[0] >= 0
    np.testing.assert_allclose(np.linalg.norm(quaternion), 1.0, atol=1e-15)
    np.testing.assert_allclose(se3.quaternion_to_matrix(quaternion), rotation, atol=1e-14)


@pytest.mark.parametrize("axis", AXES, ids=str)
@pytest.mark.parametrize("angle", SPECIAL + NEAR_PI)
def test_exponential_and_logarithm(angle, axis):
    rotation = se3.rotvec_to_matrix(angle * axis)
    np.testing.assert_allclose(rotation, exponential(angle * axis), atol=2e-15)
    np.testing.assert_allclose(se3.matrix_to_rotvec(rotation), angle * axis, atol=5e-15, rtol=1e-12)


@pytest.mark.parametrize("axis", AXES, ids=str)
def test_logarithm_of_a_half_turn(axis):
    found = se3.matrix_to_rotvec(2 * np.outer(axis, axis) - np.eye(3))
    np.testing.assert_allclose(np.abs(found @ axis), PI, atol=1e-14)
    np.testing.assert_allclose(np.linalg.norm(found), PI, atol=1e-14)


@given(vectors, vectors)
@settings(max_examples=60)
def test_skew_is_the_cross_product(u, v):
    np.testing.assert_allclose(se3.skew(u) @ v, np.cross(u, v), atol=1e-12)
    many = np.stack([[u, v], [v, u]])
    np.testing.assert_array_equal(se3.cross(many, many[::-1]), np.cross(many, many[::-1]))


@given(sixes)
@settings(max_examples=60)
def test_inverse(six):
    np.testing.assert_allclose(at(six) @ se3.inverse(at(six)), np.eye(4), atol=1e-13)


@given(rotvecs, arrays(float, 3, elements=st.floats(-1, 1)))
@settings(max_examples=60)
def test_left_jacobian_inverse_is_the_derivative_of_the_logarithm(rotvec, direction):
    step = 1e-6
    base = se3.rotvec_to_matrix(rotvec)
    ends = [se3.matrix_to_rotvec(se3.rotvec_to_matrix(s * step * direction) @ base) for s in (1, -1)]
    slope = (ends[0] - ends[1]) / (2 * step)
    np.testing.assert_allclose(se3.left_jacobian_inverse(rotvec) @ direction, slope, atol=2e-7)


@given(sixes, st.integers(3, 8), st.integers(0, 1000))
@settings(max_examples=60)
def test_best_fit_finds_the_transform(six, number, seed):
    transform = at(six)
    points = np.random.default_rng(seed).normal(size=(number, 3))
    found = se3.best_fit(points, se3.apply(transform, points))
    np.testing.assert_allclose(se3.apply(found, points), se3.apply(transform, points), atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(found[:3, :3]), 1.0, atol=1e-13)


def test_best_fit_of_mirrored_points_is_no_reflection():
    points = np.random.default_rng(1).normal(size=(6, 3))
    found = se3.best_fit(points, points * [1, 1, -1])
    np.testing.assert_allclose(np.linalg.det(found[:3, :3]), 1.0, atol=1e-13)


def test_best_fit_of_points_on_a_line():
    line = np.c_[np.random.default_rng(2).normal(size=5), np.zeros((5, 2))]
    truth = se3.pose(se3.rotvec_to_matrix(np.array([2.0, 1.0, 0.5])), np.array([1.0, 2.0, 3.0]))
    found = se3.best_fit(line, se3.apply(truth, line))
    np.testing.assert_allclose(se3.apply(found, line), se3.apply(truth, line), atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(found[:3, :3]), 1.0, atol=1e-13)


@given(sixes, vectors, rotvecs)
@settings(max_examples=60)
def test_pose_error_is_what_has_to_be_added(six, shift, turn):
    predicted = at(six)
    measured = se3.pose(se3.rotvec_to_matrix(turn) @ predicted[:3, :3], predicted[:3, 3] + shift)
    error = se3.pose_error(measured, predicted)
    np.testing.assert_allclose(error[:3], shift, atol=1e-13)
    np.testing.assert_allclose(error[3:], turn, atol=1e-11)
