"""Hand–eye from pairs that numpy and scipy made: files, mounts, wrong pairs, motions that tell too little."""

import json
import pickle
import re
import tomllib
import xml.etree.ElementTree as ET
from functools import partial

import numpy as np
import pytest
from generator import four
from refusals import refuses
from scipy.io import savemat
from scipy.spatial.transform import Rotation

from workbench.base.errors import DataError, FileError, OptionError
from workbench.extras.camera.camera import Mount
from workbench.extras.camera.hand_eye import handeye
from workbench.extras.camera.pose_pairs import read_pairs

CAMERA = np.array([0.03, -0.06, 0.05]), Rotation.from_euler("xyz", [3.0, -2.0, 90.0], degrees=True)
TARGET = np.array([0.5, 0.1, 0.02]), Rotation.from_euler("xyz", [180.0, 0.0, 15.0], degrees=True)


def matrix(xyz, rotation):
    return four(rotation.as_matrix(), xyz)


X, Z = matrix(*CAMERA), matrix(*TARGET)
OTHER_END = matrix([0.18, 0.12, 0.0], Rotation.from_rotvec([0.0, 0.0, np.pi]))


def pairs(count=15, *, seed=0, mounted="tool", position=3e-4, angle=1e-3, axes=(0.4, 0.4, 0.9)):
    """Hands above a target, and what the camera sees, with noise."""
    random = np.random.default_rng(seed)
    down = Rotation.from_euler("xyz", [180.0, 0.0, 0.0], degrees=True)
    turns = Rotation.from_rotvec(random.normal(size=(count, 3)) * axes) * down
    places = random.uniform([0.25, -0.15, 0.35], [0.55, 0.15, 0.65], (count, 3))
    hands = np.array([matrix(p, r) for p, r in zip(places, turns, strict=True)])
    moved = hands if mounted == "tool" else np.linalg.inv(hands)
    seen = np.linalg.inv(moved @ X) @ Z
    noise = Rotation.from_rotvec(random.normal(0.0, angle, (count, 3))).as_matrix()
    seen[:, :3, :3] = noise @ seen[:, :3, :3]
    seen[:, :3, 3] += random.normal(0.0, position, (count, 3))
    return hands, seen


def xyzw(poses):
    return Rotation.from_matrix(poses[:, :3, :3]).as_quat()


def moveit(hands, seen):
    lines = []
    for pair in zip(hands, seen, strict=True):
        lines.append("- ")
        for name, pose in zip(("effector_wrt_world", "object_wrt_sensor"), pair, strict=True):
            lines += [f"  {name}:", *(f"    - {v!r}" for v in pose.ravel().tolist())]
    return "\n".join(lines)


def easy_handeye(hands, seen):
    lines = ["parameters:", "  name: ''", "  robot_base_frame: link0", "  move_group: arm", "samples:"]
    for k in range(len(hands)):
        for dash, name, side in (("- ", "robot", hands), ("  ", "tracking", seen)):
            lines += [f"{dash}{name}:", "    translation:"]
            lines += [f"      {a}: {v!r}" for a, v in zip("xyz", side[k, :3, 3].tolist(), strict=True)]
            lines += ["    rotation:"]
            lines += [f"      {a}: {v!r}" for a, v in zip("xyzw", xyzw(side)[k].tolist(), strict=True)]
    return "\n".join(lines)


def sample_lists(hands, seen):
    """ROS 1: two lists, w before x."""
    sides = {}
    for name, side in (("hand_world_samples", hands), ("camera_marker_samples", seen)):
        turns = [dict(zip("xyzw", q, strict=True)) for q in xyzw(side).tolist()]
        places = [dict(zip("xyz", p, strict=True)) for p in side[:, :3, 3].tolist()]
        both = zip(turns, places, strict=True)
        poses = [{"rotation": {a: q[a] for a in "wxyz"}, "translation": p} for q, p in both]
        sides[name] = {"header": {"seq": 3, "frame_id": "link_8"}, "transforms": poses}
    return json.dumps({"samples": sides}, indent=1)


def lines_of(values, mark=","):
    return "\n".join(mark.join(map(repr, row)) for row in values.tolist())


def table(hands, seen):
    head = "x[m],y[m],z[m],qx,qy,qz,qw,tvec_x[mm],tvec_y[mm],tvec_z[mm],rvec_x,rvec_y,rvec_z"
    turns = Rotation.from_matrix(seen[:, :3, :3]).as_rotvec()
    values = np.hstack([hands[:, :3, 3], xyzw(hands), 1e3 * seen[:, :3, 3], turns])
    return "\n".join([head, lines_of(values)])


def file_storage(hands, seen):
    text = "%YAML:1.0\n---\n"
    for name, side in (("gripper2base", hands), ("target2cam", seen)):
        for k, pose in enumerate(side):
            text += f"T_{name}_{k}: !!opencv-matrix\n rows: 4\n cols: 4\n data: {pose.ravel().tolist()}\n"
    return text


def franka(hands, seen):
    """Matrices by columns, those of the camera in the board, beside numbers that are no poses."""
    both, lens = zip(hands, np.linalg.inv(seen), strict=True), np.diag([600.0, 600.0, 1.0]).tolist()
    beside = {"camera": lens, "id": 5, "joint_pose": [0.1] * 7}
    return json.dumps([{**beside, "O_T_EE": [*a.T.flat], "T_board_cam": b.tolist()} for a, b in both])


def euler_as_vector(hands, seen):
    """Fixed angles under rx, ry, rz, quaternions with w first, rows that don't count."""
    turns = Rotation.from_matrix(hands[:, :3, :3]).as_euler("xyz", degrees=True)
    values = np.hstack([1e3 * hands[:, :3, 3], turns, seen[:, :3, 3], np.roll(xyzw(seen), 1, axis=1)])
    values = np.pad(values, ((0, 0), (0, 1)))
    values[2, 6:], values[4, 2:] = 0.0, 1.0
    head = "ee_x_mm,ee_y_mm,ee_z_mm,ee_rx,ee_ry,ee_rz,tag_px,tag_py,tag_pz,"
    head += "tag_q1,tag_q2,tag_q3,tag_q4,exclude"
    return "\n".join([head, lines_of(values)])


def bag(hands, seen):
    """Names with dots, joints beside them."""
    fields = [f"{p}.{k}" for p, axes in (("position", "xyz"), ("orientation", "xyzw")) for k in axes]
    head = [f"q{k}[deg]" for k in range(1, 7)] + [f"{s}_pose.{f}" for s in ("ee", "aruco") for f in fields]
    sides = [np.hstack([p[:, :3, 3], xyzw(p)]) for p in (hands, seen)]
    values = np.hstack([np.ones((len(hands), 6)), *sides])
    return "\n".join([",".join(head), lines_of(values)])


FILES = {"samples.yaml": moveit, "eih.samples": easy_handeye, "list.json": sample_lists, "pairs.csv": table}
FILES |= {"bag.csv": bag, "opencv.yml": file_storage, "franka.json": franka, "xarm.csv": euler_as_vector}
MARKS = {44: ";", 46: ",", 10: "\0\n"}  # decimal commas, zeros that end lines
FILES["tracker.csv"] = lambda a, b: euler_as_vector(a, b).translate(MARKS).replace("tag", "measured")
FILES["flat.yaml"] = lambda *sides: f"robot: {sides[0].ravel().tolist()}\ntarget: {sides[1].tolist()}\n"
FILES["halves.txt"] = lambda *sides: lines_of(np.hstack([side[:, :3].reshape(-1, 12) for side in sides]), " ")
FILES["asked.csv"] = lambda a, b: table(a, b).replace("tvec_", "target_").replace("rvec_", "target_r")
FILES["vectors.txt"] = lambda *sides: lines_of(
    np.hstack([part for side in sides for part in rvec_tvec(side)])
)
FILES["records.json"] = lambda *both: json.dumps([*records(*both)])
FILES["markers.json"] = lambda *both: json.dumps(
    [{"aruco": [{"id": 7, **own.pop("board_detection")}], **own} for own in records(*both)]
)
BOTH = {"Joint Dataset": [[0.1] * 6] * 15}
FILES["log.json"] = lambda *both: json.dumps({**BOTH, "Transform Dataset": np.stack(both, axis=1).tolist()})


def rvec_tvec(poses):
    return Rotation.from_matrix(poses[:, :3, :3]).as_rotvec(), poses[:, :3, 3]


def records(hands, seen):
    """A matrix and its parts; vectors beside an error in px."""
    for hand, turn, place in zip(hands, *rvec_tvec(seen), strict=True):
        seen = {"rvec": turn.tolist(), "tvec": place.tolist(), "diagnostics": {"mean_reproj_px": 0.1}}
        whole = {"H": hand.tolist(), "translation_m": hand[:3, 3].tolist()}
        yield {"gripper_pose_base": whole, "board_detection": seen}


def wide(hands, seen, heads, *turns, unseen=("",) * 7, more=lambda k: ""):
    """Both poses in a row under two names and their entries; rows 2 and 5 as where nothing was seen."""
    sides = zip((hands, seen), turns, strict=True)
    left, right = (np.hstack([p[:, :3, 3], of(Rotation.from_matrix(p[:, :3, :3]))]) for p, of in sides)
    both = enumerate(zip(left, right, strict=True))
    rows = [[*a, *(unseen if k in (2, 5) else b), *more(k)] for k, (a, b) in both]
    return "\n".join([",".join(heads.split()), *(",".join(map(str, row)) for row in rows)])


def named(a, b, angles="qx qy qz qw", others="", more=""):
    sides = (a, angles), (b, others or angles)
    return " ".join([*(f"{side}_{e}" for side, own in sides for e in f"x y z {own}".split()), more])


QUAT, WFIRST = Rotation.as_quat, partial(Rotation.as_quat, scalar_first=True)
HALCON, FANUC = (partial(Rotation.as_euler, seq=seq, degrees=True) for seq in ("XYZ", "xyz"))
OPENCV = [f"{part}vec_{k}" for part in "tr" for k in range(3)]
UNSEEN = {
    "A": (named("A", "B"), QUAT, QUAT),
    "r": (named("r", "c"), QUAT, QUAT),
    "minus": (named("kuka", "laser"), QUAT, QUAT, (-1,) * 7),
    "short": (named("robot", "tag"), QUAT, QUAT, ()),
    "q0": (named("robot", "tag", "q0 q1 q2 q3"), WFIRST, WFIRST),
    "halcon": (named("robot", "target", "alpha beta gamma"), HALCON, HALCON, ("",) * 6),
    "fanuc": (" ".join([*(f"robot_{a}" for a in "xyzwpr"), *OPENCV]), FANUC, Rotation.as_rotvec, ("",) * 6),
    "counted": (
        " ".join(["X,Y,Z,RX,RY,RZ".replace(",", " "), *(n.replace("_", "") for n in OPENCV)]),
        HALCON,
        Rotation.as_rotvec,
        ("",) * 6,
    ),
    "lone": (named("robot", "Kamera").replace("robot_", ""), QUAT, QUAT),
    "letter": (named("robot", "c").replace("robot_", "").replace("c_", "c"), QUAT, QUAT),
    "detected": (named("robot", "tag", more="detected"), QUAT, QUAT, range(7), lambda k: [k not in (2, 5)]),
}


@pytest.mark.parametrize("name", UNSEEN)
def test_two_poses_in_a_row_under_any_names_without_those_that_were_not_seen(tmp_path, name):
    heads, a, b, *more = UNSEEN[name]
    given = dict(zip(("unseen", "more"), more, strict=False))
    (tmp_path / "rows.csv").write_text(wide(*pairs(), heads, a, b, **given))
    found = handeye(tmp_path / "rows.csv")
    assert (found.doubt, found.fit.apart, len(found.row)) == ("", (), 13)
    assert "2 rows without both poses left out" in found.notes
    assert off(found)[0] < 0.6


def off(found, x=X):
    turn = Rotation.from_matrix(x[:3, :3].T @ found.camera.rotation).magnitude()
    return 1e3 * np.linalg.norm(found.camera.xyz - x[:3, 3]), np.rad2deg(turn)


def quaternion(pose):
    numbers = [*pose[:3, 3].tolist(), *xyzw(pose[None])[0].tolist()]
    return "\n".join(map("{}: {!r}".format, ("x", "y", "z", "qx", "qy", "qz", "qw"), numbers))


def vector(pose):
    numbers = [*pose[:3, 3].tolist(), *Rotation.from_matrix(pose[:3, :3]).as_rotvec().tolist()]
    return "rows: 6\ncols: 1\ndata:\n" + "".join(f"  - [{v!r}]\n" for v in numbers)


def storage(pose):
    numbers, head = " ".join(map(repr, pose.ravel().tolist())), "<rows>4</rows>\n<cols>4</cols>\n<dt>d</dt>"
    inside = f'<pose type_id="opencv-matrix">{head}<data>{numbers}</data></pose>'
    return f"<opencv_storage>\n{inside}</opencv_storage>"


def halcon(pose):
    turn = np.degrees(Rotation.from_matrix(pose[:3, :3]).as_euler("XYZ"))
    text = "# 3D POSE PARAMETERS: rotation and translation\n\nf 0\n\nr {} {} {}\n\nt {} {} {}\n"
    return text.format(*turn, *pose[:3, 3])


EACH = {
    ("robot_pose_0", "calplate_pose_0", ".dat"): halcon,
    ("robot_0", "cam_0", ".txt"): lambda pose: lines_of(pose, " "),
    ("ee/", "tag/", ".yaml"): quaternion,
    ("pose_fPe_", "pose_cPo_", ".yaml"): vector,
    ("robot", "board", ".xml"): storage,
}


@pytest.mark.parametrize("names", EACH)
def test_every_numbered_file_is_a_pose(tmp_path, names):
    for name, side in zip(names, pairs(), strict=False):
        (tmp_path / f"{name}0").parent.mkdir(exist_ok=True)
        for k, pose in enumerate(side):
            (tmp_path / f"{name}{k}{names[2]}").write_text(EACH[names](pose))
    (tmp_path / f"{names[1]}9{names[2]}").unlink()
    (tmp_path / "readme.txt").write_text("15 poses")
    np.savetxt(tmp_path / "lens.txt", np.eye(3))
    found = handeye(tmp_path)
    assert (found.mounted, found.doubt, found.fit.apart) == (Mount.TOOL, "", ())
    assert (np.array(off(found)) < (0.6, 0.1)).all()
    assert any(note.endswith(", left out: 9") for note in found.notes)
    assert found.row.tolist() == [*range(9), *range(10, 15)]
    if names[0] == "ee/":
        assert off(handeye([tmp_path / "tag", tmp_path / "ee"])) == off(found)


def arrays_each(folder, hands, seen):
    for k, (a, b) in enumerate(zip(hands, seen, strict=True)):
        sides = {"R_gripper2base": a[:3, :3], "t_gripper2base": a[:3, 3:]}
        np.savez(folder / f"s{k}.npz", **sides, R_target2cam=b[:3, :3], t_target2cam=b[:3, 3:])


def stacks(folder, hands, seen):
    for name, side in (("robot_cali", hands), ("board", seen)):
        (folder / f"{name}.txt").write_text(f"{len(side)}\n\n{lines_of(side.reshape(-1, 4), ' ')}")


def printed(folder, hands, seen):
    """As MATLAB shows arrays."""
    for name, side in (("robot", hands), ("board", seen)):
        pages = (f"\r\nval(:,:,{k}) =\r\n\r\n{lines_of(pose, '   ')}\r\n" for k, pose in enumerate(side, 1))
        (folder / f"{name}.txt").write_text("".join(pages))


def one_stack(folder, hands, seen):
    (folder / "all.txt").write_text(lines_of(np.stack([hands, seen], axis=1).reshape(-1, 4), " "))


def timed(folder, hands, seen):
    """Two logs, the camera's with two samples less and 10 ms late."""
    time = np.arange(15.0)[:, None]
    for name, side, late in (("hand", hands, 0.0), ("eye_target", seen, 0.01)):
        table = np.hstack([time + late, side[:, :3, 3], xyzw(side)])[2 * (late > 0.0) :]
        head = "t,x,y,z,q_x,q_y,q_z,q_w"
        np.savetxt(folder / f"{name}.csv", table, delimiter=",", header=head, comments="")


@pytest.mark.parametrize("layout", [*FILES, arrays_each, stacks, printed, one_stack, timed])
def test_every_file_or_folder_gives_the_camera_on_the_hand(tmp_path, layout):
    if layout in FILES:
        (tmp_path / layout).write_text(FILES[layout](*pairs()))
    else:
        layout(tmp_path, *pairs())
    files = [*tmp_path.iterdir()]
    found = handeye(files[0] if len(files) == 1 else tmp_path)
    assert (found.mounted, found.doubt, found.fit.apart) == (Mount.TOOL, "", ())
    assert (np.array(off(found)) < (0.6, 0.1)).all()
    told = {"samples.yaml", "opencv.yml", "franka.json", arrays_each}
    assert any("poses may be inverse" in note for note in found.notes) == (layout not in told)
    assert found.target.xyz == pytest.approx(Z[:3, 3], abs=1e-3)


def test_whose_poses_are_whose_is_asked_where_no_name_tells(tmp_path):
    for name, side in zip("ba", pairs(), strict=True):
        np.save(tmp_path / f"{name}.npy", side)
    with refuses(OptionError, "'a', 'b'", "the robot's first"):
        handeye(tmp_path)
    (tmp_path / "both.csv").write_text(wide(*pairs(), named("camera", "sensor"), QUAT, QUAT))
    with refuses(OptionError, "'camera', 'sensor'", "rename"):
        handeye(tmp_path / "both.csv")
    assert off(handeye([tmp_path / "b.npy", tmp_path / "a.npy"]))[0] < 0.6


def test_arrays_of_opencv(tmp_path):
    hands, seen = pairs()
    turns = [Rotation.from_matrix(p[:, :3, :3]) for p in (hands, seen)]
    vectors, matrices = [t.as_rotvec()[:, :, None] for t in turns], [t.as_matrix() for t in turns]
    for kinds, (a, b) in ("rt", vectors), ("Rt", matrices):
        turned, placed = (f"{k}vec_gripper2base" if kinds == "rt" else f"{k}_gripper2base" for k in kinds)
        robot = {turned: a, placed: 1e3 * hands[:, :3, 3:], "t_target2cam": 1e3 * seen[:, :3, 3:]}
        np.savez(tmp_path / "in.npz", R_target2cam=b, camera_matrix=np.eye(3), **robot)
        found = handeye(tmp_path / "in.npz")
        assert off(found)[0] < 0.6
        assert len([note for note in found.notes if note.endswith("read as mm")]) == 2
    np.savez(tmp_path / "poses.npz", A=hands, B=seen)
    assert off(handeye(tmp_path / "poses.npz")) == pytest.approx(off(found), rel=1e-3)
    cells = np.empty((2, 1, len(hands)), object)
    for k, both in enumerate(zip(hands, seen, strict=True)):
        cells[0, 0, k], cells[1, 0, k] = both
    savemat(tmp_path / "cells.mat", {"bTg": cells[0], "cTw": cells[1]})
    turns, ways = (np.moveaxis(each, 0, -1) for each in (seen[:, :3, :3], seen[:, :3, 3]))
    of_target = {"R_target2cam": turns, "t_target2cam": ways}
    savemat(tmp_path / "pages.mat", {"T_gripper2base": np.moveaxis(hands, 0, -1), **of_target})
    for name in ("cells.mat", "pages.mat"):
        assert off(handeye(tmp_path / name)) == pytest.approx(off(found), rel=1e-3)
    hands, seen = pairs(mounted="world")
    np.savez(tmp_path / "inverse.npz", T_base2gripper=np.linalg.inv(hands), T_target2cam=seen)
    assert handeye(tmp_path / "inverse.npz").mounted is Mount.WORLD


def test_lengths_in_metres_beyond_any_arm_and_rows_shifted_by_one_are_told(tmp_path):
    hands, seen = pairs()
    far = hands.copy()
    far[:, :3, 3] += [30.0, -25.0, 0.0]  # of a base on a rail, in metres
    found = handeye([far, seen])
    assert off(found)[0] < 0.6
    assert not any("mm" in note for note in found.notes)
    shifted = handeye([hands[:-1], seen[1:]])
    assert "the row after" in shifted.doubt
    assert "shift" in shifted.doubt
    assert (off(shifted)[0] < 0.6, "half a turn" in repr(shifted)) == (True, False)
    head = [f"tcp_{a}_mm" for a in "xyz"] + [f"tcp_{a}_deg" for a in "abc"]
    head += [f"cam_{k}{a}" for k in "tr" for a in "xyz"]
    turns = Rotation.from_matrix(hands[:, :3, :3]).as_euler("ZYX", degrees=True)
    sight = Rotation.from_matrix(seen[:, :3, :3]).as_rotvec()
    rows = np.hstack([1e3 * hands[:, :3, 3], turns, seen[:, :3, 3], sight])
    np.savetxt(tmp_path / "t.csv", rows, "%.7f", ",", header=",".join(head), comments="")
    assert off(handeye(tmp_path / "t.csv"))[0] < 0.6


def test_a_camera_in_the_cell_with_poses_of_the_hand_or_inverted(tmp_path):
    hands, seen = pairs(mounted="world")
    for mounted in (None, Mount.WORLD):
        found = handeye((hands, seen), mounted=mounted)
        assert found.mounted is Mount.WORLD
        assert off(found)[0] < 0.6
    (tmp_path / "eob.samples").write_text(easy_handeye(np.linalg.inv(hands), seen))
    found = handeye(tmp_path / "eob.samples", mounted=Mount.WORLD)
    assert off(found)[0] < 0.6
    assert any("base in the hand" in note for note in found.notes)


@pytest.mark.parametrize(("count", "shots"), [(10, 1), (4, 1), (6, 9)])
def test_intervals_hold_as_often_as_they_say(count, shots):
    """Shots of one pose share its error."""
    inside = []
    for seed in range(30):
        found = handeye([np.repeat(side, shots, axis=0) for side in pairs(count, seed=seed)])
        inside.append(np.abs(found.camera.xyz - X[:3, 3]) < found.half[0, :3])
    assert 0.88 < np.mean(inside) < 0.999
    assert "alike" in handeye(pairs(3)).doubt  # on the tool or in the cell


@pytest.mark.parametrize("name", ["xarm.csv", "lists.yaml"])
@pytest.mark.parametrize("wrong", ["half a turn", "another's"])
def test_a_wrong_pair_does_not_change_how_orientations_are_read(tmp_path, name, wrong):
    """One of 15 had Euler angles read as a rotation vector, and lists x, y, z, w as w first."""
    hands, seen = pairs()
    seen[7] = seen[7] @ OTHER_END if wrong == "half a turn" else seen[9]
    sides = [np.hstack([side[:, :3, 3], xyzw(side)]).tolist() for side in (hands, seen)]
    both = [[{"position": p[:3], "orientation": p[3:]} for p in pair] for pair in zip(*sides, strict=True)]
    lists = json.dumps([{"hand": a, "target": b} for a, b in both])
    (tmp_path / name).write_text(lists if name == "lists.yaml" else euler_as_vector(hands, seen))
    found = handeye(tmp_path / name)
    assert (found.doubt, found.row[list(found.fit.apart)].tolist()) == ("", [8])
    assert off(found)[0] < 0.6


def test_lists_of_four_that_no_pair_tells_are_x_y_z_w(tmp_path):
    """As documented; that nothing told them is said."""
    hands, seen = pairs()
    seen[:, :3, :3] = Rotation.random(15, random_state=1).as_matrix()
    sides = {"robot": hands[:, :3, 3], "robot_quat": xyzw(hands), "tag": seen[:, :3, 3]}
    np.savez(tmp_path / "a.npz", **sides, tag_quat=xyzw(seen))
    robot, target, *_, notes = read_pairs(tmp_path / "a.npz")
    assert robot == pytest.approx(hands)
    assert target == pytest.approx(seen)
    assert any("the sides turn apart" in note for note in notes)


def test_two_files_are_joined_by_their_labels(tmp_path):
    for name, side, kept in (("robot", pairs()[0], range(15)), ("camera", pairs()[1], [14, *range(3, 14)])):
        rows = [[f"img{k:02}.png", *side[k, :3, 3].tolist(), *xyzw(side)[k].tolist()] for k in kept]
        text = "\n".join(["image,x,y,z,qx,qy,qz,qw", *(",".join(map(str, row)) for row in rows)])
        (tmp_path / f"{name}.csv").write_text(text)
        (tmp_path / f"bare_{name}.csv").write_text(re.sub("(?m)^.*?,", "", text))
    found = handeye([tmp_path / "robot.csv", tmp_path / "camera.csv"])
    assert (found.row.tolist(), found.doubt, off(found)[0] < 0.6) == ([*range(4, 16)], "", True)
    with refuses(FileError, "15 robot poses and 12 target poses"):
        handeye([tmp_path / "bare_robot.csv", tmp_path / "bare_camera.csv"])
    with refuses(FileError, "nothere.csv: no such file"):
        handeye([tmp_path / "robot.csv", tmp_path / "nothere.csv"])
    with refuses(OptionError, "bare_robot.csv holds one pose in each row"):
        np.savetxt(tmp_path / "bare_robot.csv", np.ones((5, 7)))
        handeye(tmp_path / "bare_robot.csv")


@pytest.mark.parametrize(("count", "bad", "mounted"), [(16, 2, "tool"), (40, 19, "tool"), (40, 19, "world")])
def test_pairs_that_do_not_belong_together_are_named(count, bad, mounted):
    """Where half were wrong, the mean of all was given, 1.1 m off."""
    hands, seen = pairs(count, mounted=mounted)
    wrong, *more = np.split(np.random.default_rng(1).permutation(count), [bad, bad + 1])
    seen[wrong] = seen[np.roll(wrong, 1)]
    seen[more[0], 0, 3] += 0.01
    found = handeye([hands, seen])
    apart = sorted([*wrong, *more[0]])
    assert (found.mounted, found.doubt, sorted(found.fit.apart)) == (Mount(mounted), "", apart)
    assert off(found)[0] < 0.6
    told = f"pair {more[0][0] + 1} is off by 9.9" if bad == 2 else "20 of 40 pairs are off by"
    assert told in repr(found)


def test_good_pairs_are_kept_and_moved_ones_are_told():
    good = [handeye(pairs(16, seed=seed)) for seed in range(100, 120)]
    assert sum(len(found.fit.apart) for found in good) <= 1
    assert not any("moved" in found.doubt for found in good)
    (hands, seen), wrong = pairs(40), np.random.default_rng(1).choice(40, 14, replace=False)
    seen[wrong] = matrix([0.03, 0.0, 0.0], Rotation.from_rotvec([0.0, 0.1, 0.0])) @ seen[wrong]
    assert "was moved" in handeye([hands, seen]).doubt


@pytest.mark.parametrize("side", [0, 1])
def test_poses_of_one_side_may_be_inverse(tmp_path, side):
    """The camera was in the cell where the target is, without a note."""
    both = [*pairs(mounted="tool")]
    both[side] = np.linalg.inv(both[side])
    (tmp_path / "pairs.csv").write_text(table(*both))
    (note,) = (note for note in handeye(tmp_path / "pairs.csv").notes if "may be inverse" in note)
    place = note.split("camera is on the tool at " if side == 0 else "target's, at ")[1].split(" mm")[0]
    where = [float(number) for number in place.replace("−", "-").split(",")]
    assert where == pytest.approx([30.0, -60.0, 50.0], abs=0.6)


@pytest.mark.parametrize("count", [2, 7])
def test_chessboards_counted_from_the_other_end_are_named(count):
    hands, seen = pairs(16)
    seen[:count] @= OTHER_END
    found = handeye((hands, seen))
    assert (sorted(found.fit.apart), found.doubt) == ([*range(count)], "")
    assert "counted from its other end" in repr(found)
    assert off(found)[0] < 0.6


@pytest.mark.parametrize("mounted", ["tool", "world"])
@pytest.mark.parametrize(
    ("scale", "what"),
    [
        (1.05, "size"),
        (0.95, "size"),
        (10.0, "size"),
        (1.005, "size"),
        (1.03, "focal length"),
        (0.95, "depths"),
        (-1.0, "left-handed"),
    ],
)
def test_a_target_of_another_size_or_depth_is_told_and_spoils_nothing(mounted, scale, what):
    """A mount that was 32 mm off was given as ± 5 mm; one that was 12 mm off in depth as ± 1.1 mm."""
    hands, seen = pairs(20, mounted=mounted)
    seen[:, 2 if what in ("depths", "focal length") else 0 : 3, 3] *= scale
    found = handeye((hands, seen))
    text = found.doubt if abs(scale - 1.0) > 0.01 else found.notes[-1]
    assert float(text.split("multiplied by ")[1].split()[0]) == pytest.approx(1.0 / scale, rel=2e-3)
    assert what in text
    assert (found.mounted, off(found)[0] < 0.8 or scale < 0.0) == (Mount(mounted), True)


@pytest.mark.parametrize(("what", "at"), [("camera", 10), ("camera", 16), ("target", 6)])
def test_a_knock_between_the_pairs_is_told_by_their_numbers(what, at):
    """Their mean was given, 5 mm off, with status 0."""
    hands, seen = pairs(20)
    knock = matrix([0.008, -0.006, 0.003], Rotation.from_rotvec([0.02, 0.01, 0.0]))
    if what == "camera":
        seen[at:] = np.linalg.inv(knock) @ seen[at:]
    else:
        hand = np.linalg.inv(hands[at:] @ X)
        seen[at:] = hand @ Z @ knock @ np.linalg.inv(Z) @ np.linalg.inv(hand) @ seen[at:]
    found = handeye((hands, seen))
    told = re.match(rf"the {what} moved by ([\d.]+) mm, .* between pairs (\d+) and (\d+)", found.doubt)
    way, first, last = map(float, told.groups())
    assert way == pytest.approx(10.4, abs=0.8)
    assert first <= at < last <= first + 2


@pytest.mark.parametrize(("axes", "about"), [((0.0, 0.0, 0.8), "xy"), ((0.5, 1e-3, 1e-3), "yz")])
def test_a_hand_that_turned_about_one_axis_is_told_another(tmp_path, axes, about):
    """The target is below the hand, so its axes are the hand's up to signs."""
    found = handeye(pairs(axes=axes))
    assert "turn the hand more about its " in found.doubt
    assert found.doubt.split("about its ")[1][0] in about
    rows = np.hstack([part for side in pairs(20, axes=axes, seed=7) for part in rvec_tvec(side)[::-1]])
    head = [f"{side}_{axis}" for side in ("robot", "target") for axis in ("x", "y", "z", "rx", "ry", "rz")]
    np.savetxt(tmp_path / "a.csv", rows, "%.6f", ",", header=",".join(head), comments="")
    assert not any("as the pairs tell" in note for note in handeye(tmp_path / "a.csv").notes)
    still = handeye(pairs(axes=(0.0, 0.0, 0.0)))
    assert still.doubt.startswith("the camera's place is open: the hand kept one")
    assert np.abs(found.camera.xyz - X[:3, 3]).max() < found.half[0, :3].max()


def test_the_command_writes_every_form_and_ends_honestly(run, told, tmp_path):
    (tmp_path / "good.yaml").write_text(moveit(*pairs()))
    content, _ = told("handeye", "good.yaml", "--save", "c.toml")
    written = tomllib.loads((tmp_path / "c.toml").read_text())["camera"]
    assert written["mounted"] == "tool"
    assert written["xyz"] == pytest.approx(X[:3, 3], abs=6e-4)
    assert content["schema"] == "workbench.handeye/1"
    assert content["camera"]["xyz"] == pytest.approx(written["xyz"])
    assert len(content["pairs"]) == 15
    found = handeye(pairs())
    origin = ET.fromstring(found.save(tmp_path / "c.urdf").read_text()).find("origin")
    xyz, rpy = (np.array(origin.get(name).split(), float) for name in ("xyz", "rpy"))
    assert matrix(xyz, Rotation.from_euler("xyz", rpy)) == pytest.approx(found.camera.pose)
    yaml = pytest.importorskip("yaml")
    held = yaml.safe_load(found.save(tmp_path / "c.yaml").read_text())["transform"]
    turn = Rotation.from_quat([held["rotation"][a] for a in "xyzw"])
    assert matrix([held["translation"][a] for a in "xyz"], turn) == pytest.approx(found.camera.pose)
    (tmp_path / "flat.yaml").write_text(moveit(*pairs(axes=(0.0, 0.0, 0.8))))
    assert run("handeye", "flat.yaml", "--save", "flat.urdf")[0] == 2
    assert not (tmp_path / "flat.urdf").exists()


def test_wrong_files_and_mounts_are_refused(tmp_path):
    hands, seen = pairs()
    wrong = {
        "target": "x[m],y[m],z[m],qx,qy,qz,qw\n0,0,0,0,0,0,1\n",
        "may run code": pickle.dumps((hands, seen)),
    }
    wrong["both mean x"] = wide(hands, seen, named("robot", "robot"), QUAT, QUAT)
    wrong["both sides hold the same poses"] = wide(hands, hands, named("robot", "tag"), QUAT, QUAT)
    for fact, content in wrong.items():
        (tmp_path / "a.csv").write_bytes(content.encode() if isinstance(content, str) else content)
        with refuses(FileError, fact):
            handeye(tmp_path / "a.csv")
    (tmp_path / "camera.toml").write_text("[[camera]]\n")
    with refuses(FileError, "TOML", "give a robot pose") as refused:
        handeye(tmp_path / "camera.toml")
    assert "--" not in str(refused.value)
    for k in range(3):
        (tmp_path / f"shot{k}.png").write_bytes(b"")
        np.savetxt(tmp_path / f"robot{k}.txt", hands[k])
    with refuses(FileError, "plain chessboard"):
        handeye(tmp_path)
    (tmp_path / "robot.txt").write_text("1 0 0\nval 1 0 0 0\n")
    (tmp_path / "tag.txt").write_text(lines_of(seen[0], " "))
    with refuses(FileError, "no pose of the robot") as refused:
        handeye([tmp_path / "robot.txt", tmp_path / "tag.txt"])
    assert "zip()" not in str(refused.value)
    with refuses(DataError, "at least 3"):
        handeye((hands[:2], seen[:2]))
    assert "check which poses belong together" in handeye((hands, seen[::-1])).doubt
    with refuses(DataError, "15 robot poses and 14"):
        handeye((hands, seen[:-1]))
    with refuses(DataError, "tool"):
        handeye((hands, seen), mounted=Mount.WORLD)
    with refuses(DataError, "world"):  # inverse poses can't be told from another mount
        handeye((hands, np.linalg.inv(seen)), mounted=Mount.TOOL)
