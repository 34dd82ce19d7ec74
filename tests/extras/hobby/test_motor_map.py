"""From counts and poses of a board to the arm that the motors move, against MuJoCo."""

import json
from dataclasses import replace

import numpy as np
import pytest
from round_trip import aligned
from slow import slow

pytest.importorskip("mujoco")

from servo_arm import NAMES, ServoArm

import workbench as wb
from workbench.base.errors import DataError

MIDDLE = slice(1, 4)


@pytest.fixture(scope="module")
def so101():
    return wb.load_robot("so101")


def recorded(arm, count=20, run=2):
    """What one recording brings, as `map_motors` takes it."""
    counts, board = arm.measured(count, run)
    return wb.Dataset(
        q=arm.angles(counts), position=board[:, :3, 3], rotation=board[:, :3, :3], source="poses.csv"
    )


def tips(arm, found, robot):
    """Places of the board at fresh poses: MuJoCo's and an arm's [m]."""
    q = arm.drawn(200, 9)
    motors = arm.angles(arm.counts(q))[:, found.counting.order]
    return arm.board(q)[:, :3, 3], (found.counting.base @ robot.predict(motors))[:, :3, 3]


def off(arm, found, robot=None):
    """Mean distance between them [mm]."""
    real, own = tips(arm, found, robot or found.robot)
    return 1e3 * np.linalg.norm(real - own, axis=1).mean()


def sagging(found):
    """The arm found with what its rows show besides the zeros."""
    return wb.diagnose(found.robot, found.run.data, held_out=0.0).robot


def test_an_arm_off_by_20_to_60_mm_is_found_to_3_mm_and_repeats_agree_to_1_mm(so101):
    """Motors hold wherever they stop and read it to 0.088°; the tip sags by 5 mm, which no count shows."""
    arm, places = ServoArm(0), []
    for run in (2, 3):
        found = wb.map_motors(so101, recorded(arm, run=run))
        np.testing.assert_array_equal(found.counting.signs, arm.signs)
        np.testing.assert_allclose(found.offsets[MIDDLE], arm.offsets[MIDDLE], atol=np.deg2rad(3.0))
        assert np.isnan(found.offsets[[0, -1]]).all()
        assert 20.0 < 1e3 * found.before < 60.0
        assert off(arm, found) < 3.0
        robot = sagging(found)
        assert off(arm, found, robot) < 1.0
        places.append(tips(arm, found, robot)[1])
    assert 1e3 * np.linalg.norm(places[0] - places[1], axis=1).mean() < 0.8


@pytest.mark.slow
def test_play_of_1_degree_that_motors_do_not_see_bounds_what_20_poses_tell(so101):
    """Zeros are as uncertain as the mean of the play; the intervals say so, and more poses help as √n."""
    errors, many = [], []
    for seed in range(3):
        arm = ServoArm(seed, stiffness=np.inf, scatter=np.deg2rad(1.0))
        found = wb.map_motors(so101, recorded(arm))
        errors.append(((found.offsets - arm.offsets) / (found.half / 1.96))[MIDDLE])
        assert off(arm, found) < 3.0
        assert off(arm, found) < 2e3 * found.expected
        assert abs(np.rad2deg(found.scatter) - 1.0) < 0.3
        many.append(off(arm, wb.map_motors(so101, recorded(arm, count=found.poses_wanted))))
    assert 0.6 < np.sqrt(np.mean(np.square(errors))) < 1.5
    assert np.mean(many) < 1.0


def test_exchanged_motors_are_named(so101):
    arm = ServoArm(1, order=np.array([0, 2, 1, 3, 4]))
    found = wb.map_motors(so101, recorded(arm), motors=NAMES)
    np.testing.assert_array_equal(found.counting.order, arm.order)
    assert set(found.exchanged) == {"shoulder_lift", "elbow_flex"}
    assert off(arm, found, sagging(found)) < 1.0


WRONG = {
    "too few": lambda data, arm: data.take(np.arange(7)),
    "still": lambda data, arm: replace(data, q=np.where(np.arange(data.joints) == 2, data.q[0], data.q)),
    "unturned": lambda data, arm: replace(data, rotation=np.repeat(data.rotation[:1], len(data), axis=0)),
    "other rows": lambda data, arm: replace(data, q=data.q[::-1].copy()),
    "no poses": lambda data, arm: replace(data, rotation=None),
}


@pytest.mark.parametrize("name", [slow(n) if n == "other rows" else n for n in WRONG])
def test_bad_input_is_one_sentence(so101, name):
    arm = ServoArm(6)
    with pytest.raises(DataError) as message:
        wb.map_motors(so101, WRONG[name](recorded(arm), arm))
    assert str(message.value).startswith("poses.csv: ")
    assert "\n" not in str(message.value)


@pytest.fixture
def files(tmp_path):
    """A recording as a user has it: counts of all motors, the board's poses, LeRobot's calibration."""
    arm = ServoArm(7, signs=np.array([1.0, 1.0, -1.0, 1.0, 1.0]))
    counts, board = arm.measured(20)
    turns = [wb.Frame.from_pose(pose).rpy for pose in board]
    heads = [*(f"{name}[counts]" for name in (*NAMES, "gripper")), "x[mm]", "y[mm]", "z[mm]"]
    lines = [",".join([*heads, "roll[rad]", "pitch[rad]", "yaw[rad]"])]
    for row, pose, turn in zip((counts - 1500) % 4096, board, turns, strict=True):
        lines.append(
            ",".join(map(repr, [*row.tolist(), 2000, *(1e3 * pose[:3, 3]).tolist(), *turn.tolist()]))
        )
    (tmp_path / "poses.csv").write_text("\n".join(lines))
    entry = {"drive_mode": 0, "homing_offset": 100, "range_min": -1300, "range_max": 2700}
    table = {name: {"id": k, **entry} for k, name in enumerate((*NAMES, "gripper"), 1)}
    (tmp_path / "follower.json").write_text(json.dumps(table))
    return arm


def test_tables_with_lerobots_headings_are_joints(tmp_path):
    motors = np.random.default_rng(6).uniform(-90.0, 90.0, (30, 6))
    heads = [*(f"{name}.pos" for name in (*NAMES, "gripper")), "x[mm]", "y[mm]", "z[mm]"]
    rows = np.column_stack([motors, np.ones((30, 3))]).tolist()
    (tmp_path / "t.csv").write_text("\n".join([",".join(heads), *(",".join(map(repr, row)) for row in rows)]))
    q = np.rad2deg(wb.read_measurements(tmp_path / "t.csv").q)
    np.testing.assert_allclose(q, motors[:, :5], atol=1e-9)


def test_counts_become_a_urdf_and_a_lerobot_calibration(run, files, tmp_path):
    """Counts that pass 4095, homing offsets, and the model whose joints are what LeRobot then reads."""
    options = ("--robot", "so101", "--calibration", "follower.json", "--json", "map.json")
    status, out, err = run(
        "hobby", "map", "poses.csv", *options, "--lerobot", "new.json", "--save", "mine.toml"
    )
    assert (status, err) == (0, "")
    assert "elbow_flex" in out
    message = json.loads((tmp_path / "map.json").read_text())
    assert [j["sign"] for j in message["joints"]] == files.signs.tolist()
    old, new = (json.loads((tmp_path / name).read_text()) for name in ("follower.json", "new.json"))
    assert [new[name] for name in ("shoulder_pan", "wrist_roll", "gripper")] == [
        old["gripper"] | {"id": k} for k in (1, 5, 6)
    ]
    for k in (1, 2, 3):
        before, after = old[NAMES[k]], new[NAMES[k]]
        zero = files.counts(np.zeros((1, 5)))[0, k] - 1500
        encoder = zero + before["homing_offset"]
        present = (encoder - after["homing_offset"] + 1024) % 4096 - 1024
        middle = 0.5 * (after["range_min"] + after["range_max"])
        assert abs(present - middle) * 360 / 4096 < 2.0
        assert abs(middle - 2047) <= 0.5
        shift = after["homing_offset"] - before["homing_offset"]
        assert after["range_min"] + shift >= before["range_min"]
        assert after["range_max"] + shift <= before["range_max"]
        assert (after["range_min"] + shift == before["range_min"]) or (
            after["range_max"] + shift == before["range_max"]
        )
    for make, ended in (("dynamixel", 0), ("other", 64)):  # which differ in the sign of homing offsets
        more = (*options[:4], "--make", make, "--lerobot", f"{make}.json")
        assert run("hobby", "map", "poses.csv", *more)[0] == ended
    other = json.loads((tmp_path / "dynamixel.json").read_text())
    for name in NAMES[1:4]:
        assert (new[name]["homing_offset"] + other[name]["homing_offset"] - 200) % 4096 == 0
        assert new[name]["range_min"] == other[name]["range_min"]
    assert run("export", "mine.toml", "--urdf", "mine.urdf")[0] == 0
    assert run("export", "mine.toml", "--for", "mjcf", "--out", "mine.xml")[0] == 0
    q = files.drawn(100, 9)
    degrees = np.deg2rad((files.counts(q) - 1500 - 700) * 360 / 4095)
    mine, urdf = wb.load_robot("mine.toml"), wb.load_robot("mine.urdf")
    real = files.board(q)[:, :3, 3]
    for arm in (mine, urdf):
        assert fitted(real, arm.predict(degrees)[:, :3, 3]) < 5.0


def fitted(real, own):
    """Mean distance of places, the one set moved onto the other [mm]."""
    at = aligned(own, real)
    return 1e3 * np.linalg.norm(real - own @ at[:3, :3].T - at[:3, 3], axis=1).mean()


def test_percent_of_the_range_needs_the_calibration(run, files, tmp_path):
    text = (tmp_path / "poses.csv").read_text().replace("[counts]", ".pos")
    (tmp_path / "degrees.csv").write_text(text)
    assert run("hobby", "map", "degrees.csv", "--robot", "so101", "--percent")[0] == 64
    options = ("--percent", "--calibration", "follower.json")
    for file, why in (("degrees.csv", "beyond 100 %"), ("poses.csv", "in counts")):
        status, _, err = run("hobby", "map", file, "--robot", "so101", *options)
        assert (status, why in err) == (64, True)
    lines = [line.split(",") for line in (tmp_path / "poses.csv").read_text().splitlines()]
    for row in lines[1:]:
        for k in range(5):
            count = (int(row[k]) + 1348) % 4096 - 1348
            row[k] = repr((count + 1300) / 4000 * 200 - 100)
    (tmp_path / "percent.csv").write_text(
        "\n".join(",".join(row) for row in lines).replace("[counts]", ".pos")
    )
    calibration = options[1:]
    for file, more in (("percent.csv", options), ("poses.csv", calibration)):
        assert run("hobby", "map", file, "--robot", "so101", *more, "--json", f"{file}.json")[0] == 0
    found = [json.loads((tmp_path / f"{f}.csv.json").read_text())["joints"] for f in ("percent", "poses")]
    zeros = np.array([[j["offset"] for j in joints[1:4]] for joints in found])
    np.testing.assert_allclose(zeros[0], zeros[1], atol=1e-4)
