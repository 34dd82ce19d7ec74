"""Guided measuring without a terminal: what is stored for which target, what is refused and why."""

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from refusals import mentions

from workbench.arm.built_in_arms import load_robot
from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.base import se3
from workbench.base.errors import DataError, FileError, OptionError, ShapeError
from workbench.data.readers import read_measurements
from workbench.data.simulation.instruments import instrument_named
from workbench.extras.live.acquisition import Acquisition, PoseSource, plate_targets
from workbench.extras.live.connection import connect, first_listener, send_samples
from workbench.extras.live.driver import DrivePace, drive, drive_plate
from workbench.extras.live.guided_measurement import capture
from workbench.extras.live.sample import Sample, format_sample, parse_sample
from workbench.extras.live.standstill import ArmState
from workbench.plate.plate_toml import load_plate
from workbench.session.start import start

ARM, PLATE = load_robot("aria"), load_plate("table2")
QUICK = DrivePace(rate=20.0, dwell=0.8)


def acquired(plate=PLATE, **options):
    return Acquisition(plate_targets(ARM, plate), robot=ARM, **options)


@cache
def postures() -> list[np.ndarray]:
    """Joints at the targets."""
    return [state.q for state in start(ARM, PLATE).states]


def still(k: int, *, start: float, q=None, pose: bool = True, flag: bool = False, count: int = 40):
    """Samples of an arm that stands at its k-th target, counted from 0."""
    q = postures()[k] if q is None else q
    found = tool_poses(ARM, Motion(q[None]))[0]
    for i in range(count):
        yield Sample(
            time=start + i / 20.0,
            q=q,
            position=found[:3, 3] if pose else None,
            rotation=found[:3, :3] if pose else None,
            capture=flag and i == count - 1,
        )


def fed(acquisition, samples):
    events = [acquisition.update(sample) for sample in samples]
    return [event for event in events if event is not None]


def stored(acquisition):
    return [i for i, sample in enumerate(acquisition.taken) if sample is not None]


def test_a_measured_pose_is_stored_with_its_joints():
    acquisition = acquired(session="front")
    fed(acquisition, still(0, start=0.0))
    assert acquisition.arm_state is ArmState.STILL
    assert acquisition.store().changed
    data = acquisition.dataset(source="here")
    assert data.session.tolist() == ["front"]
    np.testing.assert_allclose(data.position[0], tool_poses(ARM, Motion(data.q))[0, :3, 3])
    assert acquisition.source is PoseSource.MEASURED
    assert acquisition.current == 1


def test_without_a_pose_the_target_s_own_is_stored():
    acquisition = acquired()
    fed(acquisition, still(0, start=0.0, pose=False))
    assert not acquisition.status().is_measured
    acquisition.store()
    np.testing.assert_array_equal(acquisition.dataset(source="x").position[0], PLATE.targets[0].xyz)
    assert acquisition.source is PoseSource.REFERENCE
    fed(acquisition, still(1, start=9.0))  # poses come after all: one file has one kind
    acquisition.store()
    np.testing.assert_array_equal(acquisition.dataset(source="x").position[1], PLATE.targets[1].xyz)


def test_a_lost_tool_is_not_stored_and_orientations_that_some_rows_lack_are_left_out():
    acquisition = acquired()
    fed(acquisition, still(0, start=0.0))
    acquisition.store()
    fed(acquisition, still(1, start=2.0, pose=False))
    assert not acquisition.store().changed
    for sample in still(1, start=4.0):
        acquisition.update(replace(sample, rotation=None))
    assert acquisition.store().changed
    data = acquisition.dataset(source="x")
    assert data.rotation is None
    assert any("2 of 10" in note for note in data.notes)


def test_nothing_is_stored_while_the_arm_moves_unless_forced():
    acquisition = acquired()
    assert not acquisition.store().changed  # no sample yet
    moving = [
        replace(sample, q=sample.q + 0.01 * i) for i, sample in enumerate(still(0, start=0.0, flag=True))
    ]
    (refused,) = fed(acquisition, moving)
    assert not refused.changed
    assert acquisition.arm_state is ArmState.MOVING
    assert not acquisition.store().changed
    assert acquisition.store(force=True).changed


def elsewhere(acquisition, k, *, start, **options):
    """What comes of an arm that stands at the k-th target, whichever is current."""
    return fed(acquisition, still(k, start=start, flag=True, **options))[-1]


@pytest.mark.parametrize("pose", [True, False])
def test_a_row_is_not_booked_for_a_target_where_the_tool_is_not(pose):
    """An arm that stood at target 4 was booked as target 1, and the whole series was shifted by three."""
    acquisition = acquired()
    refused = elsewhere(acquisition, 3, start=0.0, pose=pose)
    assert not refused.changed
    assert mentions(refused.message, "target 1")
    assert mentions(refused.message, "target 4")
    place = acquisition.status().place
    assert (place.is_known, place.looks_like) == (False, 3)
    far = np.linalg.norm(PLATE.targets[3].xyz - PLATE.targets[0].xyz)
    assert f"{1e3 * far:.1f} mm" in place.text
    assert not acquisition.store().changed
    assert acquisition.store_as(3).changed
    assert acquisition.current == 4
    assert [elsewhere(acquisition, k, start=10.0 * k, pose=pose).changed for k in (4, 5)] == [True, True]
    assert stored(acquisition) == [3, 4, 5]
    names = acquisition.dataset(source="x").group.tolist()
    assert names == ["target 4", "target 5", "target 6"]


@pytest.mark.parametrize("pose", [True, False])
def test_at_no_target_nothing_is_stored_unless_told_so(pose):
    acquisition = acquired()
    fed(acquisition, still(0, start=0.0, q=postures()[0] + 0.3, pose=pose))
    place = acquisition.status().place
    assert (place.is_known, place.looks_like) == (False, None)
    assert not acquisition.store().changed
    assert not acquisition.store_as(3).changed
    assert acquisition.current == 0
    assert acquisition.store(anywhere=True).changed


@pytest.mark.parametrize(("millimetres", "degrees", "known"), [(29, 0, True), (31, 0, False), (0, 6, False)])
def test_a_tool_is_at_its_target_within_30_mm_and_5_degrees(millimetres, degrees, known):
    acquisition = acquired()
    pose = np.array(PLATE.targets[0].pose)
    turn = se3.rotvec_to_matrix(np.array([0.0, 0.0, np.deg2rad(degrees)]))
    place = pose[:3, 3] + [1e-3 * millimetres, 0.0, 0.0]
    q = postures()[0] + 0.3  # the joints say nothing
    for k in range(20):
        acquisition.update(Sample(time=0.1 * k, q=q, position=place, rotation=turn @ pose[:3, :3]))
    assert acquisition.store().changed is known


def test_an_instrument_in_a_frame_of_its_own_is_no_reason_to_refuse():
    """A tracker that stands anywhere measures no pose near a target; the joints tell where the arm is."""
    acquisition = acquired()
    away = np.array([2.0, -1.0, 0.5])
    for k in (0, 1, 3):
        for sample in still(k, start=10.0 * k):
            acquisition.update(replace(sample, position=sample.position + away))
        messages = acquisition.store()
        assert messages.changed is (k < 2)
        assert " mm" in messages.message
    assert acquisition.status().place.looks_like == 3


def test_an_arm_that_has_not_moved_on_is_no_next_target():
    acquisition = acquired()
    fed(acquisition, still(0, start=0.0, flag=True))
    fed(acquisition, still(0, start=2.0, flag=True))
    assert stored(acquisition) == [0]
    acquisition.again()
    assert acquisition.store().changed


def test_samples_that_come_seldom_are_stored_when_asked():
    acquisition = acquired()
    sparse = [next(still(k, start=float(k), flag=True, count=1)) for k in range(3)]
    assert [event.changed for event in fed(acquisition, sparse)] == [True] * 3
    assert acquisition.arm_state is ArmState.UNKNOWN


def test_rows_are_taken_again_and_targets_passed_over():
    acquisition = acquired()
    for k in range(3):
        fed(acquisition, still(k, start=10.0 * k, flag=True))
    acquisition.step(2)
    fed(acquisition, still(5, start=50.0, flag=True))
    assert stored(acquisition) == [0, 1, 2, 5]
    acquisition.again()
    acquisition.again()
    assert stored(acquisition) == [0, 1]
    assert acquisition.current == 2
    acquisition.step(-3)
    assert acquisition.current == len(PLATE) - 1
    acquisition.step(1)
    acquisition.again()
    assert stored(acquisition) == [1]
    assert acquisition.current == 0


def test_a_full_capture_is_not_overwritten_by_one_key_too_many():
    acquisition = acquired(replace(PLATE, targets=PLATE.targets[:1]))
    fed(acquisition, still(0, start=0.0, flag=True))
    assert acquisition.is_done
    assert not acquisition.store(force=True).changed


def test_the_status_tells_the_deviation_per_axis():
    acquisition = acquired()
    assert acquisition.status().position is None
    off = se3.pose(se3.rotvec_to_matrix(np.array([0.0, 0.02, 0.0])), np.array([1e-3, 0.0, -2e-3]))
    pose = np.array(PLATE.targets[0].pose)
    acquisition.update(
        Sample(
            time=0.0, q=np.zeros(6), position=pose[:3, 3] + off[:3, 3], rotation=off[:3, :3] @ pose[:3, :3]
        )
    )
    status = acquisition.status()
    np.testing.assert_allclose(status.position, [1e-3, 0.0, -2e-3], atol=1e-12)
    np.testing.assert_allclose(status.rotation, [0.0, 0.02, 0.0], atol=1e-12)
    assert status.is_measured


def test_a_fast_stream_is_thinned_for_the_judgement_only():
    acquisition = acquired()
    sample = next(still(1, start=0.0))
    for i in range(1000):
        acquisition.update(replace(sample, time=i / 1000.0))
    assert len(acquisition._detector._seen) < 50
    assert acquisition.arm_state is ArmState.STILL


def lines(samples):
    return [format_sample(sample) + "\n" for sample in samples]


def test_a_driven_arm_fills_the_file_and_bad_lines_do_no_harm(tmp_path):
    hidden, samples = drive_plate(ARM, PLATE, branch="auto", pace=QUICK, seed=3)
    text = lines(samples)
    text.insert(len(text) // 2, "what?\n")
    message = []
    out = tmp_path / "d.csv"
    out.write_text("older")
    done = capture(acquired(), ARM, text, out, say=message.append)
    assert done.is_complete
    assert (tmp_path / "d.1.csv").read_text() == "older"
    data = read_measurements(out, joints=6)
    predicted = tool_poses(hidden, Motion(data.q))
    np.testing.assert_allclose(data.position, predicted[:, :3, 3], atol=4e-4)
    assert np.abs(se3.pose_error(predicted, PLATE.poses)).max() < 3e-3
    assert sum("not a JSON object" in line for line in message) == 1


def test_a_seated_arm_gets_the_plate_s_poses(tmp_path):
    _, samples = drive_plate(ARM, PLATE, branch="auto", pace=QUICK, instrument="plate", seed=3)
    out = tmp_path / "d.csv"
    capture(acquired(), ARM, lines(samples), out)
    np.testing.assert_allclose(read_measurements(out, joints=6).position, PLATE.poses[:, :3, 3])


def test_the_file_is_whole_after_every_row(tmp_path):
    out, seen = tmp_path / "d.csv", []

    def watched(text):
        for line in text:
            yield line
            if json.loads(line).get("capture"):
                seen.append(line)

    _, samples = drive_plate(ARM, PLATE, branch="auto", pace=QUICK)
    counts = []
    capture(
        acquired(),
        ARM,
        watched(lines(samples)),
        out,
        say=lambda text: counts.append(len(read_measurements(out, joints=6)) if out.exists() else 0),
    )
    assert counts == list(range(len(PLATE) + 1))
    assert not list(tmp_path.glob(".*"))


def test_keys_store_take_again_and_end(tmp_path):
    """Keys are given by a source of lines that waits for nobody: one thread stands for both."""
    requested = iter("\nrq")
    acquisition = acquired()
    fed(acquisition, still(0, start=0.0))
    with pytest.raises(DataError):
        capture(acquisition, ARM, _endless(), tmp_path / "d.csv", keys=requested)
    assert not list(tmp_path.iterdir())  # the only row was dropped, and its file with it
    done = capture(acquisition, ARM, _endless(), tmp_path / "d.csv", keys=iter("f q"))
    assert done.is_by_hand
    assert not done.is_complete
    assert len(done.data) == 1


def _endless():
    import threading

    threading.Event().wait(20.0)
    yield ""


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("no json\n", FileError),
        ("", DataError),
        ('{"time": 0, "q": [0, 0]}\n', ShapeError),
        ('{"time": 0, "q": [0, 0, 0, 0, 0, 0]}\n', DataError),
    ],
)
def test_a_source_that_gives_nothing_leaves_no_file(tmp_path, text, error):
    with pytest.raises(error):
        capture(acquired(), ARM, text.splitlines(True), tmp_path / "d.csv")
    assert not list(tmp_path.iterdir())


def test_the_driver_is_the_same_for_a_seed_and_reads_back():
    once, again = (lines(drive_plate(ARM, PLATE, branch="auto", pace=QUICK, seed=5)[1]) for _ in range(2))
    other = lines(drive_plate(ARM, PLATE, branch="auto", pace=QUICK, seed=6)[1])
    assert once == again != other
    parsed = [parse_sample(line, line=1) for line in once]
    assert sum(sample.capture for sample in parsed) == len(PLATE)
    assert np.all(np.diff([sample.time for sample in parsed]) > 0.0)


def test_the_driver_moves_smoothly_and_within_its_speed():
    pace = DrivePace(rate=100.0, turning=0.5, joint_noise=0.0)
    targets = np.array([[0.5, 0.2, 0.0, -1.0, 0.3, 0.1], [0.0, 0.4, 0.1, 1.0, 0.3, 0.1]])
    samples = list(drive(ARM, targets, rng=np.random.default_rng(0), pace=pace))
    q = np.stack([sample.q for sample in samples])
    speed = np.abs(np.diff(q, axis=0)).max(0) * pace.rate
    assert 0.49 < speed.max() <= 0.5 + 1e-9
    assert np.abs(np.diff(q, n=2, axis=0)).max() * pace.rate**2 < 2.0
    assert [sample.q.tolist() for sample in samples if sample.capture] == targets.tolist()
    assert all(sample.position is None for sample in samples)


def test_what_the_driver_does_not_take():
    rng = np.random.default_rng(0)
    with pytest.raises(OptionError):
        drive(ARM, np.zeros((1, 6)), rng=rng, instrument=instrument_named("ball-bar"))
    with pytest.raises(ShapeError):
        drive(ARM, np.zeros((1, 5)), rng=rng)
    with pytest.raises(OptionError):
        DrivePace(rate=0.0)
    with pytest.raises(OptionError):
        drive_plate(ARM, replace(PLATE, targets=()))
    with pytest.raises(OptionError):
        send_samples([], print, speed=-1.0)


def test_samples_over_a_socket():
    import threading

    ports, sent = [], [next(still(k, start=float(k))) for k in range(3)]
    bound = threading.Event()

    def serve():
        with first_listener(
            "localhost:0", timeout=60.0, ready=lambda p: (ports.append(p), bound.set())
        ) as to:
            send_samples(sent, to, speed=0.0)

    thread = threading.Thread(target=serve)
    thread.start()
    assert bound.wait(60.0)
    with connect(f"localhost:{ports[0]}") as source:
        received = [parse_sample(line, line=1) for line in source]
    thread.join(60.0)
    assert [sample.time for sample in received] == [0.0, 1.0, 2.0]
