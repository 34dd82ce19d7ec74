from dataclasses import replace

import numpy as np
import pytest

from workbench.arm.kinematics.forward import sensitivity, tool_poses
from workbench.arm.library import load_robot
from workbench.arm.motion import Motion
from workbench.arm.robot import Frame
from workbench.base import se3
from workbench.base.errors import DataError, OptionError, ShapeError
from workbench.identification.plate_check import Calibration, compare_plates
from workbench.identification.problem import Noise
from workbench.plate.plate import Kind, Plate, Target
from workbench.plate.region import Region

REGION = Region(min=np.zeros(3), max=np.ones(3))
SEATING = Noise(position=2e-5, rotation=1e-4)


@pytest.fixture(scope="module")
def arm():
    base = Frame.from_pose(
        se3.pose(se3.rotvec_to_matrix(np.array([0.3, 0.2, 1.0])), np.array([5.0, 4.0, 3.0]))
    )
    return load_robot("aria").with_frames(base=base)


@pytest.fixture(scope="module")
def q():
    return np.random.default_rng(7).uniform(-1.2, 1.2, (10, 6))


def plate_from(poses, kinds=None):
    """A nominal plate whose targets have these poses."""
    kinds = kinds or [Kind.SEAT] * len(poses)
    rpy = se3.matrix_to_rpy(poses[:, :3, :3])
    targets = tuple(Target(p[:3, 3].copy(), r, kind=k) for p, r, k in zip(poses, rpy, kinds, strict=True))
    return Plate(name="test", targets=targets, region=REGION)


def real_poses(arm, q):
    return tool_poses(arm.with_frames(base=Frame()), Motion(q))


def motion(rotvec, xyz):
    return se3.pose(se3.rotvec_to_matrix(np.array(rotvec)), np.array(xyz))


def test_a_plate_in_its_place_has_no_deviation(arm, q):
    found = compare_plates(plate_from(real_poses(arm, q)), arm, q, seating=SEATING)
    assert np.abs(found.deviations).max() < 1e-9
    assert found.placement == pytest.approx(np.eye(4), abs=1e-9)
    assert not found.displaced.any()
    assert found.p_values == pytest.approx(np.ones(10))


def test_a_displaced_plate_is_told_from_its_blocks(arm, q):
    placement = motion([0.02, -0.01, 0.05], [0.03, -0.02, 0.01])
    found = compare_plates(plate_from(se3.inverse(placement) @ real_poses(arm, q)), arm, q, seating=SEATING)
    assert found.placement == pytest.approx(placement, abs=1e-9)
    assert np.abs(found.blocks).max() < 1e-9
    assert found.distances.min() > 1e-3
    assert not found.displaced.any()


def test_a_displaced_block_is_found_with_its_displacement(arm, q):
    placement = motion([0.01, 0.0, -0.02], [0.01, 0.02, 0.0])
    real = real_poses(arm, q)
    nominal = se3.inverse(placement) @ real
    away, turn = np.array([4e-4, -3e-4, 0.0]), np.array([0.0, 2e-3, 0.0])
    # block 4 of the real plate is off by `away` and `turn` from where the placed nominal one has it
    moved = real[3].copy()
    moved[:3, 3] -= away
    moved[:3, :3] = se3.rotvec_to_matrix(-turn) @ moved[:3, :3]
    nominal[3] = se3.inverse(placement) @ moved
    found = compare_plates(plate_from(nominal), arm, q, seating=SEATING)
    assert np.flatnonzero(found.displaced).tolist() == [3]
    assert found.blocks[3] == pytest.approx(np.concatenate([away, turn]), abs=1e-9)
    assert found.block_distances[3] == pytest.approx(5e-4)
    assert found.block_angles[3] == pytest.approx(2e-3)
    assert np.delete(found.blocks, 3, axis=0) == pytest.approx(np.zeros((9, 6)), abs=1e-9)
    assert found.p_values[3] < 1e-6
    assert found.placement == pytest.approx(placement, abs=1e-9)


def test_noise_alone_accuses_nobody_and_is_as_large_as_said(arm, q):
    rng = np.random.default_rng(0)
    real, count, scores = real_poses(arm, q), 0, []
    for _ in range(40):
        noisy = real.copy()
        noisy[:, :3, 3] += rng.normal(0, SEATING.position, (10, 3))
        noisy[:, :3, :3] = se3.rotvec_to_matrix(rng.normal(0, SEATING.rotation, (10, 3))) @ real[:, :3, :3]
        found = compare_plates(plate_from(noisy), arm, q, seating=SEATING)
        count += found.displaced.any()
        scores.append(found.blocks / found.std)
    assert count <= 1
    assert np.std(scores) == pytest.approx(1.0, abs=0.05)


def test_the_calibrations_errors_are_no_blocks_fault(arm, q):
    names = arm.default_free
    sigma = 3e-4
    covariance = sigma**2 * np.eye(len(names))
    rng, real, blamed = np.random.default_rng(1), real_poses(arm, q), 0
    for _ in range(10):
        wrong = arm.with_values(
            dict(zip(names, arm.values(names) + rng.normal(0, sigma, len(names)), strict=True))
        )
        known = compare_plates(
            plate_from(real), wrong, q, calibration=Calibration(names, covariance), seating=SEATING
        )
        assert not known.displaced.any()
        assert not known.notes
        unknown = compare_plates(plate_from(real), wrong, q, seating=SEATING)
        blamed += unknown.displaced.any() or len(unknown.notes) > 1
        assert any("uncertainty" in note for note in unknown.notes)
    assert blamed == 10


def test_sockets_are_compared_by_position_and_repeats_averaged(arm, q):
    plate = plate_from(real_poses(arm, q), [Kind.SOCKET] * 10)
    rows = np.concatenate([np.arange(8), np.arange(8)])
    error = np.random.default_rng(2).normal(0, 1e-5, (8, 6))
    both = np.concatenate([q[:8] + error, q[:8] - error])
    found = compare_plates(plate, arm, both, targets=rows, seating=SEATING)
    assert found.visits.tolist() == [2] * 8 + [0] * 2
    assert np.isnan(found.deviations[:8, 3:]).all()
    assert np.abs(found.deviations[:8, :3]).max() < 1e-8
    assert np.isnan(found.deviations[8:]).all()
    assert not found.displaced.any()


def test_std_follows_the_joint_noise_of_the_calibration(arm, q):
    name = ("joint6.theta",)
    calibration = Calibration(name, np.array([[1e-6]]))
    plate = plate_from(real_poses(arm, q))
    sharp = compare_plates(plate, arm, q, seating=SEATING)
    wide = compare_plates(plate, arm, q, calibration=calibration, seating=SEATING)
    assert sensitivity(arm, Motion(q), name)[1].any()
    assert (wide.std[:, 3:] > sharp.std[:, 3:]).all()
    assert wide.std[:, 3:].max() == pytest.approx(1e-3, rel=0.2)


def test_contradicting_blocks_blame_none(arm, q):
    nominal = real_poses(arm, q)
    nominal[:, :3, 3] += np.random.default_rng(3).normal(0, 5e-3, (10, 3))
    found = compare_plates(plate_from(nominal), arm, q, seating=SEATING)
    assert any("contradict" in note for note in found.notes)


def test_bad_input(arm, q):
    plate = plate_from(real_poses(arm, q))
    with pytest.raises(ShapeError) as error:
        compare_plates(plate, arm, np.concatenate([q, q]))
    assert error.value.expected == 10
    with pytest.raises(DataError):
        compare_plates(plate, arm, q[:2])
    with pytest.raises(OptionError):
        compare_plates(plate, arm, q, calibration=Calibration(("joint9.theta",), np.eye(1)))
    assert compare_plates(replace(plate, name="other"), arm, q[:3]).visits.sum() == 3
