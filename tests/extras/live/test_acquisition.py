"""Guided measuring without a page: what is stored for which target, what is refused and why."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from refusals import refuses

from workbench import Motion, load_plate, load_robot, tool_poses
from workbench.base import se3
from workbench.base.errors import DataError
from workbench.extras.live.acquisition import Acquisition
from workbench.extras.live.sample import Sample
from workbench.extras.live.standstill import ArmState
from workbench.session.start import start

ARM, PLATE = load_robot("aria"), load_plate("table2")


def acquired(plate=PLATE):
    return Acquisition(plate=plate, robot=ARM)


@cache
def postures() -> list[np.ndarray]:
    """Joints at the targets."""
    return [state.q for state in start(ARM, PLATE).states]


def at(k: int, *, pose: bool = True) -> Sample:
    """The arm at its k-th target, counted from 0."""
    q = postures()[k]
    found = tool_poses(ARM, Motion(q[None]))[0]
    seen = {"position": found[:3, 3], "rotation": found[:3, :3]} if pose else {}
    return Sample(time=float(k), q=q, **seen)


def standing(acquisition, sample):
    return acquisition.with_sample(sample, ArmState.STILL)


def stored(acquisition, *targets, **options):
    for k in targets:
        acquisition = standing(acquisition, at(k, **options)).stored()
    return acquisition


def test_without_a_pose_the_target_s_own_is_stored():
    """Also where poses come after all: one file has one kind."""
    data = stored(stored(acquired(), 0, pose=False), 1).dataset(source="x")
    np.testing.assert_array_equal(data.position, PLATE.poses[:2, :3, 3])
    assert any("poses of the targets" in note for note in data.notes)


def test_a_lost_tool_is_not_stored_and_orientations_that_some_rows_lack_are_left_out():
    acquisition = standing(stored(acquired(), 0), at(1, pose=False))
    with refuses(DataError, "does not see"):
        acquisition.stored()
    data = standing(acquisition, replace(at(1), rotation=None)).stored().dataset(source="x")
    assert data.rotation is None
    assert any("2 of 10" in note for note in data.notes)


@pytest.mark.parametrize(
    ("acquisition", "reason"),
    [
        (acquired, "no sample"),
        (lambda: acquired().with_sample(at(0), ArmState.MOVING), "moving"),
        (lambda: replace(standing(acquired(), at(0)), silence=3.0), "silent for 3 s"),
        (lambda: standing(replace(stored(acquired(), 0), current=1), at(0)), "not moved"),
        (
            lambda: standing(stored(acquired(replace(PLATE, targets=PLATE.targets[:1])), 0), at(0)),
            "every target",
        ),
    ],
    ids=["nothing", "moving", "silent", "same place", "complete"],
)
def test_what_is_not_stored(acquisition, reason):
    with refuses(DataError, reason):
        acquisition().stored()


def test_a_sample_that_asks_is_stored_or_the_reason_is_said():
    asks = replace(at(0), capture=True)
    assert [*standing(acquired(), asks).rows] == [0]
    assert "too far apart" in acquired().with_sample(asks, ArmState.UNKNOWN).message
    moving = acquired().with_sample(asks, ArmState.MOVING)
    assert (len(moving.rows), moving.message.startswith("not stored")) == (0, True)


@pytest.mark.parametrize("pose", [True, False])
def test_a_row_is_not_booked_for_a_target_where_the_tool_is_not(pose):
    """An arm that stood at target 4 was booked as target 1, and the whole series was shifted by three."""
    acquisition = standing(acquired(), at(3, pose=pose))
    far = np.linalg.norm(PLATE.targets[3].xyz - PLATE.targets[0].xyz)
    place = acquisition.place()
    assert not place.is_known
    assert "target 4" in place.advice
    with refuses(DataError, "target 1", "target 4", f"{1e3 * far:.1f} mm"):
        acquisition.stored()
    acquisition = acquisition.next(3).stored()
    assert acquisition.current == 4
    acquisition = stored(acquisition, 4, 5, pose=pose)
    assert acquisition.dataset(source="x").group.tolist() == ["target 4", "target 5", "target 6"]


@pytest.mark.parametrize(("millimetres", "degrees", "known"), [(29, 0, True), (31, 0, False), (0, 6, False)])
def test_a_tool_is_at_its_target_within_30_mm_and_5_degrees(millimetres, degrees, known):
    pose = np.array(PLATE.targets[0].pose)
    turn = se3.rotvec_to_matrix(np.array([0.0, 0.0, np.deg2rad(degrees)]))
    place = pose[:3, 3] + [1e-3 * millimetres, 0.0, 0.0]
    q = postures()[0] + 0.3  # the joints say nothing
    sample = Sample(time=0.0, q=q, position=place, rotation=turn @ pose[:3, :3])
    assert standing(acquired(), sample).place().is_known is known


def test_an_instrument_in_a_frame_of_its_own_is_no_reason_to_refuse():
    """A tracker that stands anywhere measures no pose near a target; the joints tell where the arm is."""
    acquisition = acquired()
    for k in (0, 1):
        sample = at(k)
        acquisition = standing(
            acquisition, replace(sample, position=np.add(sample.position, (2.0, -1.0, 0.5)))
        )
        acquisition = acquisition.stored()
        assert " mm" in acquisition.message
    sample = at(3)
    acquisition = standing(acquisition, replace(sample, position=np.add(sample.position, (2.0, -1.0, 0.5))))
    assert "target 4" in acquisition.place().advice


def test_rows_are_taken_again_and_targets_passed_over():
    acquisition = stored(stored(acquired(), 0, 1, 2).next(2), 5)
    assert [*acquisition.rows] == [0, 1, 2, 5]
    acquisition = acquisition.again().again()
    assert ([*acquisition.rows], acquisition.current) == ([0, 1], 2)
    acquisition = acquisition.next(-3)
    assert acquisition.current == len(PLATE) - 1
    acquisition = acquisition.next(1).again()
    assert ([*acquisition.rows], acquisition.current) == ([1], 0)
