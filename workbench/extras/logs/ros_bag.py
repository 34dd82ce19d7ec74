"""Bags of ROS 1 and 2: joint states joined with the poses that an instrument published; extra `ros`.

A pose is a topic of PoseStamped or TransformStamped, or a frame of /tf by name. A bag often holds the robot's
own forward kinematics as well: with more than one candidate the user chooses which one is measured. Times are
those of the recorder, which has one clock for all topics. A child reads the file, with bounds of time and
memory.
"""

from importlib.util import find_spec
from pathlib import Path
from typing import Any, final

import numpy as np

from workbench.base import se3
from workbench.base.bounded_process import MEBIBYTE, ChildError
from workbench.base.errors import DataError, MissingExtraError
from workbench.data.binary_tables import read_in_child
from workbench.data.readers.columns_option import Naming
from workbench.data.readers.fields import Fields, fields_of
from workbench.data.readers.layouts import AbstractFileLayout
from workbench.data.readers.table import grid_of, with_headings
from workbench.extras.logs.mocap import chosen
from workbench.extras.logs.standstills import join_by_time

MEMORY = 400 * MEBIBYTE
"""What a child may take beside a few times the size of a bag [bytes]."""
MAX_MESSAGES = 5_000_000
JOINTS = "sensor_msgs/msg/JointState"
POSES = ("geometry_msgs/msg/PoseStamped", "geometry_msgs/msg/TransformStamped", "tf2_msgs/msg/TFMessage")
Streams = dict[str, dict[str, list[tuple[float, Any]]]]
"""`joints` by topic: positions by name; `poses` by topic or frame: x, y, z [m] and w, x, y, z; with times."""


@final
class RosBag(AbstractFileLayout):
    """`.bag`, `.db3`, `.mcap`, or the folder of a ROS 2 bag."""

    name = "ros-bag"
    endings = (".db3", ".mcap", ".bag")

    def matches(self, path: Path, head: bytes) -> bool:
        if path.is_dir():
            return any(path.glob("*.db3")) or any(path.glob("*.mcap"))
        return head.startswith((b"#ROSBAG", b"\x89MCAP")) or path.suffix.lower() in self.endings

    def read(self, path: Path, naming: Naming | None) -> Fields:
        in_folder = path.suffix.lower() == ".db3" and (path.parent / "metadata.yaml").exists()
        streams = read_bag(path.parent if in_folder else path)
        if not streams["joints"]:
            raise DataError(f"{path}: there are no joint states (sensor_msgs/JointState) in this bag")
        topic = chosen(list(streams["joints"]), naming, f"{path}: joint topics", "joints")
        joints = _joints(path, topic, streams["joints"][topic], naming)
        if not streams["poses"]:
            return joints
        pose = chosen(list(streams["poses"]), naming, f"{path}: poses", "pose")
        time, numbers = (np.array(part) for part in zip(*streams["poses"][pose], strict=True))
        measured = Fields(
            source=str(path),
            lines=tuple(range(1, len(time) + 1)),
            values={"time": time, **dict(zip("xyz", numbers[:, :3].T, strict=True))},
            headings=dict.fromkeys("xyz", pose),
            units=dict.fromkeys("xyz", "m") | {"time": "s"},
            rotation=se3.quaternion_to_matrix(numbers[:, 3:]),
            notes=(f"layout '{self.name}'", f"the tool is the body '{pose}'"),
        )
        return join_by_time(measured, joints, one_clock=True)


def _joints(path: Path, topic: str, rows: list[tuple[float, Any]], naming: Naming | None) -> Fields:
    """Positions by the joints' names, which say their order, or of which `naming` does."""
    names = list(dict.fromkeys(name for _, at in rows for name in at))
    columns = [[repr(time) for time, _ in rows]]
    columns += [[repr(at[name]) if name in at else "" for _, at in rows] for name in names]
    given = tuple(pair for pair in naming.pairs if pair[0].name in names) if naming is not None else ()
    headings, notes = ["time[s]", *(f"{name}[rad]" for name in names)], [f"joints from {topic}"]
    grid = grid_of(headings, columns, source=str(path), notes=notes)
    return fields_of(with_headings(grid, Naming("", pairs=given) if given else None))


def read_bag(path: Path) -> Streams:
    """Joint states and poses of a bag, from a child; times are the recorder's [s]."""
    if find_spec("rosbags") is None:
        raise MissingExtraError("reading bags", extra="ros")
    files = [path] if path.is_file() else [p for p in path.iterdir() if p.is_file()]
    size = sum(p.stat().st_size for p in files)
    return read_in_child(
        bag_streams,
        str(path.absolute()),
        path,
        needs="rosbags.highlevel",
        what="this bag",
        instead="check it with 'ros2 bag info'",
        seconds=1.0 + 5.0 * size / MEBIBYTE,
        memory=MEMORY + 4 * min(size, 1024 * MEBIBYTE),
    )


def bag_streams(path: str) -> Streams:
    """What `read_bag` gives, in this process."""
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    found: Streams = {"joints": {}, "poses": {}}
    with AnyReader([Path(path)], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        wanted = [c for c in reader.connections if c.msgtype in (JOINTS, *POSES) and c.topic != "/tf_static"]
        if sum(c.msgcount for c in wanted) > MAX_MESSAGES:
            raise ChildError(f"it has more than {MAX_MESSAGES} joint states and poses")
        for connection, recorded, raw in reader.messages(connections=wanted) if wanted else ():
            message: Any = reader.deserialize(raw, connection.msgtype)
            if connection.msgtype == JOINTS:
                at = dict(zip(message.name, message.position.tolist(), strict=False))
                found["joints"].setdefault(connection.topic, []).append((1e-9 * recorded, at))
                continue
            for part in getattr(message, "transforms", [message]):
                place = part.pose if hasattr(part, "pose") else part.transform
                at = getattr(place, "position", None) or place.translation
                turn = getattr(place, "orientation", None) or place.rotation
                name = part.child_frame_id if hasattr(message, "transforms") else connection.topic
                numbers = (at.x, at.y, at.z, turn.w, turn.x, turn.y, turn.z)
                found["poses"].setdefault(name, []).append((1e-9 * recorded, numbers))
    return found
