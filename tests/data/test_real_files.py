"""Every file of the real measurements is read as its SOURCE.md says, or refused with the right sentence."""

import numpy as np
import pytest
from refusals import mentions

from workbench.base import se3
from workbench.data.readers import read_measurements

pytestmark = [pytest.mark.data, pytest.mark.usefixtures("read_here")]


def angles_between(a, b):
    return np.linalg.norm(se3.matrix_to_rotvec(a @ np.swapaxes(b, -1, -2)), axis=-1)


@pytest.fixture(scope="module")
def ur10(shared_data):
    return read_measurements(shared_data / "ur10_ipa" / "measurements.csv", joints=6)


@pytest.mark.parametrize("name", ["ur5_plain.xlsx", "ur5_title_units_row.xlsx"])
def test_workbooks(shared_data, name):
    data = read_measurements(shared_data / "importer_variants" / name, joints=6)
    converted = read_measurements(shared_data / "ur5_jacobi" / "measurements.csv")
    expected = converted.take(np.arange(len(converted) - 20, len(converted)))
    np.testing.assert_allclose(data.q, expected.q, atol=2e-10)
    np.testing.assert_allclose(data.position, expected.position, atol=1e-9)


def test_german_utf16(shared_data, ur10):
    data = read_measurements(shared_data / "importer_variants" / "ur10_german_utf16.txt", joints=6)
    np.testing.assert_allclose(data.q, ur10.q[:200], atol=1e-8)
    np.testing.assert_allclose(data.position, ur10.position[:200], atol=6e-8)
    np.testing.assert_allclose(data.temperature, ur10.temperature[:200], atol=6e-3)
    assert data.rotation is None
    message = " | ".join(data.notes)
    assert all(word in message for word in ("utf-16", "decimal commas", "'Achse 1 [°]'", "q1 … q6", "'Nr'"))


@pytest.mark.parametrize("joints", ["q1[deg],…,q6[deg]", "q[deg]", "q1[deg]..q6[deg]"])
def test_quaternions_without_header(shared_data, ur10, joints):
    file = shared_data / "importer_variants" / "ur10_no_header_quaternion.txt"
    data = read_measurements(file, columns=f"{joints},xyz[mm],quat", joints=6)
    np.testing.assert_allclose(data.q, ur10.q[:200], atol=1e-8)
    np.testing.assert_allclose(data.position, ur10.position[:200], atol=6e-8)
    assert angles_between(data.rotation, ur10.rotation[:200]).max() < 1e-6


def test_rotation_vectors_with_a_gap_and_a_repeat(shared_data, ur10):
    file = shared_data / "importer_variants" / "ur10_rotvec_missing_outlier.csv"
    data = read_measurements(file, joints=6)
    assert np.flatnonzero(data.exclude).tolist() == [12]
    assert data.reason[12] == "lacks z"
    assert mentions(" | ".join(data.notes), "row 12 (line 14)", "z")
    first = ur10.take(np.arange(12))
    np.testing.assert_allclose(data.position[:12], first.position, atol=1e-9)
    assert angles_between(data.rotation[:12], first.rotation).max() < 2e-8
