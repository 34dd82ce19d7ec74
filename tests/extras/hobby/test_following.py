"""Leader against follower, and LeRobot data sets as joint logs."""

import json
import sys

import numpy as np
import pytest
from refusals import mentions

import workbench as wb
from workbench.base.errors import DataError, FileError, MissingExtraError

NAMES = ("shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll", "gripper")
RATE, LAG = 30.0, 0.062
OFFSETS = np.array([0.0, 4.3, -2.0, 0.0, 1.0, 0.0])
SCALES = np.array([1.0, 1.0, -1.0, 1.04, 1.0, 1.0])


def recorded(seed, seconds=40.0, noise=0.4):
    """Time, leader and follower [°], whose errors last about a third of a second."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, seconds, 1.0 / RATE)
    speed, phase = rng.uniform(0.3, 1.5, (3, 6)), rng.uniform(0, 2 * np.pi, (3, 6))

    def leader(t):
        return (20.0 * np.sin(speed * t[:, None, None] + phase)).sum(1)

    errors = np.zeros((len(time), 6))
    for k in range(1, len(time)):
        errors[k] = 0.9 * errors[k - 1] + noise * np.sqrt(1 - 0.81) * rng.normal(size=6)
    follower = SCALES * leader(time - LAG) + OFFSETS + errors
    return (
        time,
        np.round(leader(time) * 4096 / 360) * 360 / 4096,
        np.round(follower * 4096 / 360) * 360 / 4096,
    )


def write_data_set(root, time, leader, follower, *, version="v3.0", names=NAMES):
    """As LeRobot writes one: two episodes in a file, or a file each."""
    pa = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    feature = {"dtype": "float32", "shape": [6], "names": [f"{n}.pos" for n in names]}
    info = {
        "codebase_version": version,
        "fps": RATE,
        "features": {"observation.state": feature, "action": feature},
    }
    (root / "meta").mkdir(parents=True)
    (root / "meta" / "info.json").write_text(json.dumps(info))
    (root / "data" / "chunk-000").mkdir(parents=True)
    half = len(time) // 2
    episode = (np.arange(len(time)) >= half).astype(int)
    stamp = np.where(episode, time - time[half], time)
    table = pa.table(
        {
            "observation.state": pa.array(follower.astype("float32").tolist(), pa.list_(pa.float32())),
            "action": pa.array(leader.astype("float32").tolist(), pa.list_(pa.float32())),
            "timestamp": pa.array(stamp, pa.float32()),
            "episode_index": episode,
        }
    )
    if version == "v3.0":
        parquet.write_table(table, root / "data" / "chunk-000" / "file-000.parquet")
    else:
        for k, part in enumerate((table[:half], table[half:])):
            parquet.write_table(part, root / "data" / "chunk-000" / f"episode_{k:06d}.parquet")
    return root


def write_table(path, time, leader, follower, *, unit=""):
    heads = ["time[s]", *(f"{side}.{n}{unit}" for side in ("leader", "follower") for n in NAMES)]
    rows = np.column_stack([time, leader, follower])
    path.write_text("\n".join([",".join(heads), *(",".join(map(repr, row)) for row in rows.tolist())]))
    return path


def errors_of(found):
    """In standard deviations that were said: offset, scale, lag of each joint."""
    real = zip(OFFSETS[:5], SCALES[:5], [LAG] * 5, strict=True)
    return np.array(
        [
            [(v - r) / (h / 1.96) for (v, h), r in zip((j.offset, j.scale, j.lag), truth, strict=True)]
            for j, truth in zip(found.joints, real, strict=True)
        ]
    )


def test_offset_direction_scale_and_lag_are_within_their_intervals(tmp_path):
    message = np.array(
        [
            errors_of(wb.compare_leader(write_table(tmp_path / "both.csv", *recorded(seed))))
            for seed in range(12)
        ]
    )
    spread = np.sqrt((message**2).mean((0, 1)))
    assert (spread > 0.7).all()
    assert (spread < 1.4).all()


@pytest.mark.parametrize("version", ["v2.1", "v3.0"])
def test_a_data_set_is_two_arms_and_a_log_of_joints(tmp_path, version):
    time, leader, follower = recorded(1)
    root = write_data_set(tmp_path / "set", time, leader, follower, version=version)
    found = wb.compare_leader(root)
    assert [j.name for j in found.joints] == list(NAMES[:5])
    assert np.abs(errors_of(found)).max() < 4.0
    assert found.commanded
    assert len(found.notes) == 1
    from workbench.data.readers.read import read_fields

    log = read_fields(root)
    np.testing.assert_allclose(np.rad2deg(log.values["q2"]), follower[:, 1], atol=1e-4)
    assert "q6" not in log.values
    assert (np.diff(log.values["time"]) > 0).all()
    one = read_fields(next((root / "data").rglob("*.parquet")))
    assert one.rows == (len(time) if version == "v3.0" else len(time) // 2)


def test_the_command_says_what_a_user_asked(run, tmp_path):
    write_table(tmp_path / "both.csv", *recorded(2))
    status, out, err = run("hobby", "follow", "both.csv", "--json", "f.json")
    assert (status, err) == (0, "")
    assert mentions(out, "elbow_flex")
    found = json.loads((tmp_path / "f.json").read_text())
    lift = found["joints"][1]
    assert abs(lift["offset"]["value"] - 4.3) < 3.0 * lift["offset"]["half_width"]
    assert not found["commanded"]


def test_counts_that_pass_a_turn_go_on(tmp_path):
    time, leader, follower = recorded(3)
    counts = [np.round((values + 340.0) * 4096 / 360) % 4096 for values in (leader, follower)]
    found = wb.compare_leader(write_table(tmp_path / "both.csv", time, *counts, unit="[counts]"))
    assert len(found.notes) == 1
    for joint, scale in zip(found.joints, SCALES, strict=False):
        assert abs(joint.scale[0] - scale) < 0.01


def no_motion(time, leader, follower):
    leader[:, 2] = leader[0, 2]
    return time, leader, follower


def exchanged(time, leader, follower):
    return time, leader, follower[:, [0, 2, 1, 3, 4, 5]]


def limp(time, leader, follower):
    follower[:, 3] = np.random.default_rng(0).normal(size=len(time)).cumsum()
    return time, leader, follower


def short(time, leader, follower):
    return time[:50], leader[:50], follower[:50]


@pytest.mark.parametrize(
    ("change", "named"),
    [(no_motion, "elbow_flex"), (exchanged, "shoulder_lift"), (limp, "wrist_flex"), (short, "50 frames")],
)
def test_bad_recordings_are_one_sentence(tmp_path, change, named):
    with pytest.raises(DataError, match=named) as message:
        wb.compare_leader(write_table(tmp_path / "both.csv", *change(*recorded(4))))
    assert "\n" not in str(message.value)


def test_what_is_no_recording_is_refused(tmp_path, monkeypatch):
    (tmp_path / "one.csv").write_text("time[s],q1[deg]\n0,1\n1,2\n")
    with pytest.raises(FileError):
        wb.compare_leader(tmp_path / "one.csv")
    root = write_data_set(tmp_path / "set", *recorded(5, seconds=5.0))
    (root / "meta" / "info.json").write_text("{}")
    with pytest.raises(FileError):
        wb.compare_leader(root)
    again = write_data_set(tmp_path / "again", *recorded(5, seconds=5.0))
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(MissingExtraError):
        wb.compare_leader(again)


def test_tables_with_lerobots_headings_are_joints(tmp_path):
    _, leader, _ = recorded(6, seconds=1.0)
    heads = [*(f"{n}.pos" for n in NAMES), "x[mm]", "y[mm]", "z[mm]"]
    rows = np.column_stack([leader, np.ones((len(leader), 3))]).tolist()
    (tmp_path / "t.csv").write_text("\n".join([",".join(heads), *(",".join(map(repr, row)) for row in rows)]))
    data = wb.read_measurements(tmp_path / "t.csv")
    np.testing.assert_allclose(np.rad2deg(data.q), leader[:, :5], atol=1e-9)
