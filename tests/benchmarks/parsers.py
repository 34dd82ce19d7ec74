"""A small sound input and a parser of bytes for every kind of file that the workbench reads.

Small inputs have every change where it matters, and many of them a second. Names with a star are formats of
foreign libraries, which the program reads in a child with bounds: here their readers run in the process that
calls them, and the door by which a user's file comes, child and all, stands beside them.
"""

import copy
import functools
import io
import json
import os
import tempfile
import zipfile
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import numpy as np

Parse = Callable[[bytes], object]
Made = tuple[bytes, Parse] | tuple[bytes, Parse, Parse]
"""A sound input, its parser, and the door of formats with a star."""
made_rooms: list[Path] = []
"""Folders that were made, to be removed."""
TABLE = "q1[deg],q2[deg],x[mm],y[mm],z[mm],qw,qx,qy,qz,session,exclude,time[s]\n" + "".join(
    f"{i}.5,2e1,3,4,-5.25,1,0,0,0,a,false,{i}\n" for i in range(4)
)
SHEET = "q1[deg],x[mm],session\n1.5,-5.25,a\n2e1,3,b\n"
STYLES = """<styleSheet xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main">
<fonts><font/></fonts><fills><fill><patternFill/></fill></fills><borders><border/></borders>
<cellXfs><xf numFmtId="0"/><xf numFmtId="14"/></cellXfs></styleSheet>"""
"""Numbers and dates, no more."""
ROBOT = """name = "two"
convention = "craig"
base = { xyz = [0.0, 0.1, 0.2], rpy = [0.0, 0.0, 1.5] }
[[joint]]
theta = 0.0
d = 0.205
alpha = 1.57
limits = [-6.28, 6.28]
mass = 2.6
com = [0.0, -0.05, 0.0]
[[joint]]
a = 0.41
limits = [-0.97, 3.615]
[tool]
xyz = [0.0, 0.0, 0.1]
[[effect]]
name = "joint-compliance"
joints = [2]
coefficients = [1e-6]
"""
PLATE = """name = "two"
size = [0.6, 0.6, 0.012]
xyz = [0.316, 0.354, 0.185]
region = { min = [0.05, 0.1, 0.15], max = [0.6, 0.6, 0.45], cube = 0.05 }
[[target]]
xyz = [0.566, 0.354, 0.235]
rpy = [-2.6, 0.0, 0.0]
[[target]]
sigma = [0.0001, 0.001]
xyz = [0.518, 0.501, 0.235]
rpy = [-2.8, 0.0, 0.0]
"""
URDF = """<?xml version="1.0"?>
<robot name="two"><link name="a"/><link name="b"><inertial><origin xyz="0 0 0.1"/><mass value="2"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial><visual><origin rpy="0 0 1"/>
<geometry><box size="1 1 1"/></geometry></visual></link><link name="c"/>
<joint name="ab" type="revolute"><parent link="a"/><child link="b"/><origin xyz="0 0 0.1" rpy="0 1.5 0"/>
<axis xyz="0 0 1"/><limit lower="-3.1" upper="3.1" effort="9" velocity="1"/></joint>
<joint name="bc" type="prismatic"><parent link="b"/><child link="c"/><axis xyz="1 0 0"/>
<limit lower="0" upper="1" effort="9" velocity="1"/></joint></robot>
"""
MAPPING = 'layout = "plain"\n[columns]\n"Achse 1" = "q1[deg]"\n"H" = "-"\n[joints]\n"A" = "q1[deg]"\n'
JOINT_TABLE = (
    "# convention = dh\ntheta[deg],d[mm],a[mm],alpha[deg],type\n0,205,0,90,revolute\n90,0,410,0,prismatic\n"
)
OPTITRACK = (
    "Format Version,1.23,Capture Frame Rate,50,Rotation Type,Quaternion,Length Units,Meters\n\n,Type,"
    + ",".join(["Rigid Body"] * 7) + "\n,Name," + ",".join(["Tool"] * 7) + "\n,ID," + ",".join("1" * 7)
    + "\n,," + ",".join(["Rotation"] * 4 + ["Position"] * 3)
    + "\nFrame,Time (Seconds),X,Y,Z,W,X,Y,Z\n0,0,0,0,0,1,.1,.2,.3\n1,0.02,0,0,0,1,.1,.2,.3\n2,0.04,,,,,,,\n"
)  # fmt: skip
VICON = (
    "Objects\n100\n,,Tool:Tool,,,,,,\nFrame,Sub Frame,RX,RY,RZ,RW,TX,TY,TZ\n,,,,,,mm,mm,mm\n"
    "1,0,0,0,0,1,1,2,3\n2,0,0,0,0,1,1,2,3\n"
)
QUALISYS = (
    "NO_OF_FRAMES\t2\nNO_OF_CAMERAS\t6\nFREQUENCY\t50\nDATA_INCLUDED\t6D\nBODY_NAMES\tTool\n"
    + "1\t2\t3\t0\t0\t0\t0.1\t1\t0\t0\t0\t1\t0\t0\t0\t1\n" * 2
)
PIXELS = "image,camera,id,corner,u[px],v[px],q1[rad],q2[rad]\n" + "".join(
    f"{i},c,{k},0,{320 + 60 * (k % 2)}.5,{240 + 60 * (k // 2)}.5,0.{i},0.2\n"
    for i in range(2)
    for k in range(4)
)
CAMERA = """[[camera]]
name = "c"
size = [640, 480]
fx = 600.0
fy = 600.0
cx = 320.0
cy = 240.0
distortion = [0.01, 0.0, 0.0, 0.0, 0.0]
mounted = "world"
free = "auto"
"""
TARGET = 'mounted = "tool"\n' + "".join(
    f"[[point]]\nid = {k}\ncorner = 0\nxyz = [{0.05 * (k % 2)}, {0.05 * (k // 2)}, 0.0]\n" for k in range(4)
)
BOARDS = """mounted = "tool"
dictionary = "DICT_5X5_250"
[[board]]
charuco = { squares = [4, 3], square = 0.03, marker = 0.02, first_marker = 4 }
[[board]]
name = "tag"
scale_sigma = 0.001
point = [{ id = 40, corner = 0, xyz = [0, 0, 0] }, { id = 40, corner = 1, xyz = [0.1, 0, 0] },
    { id = 40, corner = 2, xyz = [0.1, 0.1, 0] }, { id = 40, corner = 3, xyz = [0, 0.1, 0] }]
"""
KINEMATICS = (
    "kinematics:\n"
    + "".join(
        f"  {name}:\n    x: 0.0\n    y: 0.1\n    z: 0.{k}\n    roll: 0.0\n    pitch: 0.0\n    yaw: 1.5\n"
        for k, name in enumerate(("shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3"))
    )
    + "  hash: calib_1\n"
)


def room() -> Path:
    """A folder in memory where there is one: hundreds of thousands of files go through it."""
    memory = Path("/dev/shm")
    made_rooms.append(
        Path(tempfile.mkdtemp(prefix="hostile-", dir=memory if os.access(memory, os.W_OK) else None))
    )
    return made_rooms[-1]


def in_file(name: str, read: Callable[[Path], object]) -> Parse:
    """A parser of bytes from one of a file."""
    path = room() / name

    def parse(content: bytes) -> object:
        path.write_bytes(content)
        return read(path)

    return parse


def door(name: str) -> Parse:
    """What reads a user's file of this name."""
    from workbench.data.readers import read_measurements

    return in_file(name, read_measurements)


def parsers() -> dict[str, Callable[[], Made]]:
    """What makes a sound input and its parser, by the format's name; the quickest come first."""
    return {
        "stream": stream,
        "older result": older_result,
        "mapping": mapping,
        "parquet *": parquet,
        "joint table": joint_table,
        "camera toml": camera,
        "target toml": lambda: target(TARGET),
        "boards toml": lambda: target(BOARDS),
        "robot toml": robot,
        "plate toml": plate,
        "urdf": urdf,
        "vicon": lambda: take("take.csv", VICON),
        "optitrack": lambda: take("take.csv", OPTITRACK),
        "qualisys": lambda: take("take.tsv", QUALISYS),
        "trajectory": trajectory,
        "csv": csv,
        "journal": journal,
        "pixels": pixels,
        "mat *": matlab,
        "xlsx *": workbook,
        "ros1 bag *": lambda: bag("run.bag"),
        "mcap *": lambda: bag("run.mcap"),
        "controller yaml": controller,
        "c3d *": c3d,
        "ros2 db3 *": lambda: bag("run.db3"),
    }


def csv() -> tuple[bytes, Parse]:
    from workbench.data.readers import preview, read_measurements

    seen = iter(range(10**9))

    def read(path: Path) -> object:
        if next(seen) % 10:
            return read_measurements(path, joints=2)
        shown = preview(path, joints=2)
        data = read_measurements(path, joints=2)
        assert shown.ok
        return data

    return TABLE.encode(), in_file("rows.csv", read)


def trajectory() -> tuple[bytes, Parse]:
    from workbench.data.readers import read_trajectory

    return TABLE.encode(), in_file("path.csv", read_trajectory)


def mapping() -> tuple[bytes, Parse]:
    from workbench.data.readers.mapping import read_mapping

    return MAPPING.encode(), in_file("mapping.toml", read_mapping)


def pixels() -> tuple[bytes, Parse]:
    from workbench.extras.camera.camera import read_cameras
    from workbench.extras.camera.pixel_table import read_pixels
    from workbench.extras.camera.rig import Rig
    from workbench.extras.camera.target import read_targets

    folder = room()
    (folder / "camera.toml").write_text(CAMERA)
    (folder / "target.toml").write_text(TARGET)
    rig = Rig(read_cameras(folder / "camera.toml"), read_targets(folder / "target.toml"))
    return PIXELS.encode(), in_file("pixels.csv", lambda path: read_pixels(path, rig, dof=2))


def camera() -> tuple[bytes, Parse]:
    from workbench.extras.camera.camera import read_cameras

    return CAMERA.encode(), in_file("camera.toml", read_cameras)


def target(text: str) -> tuple[bytes, Parse]:
    from workbench.extras.camera.target import read_targets

    return text.encode(), in_file("target.toml", read_targets)


def robot() -> tuple[bytes, Parse]:
    from workbench.arm.robot_toml import read_toml

    return ROBOT.encode(), in_file("arm.toml", read_toml)


def joint_table() -> tuple[bytes, Parse]:
    from workbench.extras.pendant.own_robot.check import read_joint_table

    return JOINT_TABLE.encode(), in_file("arm.csv", read_joint_table)


def controller() -> tuple[bytes, Parse]:
    from workbench.arm.built_in_arms import load_robot
    from workbench.exports import FORMS
    from workbench.exports.export_format import Job

    arm = load_robot("ur10")

    def parse(content: bytes) -> object:
        text = content.decode(errors="replace")
        return FORMS["ur-kinematics"].read(text, Job(robot=arm, nominal=arm, source=text))

    return KINEMATICS.encode(), parse


def plate() -> tuple[bytes, Parse]:
    from workbench.plate.plate_toml import read_plate

    return PLATE.encode(), in_file("plate.toml", read_plate)


def urdf() -> tuple[bytes, Parse]:
    from workbench.arm.urdf import read_urdf

    return URDF.encode(), in_file("arm.urdf", read_urdf)


def take(name: str, text: str) -> tuple[bytes, Parse]:
    from workbench.data.readers.read import read_fields

    return text.encode(), in_file(name, read_fields)


def older_result() -> tuple[bytes, Parse]:
    from workbench.identification.prior import read_prior

    prior = {"names": ["joint1.a", "joint2.d"], "values": [0.1, 0.2], "information": [[1.0, 0.0], [0.0, 2.0]]}
    return json.dumps({"schema": "workbench.identification/1", "prior": prior}).encode(), in_file(
        "result.json", read_prior
    )


def journal() -> tuple[bytes, Parse]:
    from workbench.arm.built_in_arms import load_robot
    from workbench.plate.plate_toml import built_in_plates, read_plate
    from workbench.session.commands.drag import SelectTarget
    from workbench.session.journal.folder import begin
    from workbench.session.journal.reader import JOURNAL, read_recording
    from workbench.session.worker import Worker

    folder = room() / "recording"
    begun = begin(load_robot("aria"), read_plate(built_in_plates()["table2"]), folder=folder)
    worker = Worker(begun.session, keepers=begun.keepers)
    for number in (1, 2, 3):
        worker.submit(SelectTarget(number))
    worker.wait()
    worker.close()
    path = folder / JOURNAL

    def parse(content: bytes) -> object:
        path.write_bytes(content)
        return read_recording(folder)

    return path.read_bytes(), parse


def stream() -> tuple[bytes, Parse]:
    from workbench.extras.live.sample import parse_sample

    pose = {"xyz": [0.4, 0.1, 0.3], "quat": [1, 0, 0, 0]}
    line = json.dumps({"time": 1.5, "q": [0.1] * 6, "capture": True} | pose)
    return line.encode(), lambda content: parse_sample(content.decode(errors="replace"), line=1)


def workbook() -> Made:
    import openpyxl

    from workbench.data import binary_tables

    book, file = openpyxl.Workbook(), io.BytesIO()
    for line in SHEET.splitlines():
        book.active.append(line.split(","))
    book.save(file)
    whole, place = zipfile.ZipFile(file), "xl/worksheets/sheet1.xml"
    rest = {name: whole.read(name) for name in whole.namelist() if name != place}
    rest["xl/styles.xml"] = STYLES.encode()

    def packed(content: bytes) -> bytes:
        """A workbook with this sheet."""
        made = io.BytesIO()
        with zipfile.ZipFile(made, "w") as archive:
            for name, part in {**rest, place: content}.items():
                archive.writestr(name, part)
        return made.getvalue()

    read = door("rows.xlsx")
    return (
        whole.read(place),
        lambda content: binary_tables.workbook_cells(packed(content)),
        lambda content: read(packed(content)),
    )


def matlab() -> Made:
    from scipy.io import savemat

    from workbench.extras.logs.matlab_arrays import matlab_arrays

    file = io.BytesIO()
    savemat(file, {"Q": np.ones((3, 2)), "s": {"a": np.eye(2), "n": "text"}})
    return file.getvalue(), matlab_arrays, door("rows.mat")


def parquet() -> Made:
    import pyarrow as pa
    import pyarrow.parquet

    from workbench.data import binary_tables

    file = io.BytesIO()
    table = pa.table({"q1[rad]": [0.1, 0.2], "x[m]": [1.0, 2.0], "session": ["a", "b"]})
    pyarrow.parquet.write_table(table, file)
    return file.getvalue(), binary_tables.parquet_columns, door("rows.parquet")


def c3d() -> Made:
    import ezc3d

    from workbench.extras.logs.binary_recordings import c3d_points

    file, path = ezc3d.c3d(), room() / "take.c3d"
    file["parameters"]["POINT"]["UNITS"]["value"] = ["mm"]
    file["parameters"]["POINT"]["RATE"]["value"] = [50.0]
    file["parameters"]["POINT"]["LABELS"]["value"] = ["A", "B"]
    file["data"]["points"] = np.ones((4, 2, 3))
    file.write(str(path))
    return path.read_bytes(), in_file("take.c3d", lambda path: c3d_points(str(path))), door("take.c3d")


def bag(name: str) -> Made:
    from rosbags.rosbag1 import Writer as Writer1
    from rosbags.rosbag2 import StoragePlugin
    from rosbags.rosbag2 import Writer as Writer2
    from rosbags.typesys import Stores, get_typestore

    from workbench.data.readers import read_measurements
    from workbench.extras.logs.binary_recordings import JOINTS, bag_streams

    _read_once()
    first = name.endswith(".bag")
    store = get_typestore(Stores.ROS1_NOETIC if first else Stores.ROS2_HUMBLE)
    more = {"seq": 0} if first else {}
    stamp = store.types["builtin_interfaces/msg/Time"](sec=1, nanosec=5)
    header = store.types["std_msgs/msg/Header"](stamp=stamp, frame_id="", **more)
    empty = np.zeros(0)
    state = store.types[JOINTS](header, name=["q1", "q2"], position=np.ones(2), velocity=empty, effort=empty)
    folder = room()
    if first:
        path, writer, encode = folder / name, Writer1(folder / name), store.serialize_ros1
    else:
        plugin = StoragePlugin.MCAP if name.endswith("mcap") else StoragePlugin.SQLITE3
        path, encode = folder / "run" / name, store.serialize_cdr
        writer = Writer2(folder / "run", version=9, storage_plugin=plugin)
    with writer:
        connection = writer.add_connection("/joint_states", JOINTS, typestore=store)
        for time in (1, 2, 3):
            writer.write(connection, time, encode(state, JOINTS))
    where = path.parent if name.endswith("db3") else path

    def whole(read: Callable[[str], object]) -> Parse:
        """The bag with these bytes in its file, read."""

        def parse(content: bytes) -> object:
            path.write_bytes(content)
            return read(str(where))

        return parse

    return path.read_bytes(), whole(bag_streams), whole(read_measurements)


def _read_once() -> None:
    """What rosbags makes anew for every bag of what these bags share: types, code for them, metadata."""
    import rosbags.rosbag2.reader as reader
    import rosbags.serde.utils as utils
    import rosbags.typesys as types
    from ruamel.yaml import YAML

    load = functools.cache(lambda text: YAML(typ="safe").load(text))
    reader.YAML = lambda typ: SimpleNamespace(load=lambda text: copy.deepcopy(load(text)))
    compiled = functools.cache(lambda text: compile(text, "types", "exec"))
    utils.exec = lambda text, scope: exec(compiled(text), scope)
    make, kept = types.get_typestore, functools.cache(types.get_typestore)
    if not hasattr(make, "__wrapped__"):
        types.get_typestore = functools.wraps(make)(
            lambda name: make(name) if name is types.Stores.EMPTY else kept(name)  # a bag's own go into this
        )
