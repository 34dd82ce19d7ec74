"""Bags, motion capture and point lists joined with joints, written as their makers describe them."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import pytest
from refusals import mentions, refuses

import workbench as wb
from workbench.base import se3
from workbench.base.errors import DataError, FileError, OptionError
from workbench.extras.logs.standstills import still
from workbench.extras.pendant.displayed import read_display

POSES, RATE = 8, 25.0
UR = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")


@dataclass
class Run:
    """An arm that visits some poses and stands at each: time, joints, poses of the tool."""

    time: np.ndarray
    q: np.ndarray
    pose: np.ndarray
    standstills: np.ndarray
    at: np.ndarray

    @cached_property
    def wxyz(self):
        return se3.matrix_to_quaternion(self.pose[:, :3, :3])


@pytest.fixture(scope="module")
def run_of_arm() -> Run:
    """One second at each pose, moves of different length between them, 25 samples a second."""
    return moving_arm(lambda low, high, rng: rng.uniform(low, high))


def moving_arm(duration) -> Run:
    """An arm whose stands and moves take as long as `duration` says of their shortest and longest [s]."""
    rng = np.random.default_rng(3)
    arm = wb.load_robot("ur10")
    standstills = rng.uniform(-1.0, 1.0, (POSES, 6))
    parts = []
    for k in range(POSES):
        parts.append(np.repeat(standstills[k : k + 1], int(RATE * duration(0.9, 1.5, rng)), 0))
        if k + 1 < POSES:
            share = np.linspace(0.0, 1.0, int(RATE * duration(0.6, 2.0, rng)))[1:-1, None]
            eased = 3 * share**2 - 2 * share**3
            parts.append(standstills[k] + eased * (standstills[k + 1] - standstills[k]))
    q = np.concatenate(parts)
    return Run(
        np.arange(len(q)) / RATE, q, wb.tool_poses(arm, q), standstills, wb.tool_poses(arm, standstills)
    )


def check(data, run, position=1e-9, q=1e-9):
    """One row a stand, with the joints and the pose of each."""
    np.testing.assert_allclose(data.q, run.standstills, atol=q)
    np.testing.assert_allclose(data.position, run.at[:, :3, 3], atol=position)
    if data.rotation is not None:
        np.testing.assert_allclose(data.rotation, run.at[:, :3, :3], atol=max(1e-6, position))


def log(folder: Path, run, *, shift=0.0, name="joints.csv") -> Path:
    """A robot's log as a plain table."""
    head = "time[s]," + ",".join(f"q{k}[rad]" for k in range(1, 7))
    table = np.column_stack([run.time + shift, run.q])
    np.savetxt(folder / name, table, "%.12g", ",", header=head, comments="")
    return folder / name


# -- stands ---------------------------------------------------------------------------------------


def test_stands_by_hand():
    time = np.arange(0.0, 4.0, 0.1)
    values = np.where(time < 1.5, 0.0, np.where(time < 2.5, time - 1.5, 1.0))[:, None]
    assert still(time, values, 1e-3) == [(0, 15), (25, 39)]  # 15: the move begins from 0
    assert still(time, np.cumsum(np.full((40, 1), 1e-2)).reshape(-1, 1), 1e-3) == []


def test_a_silence_ends_a_stand():
    """Nobody knows what the arm did while the log was silent."""
    time = np.concatenate([np.arange(0.0, 1.0, 0.05), np.arange(5.0, 6.0, 0.05)])
    assert still(time, np.zeros((40, 1)), 1e-3) == [(0, 19), (20, 39)]


# -- ROS ------------------------------------------------------------------------------------------


def write_bag(path: Path, run, kind: str, *, skew=3.2, frames=False) -> Path:
    """Joint states in UR's order and poses with a clock of their own, drop-outs, and other topics."""
    pytest.importorskip("rosbags")
    from rosbags import rosbag1, rosbag2
    from rosbags.typesys import Stores, get_typestore

    ros1 = kind == "ros1"
    store = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE)
    rng, order, empty = np.random.default_rng(0), [2, 1, 0, 3, 4, 5], np.zeros(0)
    names = [*(f"{UR[i]}_joint" for i in order), "finger_joint"]

    def made(message, **parts):
        return store.types[message.replace("/", "/msg/")](**parts)

    def header(time, frame):
        stamp = made("builtin_interfaces/Time", sec=int(time), nanosec=int(1e9 * (time % 1.0)))
        return made("std_msgs/Header", stamp=stamp, frame_id=frame, **({"seq": 0} if ros1 else {}))

    def joints(k):
        state = {"name": names, "position": np.append(run.q[k, order], 0.04), "velocity": empty}
        return made("sensor_msgs/JointState", header=header(run.time[k], ""), **state, effort=empty)

    def pose(k):
        place = dict(zip("xyz", run.pose[k, :3, 3], strict=True))
        turn = made("geometry_msgs/Quaternion", **dict(zip("wxyz", run.wxyz[k], strict=True)))
        when = header(run.time[k] + skew, "tracker")
        if frames:
            moved = made(
                "geometry_msgs/Transform", translation=made("geometry_msgs/Vector3", **place), rotation=turn
            )
            one = made("geometry_msgs/TransformStamped", header=when, child_frame_id="probe", transform=moved)
            return made("tf2_msgs/TFMessage", transforms=[one])
        there = made("geometry_msgs/Pose", position=made("geometry_msgs/Point", **place), orientation=turn)
        return made("geometry_msgs/PoseStamped", header=when, pose=there)

    def text(k):
        return made("std_msgs/String", data=f"line {k}")

    plugin = rosbag2.StoragePlugin.MCAP if kind == "mcap" else rosbag2.StoragePlugin.SQLITE3
    encode = store.serialize_ros1 if ros1 else store.serialize_cdr
    with rosbag1.Writer(path) if ros1 else rosbag2.Writer(path, version=9, storage_plugin=plugin) as writer:
        topics = {"/joint_states": joints, "/tf" if frames else "/tracker/pose": pose, "/log": text}
        for topic, make in topics.items():
            name = make(0).__msgtype__
            connection = writer.add_connection(topic, name, typestore=store)
            for k, time in enumerate(run.time):
                if make is joints or rng.uniform() >= 0.3:  # the others drop out
                    late = rng.uniform(0.0, 0.02)
                    writer.write(connection, int(1e9 * (time + late)), encode(make(k), name))
    return path


@pytest.mark.parametrize("kind", ["ros1", "ros2", "mcap"])
def test_a_bag_becomes_one_row_a_stand(kind, run_of_arm, tmp_path, request):
    if kind != "ros1":
        request.getfixturevalue("read_here")
    bag = write_bag(tmp_path / ("run.bag" if kind == "ros1" else "run"), run_of_arm, kind)
    data = wb.read_measurements(bag)
    check(data, run_of_arm)
    message = " ".join(data.notes)
    assert mentions(message, "elbow_joint", "q3")
    assert "'finger_joint" in message
    assert f"{POSES} rows from {POSES} stands" in message


def test_frames_of_tf_are_chosen_by_name(read_here, run_of_arm, tmp_path):
    bag = write_bag(tmp_path / "run", run_of_arm, "ros2", frames=True)
    check(wb.read_measurements(bag, columns="pose=probe"), run_of_arm)
    with refuses(OptionError, "poses 'probe'", "'other'"):
        wb.read_measurements(bag, columns="pose=other")
    assert len(read_display(bag, wb.load_robot("ur5e"), columns="pose=probe").data) == POSES


def test_what_is_no_bag_is_refused(tmp_path):
    pytest.importorskip("rosbags")
    (tmp_path / "a.bag").write_bytes(b"#ROSBAG V2.0\n" + b"\x07" * 200)
    (tmp_path / "b.mcap").write_bytes(b"\x89MCAP0\r\n" + b"\x00" * 40)
    for name in ("a.bag", "b.mcap"):
        with pytest.raises(FileError, match="can't be read"):
            wb.read_measurements(tmp_path / name)


# -- motion capture -------------------------------------------------------------------------------


def optitrack(path: Path, run, *, bodies=("Tool",), unit="Meters") -> Path:
    """A take of Motive with rigid bodies; some have no words before their headings."""
    scale, words = {"Meters": (1.0, ("Type", "Name", "ID")), "Millimeters": (1e3, ("", "", ""))}[unit]
    lines = [
        f"Format Version,1.23,Take Name,a,Capture Frame Rate,{RATE},Rotation Type,"
        f"Quaternion,Length Units,{unit}",
        "",
        f",{words[0]}," + ",".join(["Rigid Body"] * 8 * len(bodies)),
        f",{words[1]}," + ",".join(name for name in bodies for _ in range(8)),
        f",{words[2]}," + ",".join("1" for name in bodies for _ in range(8)),
        ",," + ",".join((["Rotation"] * 4 + ["Position"] * 3 + ["Mean Marker Error"]) * len(bodies)),
        "Frame,Time (Seconds)," + ",".join(["X,Y,Z,W,X,Y,Z,"] * len(bodies)),
    ]
    for k, time in enumerate(run.time):
        w, x, y, z = run.wxyz[k]
        cells = [f"{v:.9g}" for v in (x, y, z, w, *(scale * run.pose[k, :3, 3]))] + ["0.0001"]
        cells = [""] * 8 if k % 17 == 3 else cells  # sight was lost
        lines.append(f"{k},{time:.6f}," + ",".join(cells * len(bodies)))
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.mark.parametrize("shift", [0.0, 1234.5])
def test_a_take_is_joined_with_a_log(shift, run_of_arm, tmp_path):
    """The capture begins to count when it is started, the robot's clock when the robot was."""
    take = optitrack(tmp_path / "take.csv", run_of_arm)
    joints = log(tmp_path, run_of_arm, shift=shift)
    data = wb.read_measurements(take, joint_table=joints, joints=6)
    check(data, run_of_arm, position=1e-8)
    message = " ".join(data.notes)
    assert ("clocks differ by" in message) == (shift != 0.0)
    if shift:
        assert f"{shift:+.1f}" in message


def test_an_arm_that_moves_in_one_rhythm_is_joined_by_how_fast_it_moved(tmp_path):
    even = moving_arm(lambda low, high, _: (low + high) / 2.0)
    take, joints = optitrack(tmp_path / "take.csv", even), log(tmp_path, even, shift=1234.5)
    check(wb.read_measurements(take, joint_table=joints, joints=6), even, position=1e-8)


def test_stands_of_a_take_are_joined_row_by_row(run_of_arm, tmp_path):
    """The program's list of poses, and a take that ran all the time."""
    take = optitrack(tmp_path / "take.csv", run_of_arm, unit="Millimeters")
    form = {"delimiter": ",", "header": ",".join(f"q{k}[deg]" for k in range(1, 7)), "comments": ""}
    np.savetxt(tmp_path / "q.csv", np.rad2deg(run_of_arm.standstills), **form)
    check(wb.read_measurements(take, joint_table=tmp_path / "q.csv"), run_of_arm, position=1e-8)
    np.savetxt(tmp_path / "q.csv", np.rad2deg(run_of_arm.standstills[1:]), **form)
    with refuses(DataError, "q.csv", found=(8, 7)):
        wb.read_measurements(take, joint_table=tmp_path / "q.csv")


def test_one_of_several_bodies_is_chosen(run_of_arm, tmp_path):
    take = optitrack(tmp_path / "take.csv", run_of_arm, bodies=("Base", "Tool"))
    joints = log(tmp_path, run_of_arm)
    with refuses(OptionError, "take.csv", "'Base', 'Tool'"):
        wb.read_measurements(take, joint_table=joints)
    check(wb.read_measurements(take, joint_table=joints, columns="pose=Tool"), run_of_arm, position=1e-8)


def test_a_take_of_another_run_is_refused(run_of_arm, tmp_path):
    rng = np.random.default_rng(9)
    take = optitrack(tmp_path / "take.csv", run_of_arm)
    still_log = Run(run_of_arm.time, rng.uniform(-1, 1, (1, 6)) + 0 * run_of_arm.q, None, None, None)
    with refuses(DataError, column="time"):
        wb.read_measurements(take, joint_table=log(tmp_path, still_log))


def test_markers_are_joined_with_rtde(run_of_arm, tmp_path):
    """The controller's log as it writes it."""
    run = run_of_arm
    tool = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0]])
    places = np.einsum("fij,mj->fmi", run.pose[:, :3, :3], tool) + run.pose[:, None, :3, 3]
    head = "time[s]," + ",".join(f"m{m}{a}[mm]" for m in (1, 2, 3) for a in "xyz")
    seen = np.column_stack([run.time, 1e3 * places.reshape(len(places), -1)])
    np.savetxt(tmp_path / "take.csv", seen, "%.12g", ",", header=head, comments="")
    head = "timestamp " + " ".join(f"actual_q_{k}" for k in range(6)) + " actual_TCP_pose_0"
    table = np.column_stack([run.time + 77.7, run.q, run.time])
    np.savetxt(tmp_path / "robot.csv", table, "%.9g", " ", header=head, comments="")
    data = wb.read_measurements(tmp_path / "take.csv", joint_table=tmp_path / "robot.csv")
    np.testing.assert_allclose(data.q, run.standstills, atol=1e-8)
    wanted = np.einsum("fij,mj->fmi", run.at[:, :3, :3], tool) + run.at[:, None, :3, 3]
    np.testing.assert_allclose(data.markers, wanted, atol=1e-6)


# -- lists ----------------------------------------------------------------------------------------


def test_points_are_joined_by_time(run_of_arm, tmp_path):
    """One reading at each stand, one while the arm moved."""
    run = run_of_arm
    moving = np.abs(np.diff(run.q, axis=0)).max(1) > 0
    ends = np.flatnonzero(np.diff(np.concatenate([[True], moving, [True]]).astype(int)) == 1)
    times = run.time[ends] - 0.3
    mm = zip(*(1e3 * run.at[:, :3, 3].T), times, strict=True)
    lines = (f"P{k};{x};{y};{z};{t}\n" for k, (x, y, z, t) in enumerate(mm))
    head, moved = "point;x[mm];y[mm];z[mm];time[s]\n", run.time[np.flatnonzero(moving)[5]]
    points = tmp_path / "points.csv"
    points.write_text(head + "".join(lines) + f"M;0;0;0;{moved}\n")
    data = wb.read_measurements(points, joint_table=log(tmp_path, run))
    check(data, run)
    assert mentions(" ".join(data.notes), "1 of 9")
    text = (tmp_path / "joints.csv").read_text().splitlines()
    places = ["x[m],y[m],z[m]", *(",".join(f"{v:.12g}" for v in p) for p in run.pose[:, :3, 3])]
    places[8], excluded = "9,9,9", ["exclude", *(k == 8 for k in range(1, len(text)))]
    lines = (f"{a},{b},{c}" for a, b, c in zip(text, places, excluded, strict=True))
    (tmp_path / "one.csv").write_text("\n".join(lines))
    check(wb.read_measurements(tmp_path / "one.csv"), run)


def test_poses_of_many_samples_and_of_one_are_no_log(tmp_path):
    samples = np.repeat(np.arange(60), np.where(np.arange(60) % 4, 1, 9))
    rows = (f"{0.1 * k},{np.sin(i * i)},{i},0,0\n" for k, i in enumerate(samples))
    (tmp_path / "one.csv").write_text("time[s],q1[rad],x[m],y[m],z[m]\n" + "".join(rows))
    assert len(wb.read_measurements(tmp_path / "one.csv")) == 180
