"""ROS bags (1, 2, mcap) and MATLAB files: their contents, read in a child with bounds of time and memory.

`read_bag` and `read_arrays` are the only entry points to the third-party readers.
"""

import io
import warnings
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from workbench.base.bounded_process import MEBIBYTE, ChildError
from workbench.base.errors import MissingExtraError
from workbench.data.binary_tables import read_bounded, read_in_child, refusal

MEMORY = 400 * MEBIBYTE
"""What a child may take beside a few times the size of a bag [bytes]."""
MAX_MESSAGES = 5_000_000
JOINTS = "sensor_msgs/msg/JointState"
POSES = ("geometry_msgs/msg/PoseStamped", "geometry_msgs/msg/TransformStamped", "tf2_msgs/msg/TFMessage")

Streams = dict[str, dict[str, dict[str, Any]]]


def read_arrays(data: bytes, path: Path) -> dict[str, np.ndarray]:
    """Arrays of a MATLAB file of version 5 to 7 by name, fields of structs as 'struct.field'."""
    what, instead = "this MATLAB file", "save it with -v7, or as CSV"
    if len(data) < 136 or 0 in data[:4] or data[124:128] not in (b"\0\1IM", b"\1\0MI"):
        raise refusal(what, "it has no header of version 5 to 7", instead, path)
    return read_bounded(matlab_arrays, "scipy.io", data, path, what=what, instead=instead)


def matlab_arrays(data: bytes) -> dict[str, np.ndarray]:
    """What `read_arrays` gives, in this process."""
    from scipy.io import loadmat

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            variables = loadmat(io.BytesIO(data))
        except (TypeError, ValueError, ArithmeticError, LookupError, OSError):
            raise ChildError("a variable is damaged") from None
    found: dict[str, np.ndarray] = {}
    for name, value in variables.items():
        if not name.startswith("__"):
            _collect(name, value, found)
    return found


def _collect(name: str, value: Any, found: dict[str, np.ndarray]) -> None:
    if isinstance(value, np.ndarray) and value.dtype.names and value.size == 1:
        for field in value.dtype.names:
            _collect(f"{name}.{field}", value.flat[0][field], found)
    elif type(value) is np.ndarray:
        found[name] = value


def read_bag(path: Path) -> Streams:
    """Joint states by topic, poses by topic or by the child frame of a transform.

    Each has `time` (of the recorder) and `stamp` (of the sender) [s]; joints have `names` and `q`, NaN where
    a message lacks one; poses have `pose`: x, y, z [m] and the quaternion w, x, y, z.
    """
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

    joints: dict[str, list] = {}
    poses: dict[str, list] = {}
    with AnyReader([Path(path)], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        wanted = [c for c in reader.connections if c.msgtype in (JOINTS, *POSES) and c.topic != "/tf_static"]
        if sum(c.msgcount for c in wanted) > MAX_MESSAGES:
            raise ChildError(f"it has more than {MAX_MESSAGES} joint states and poses")
        for connection, recorded, raw in reader.messages(connections=wanted) if wanted else ():
            message: Any = reader.deserialize(raw, connection.msgtype)
            if connection.msgtype == JOINTS:
                row = (recorded, _stamp(message), dict(zip(message.name, message.position, strict=False)))
                joints.setdefault(connection.topic, []).append(row)
                continue
            for part in getattr(message, "transforms", [message]):
                posed = hasattr(part, "pose")
                at = part.pose.position if posed else part.transform.translation
                turn = part.pose.orientation if posed else part.transform.rotation
                name = part.child_frame_id if hasattr(message, "transforms") else connection.topic
                numbers = (at.x, at.y, at.z, turn.w, turn.x, turn.y, turn.z)
                poses.setdefault(name, []).append((recorded, _stamp(part), numbers))
    return {
        "joints": {topic: _times(rows) | _positions(rows) for topic, rows in joints.items()},
        "poses": {
            name: _times(rows) | {"pose": np.array([row[2] for row in rows])} for name, rows in poses.items()
        },
    }


def _stamp(message: Any) -> float:
    stamp = message.header.stamp
    return stamp.sec + 1e-9 * stamp.nanosec


def _times(rows: list) -> dict[str, Any]:
    return {
        "time": 1e-9 * np.array([row[0] for row in rows], float),
        "stamp": np.array([row[1] for row in rows], float),
    }


def _positions(rows: list) -> dict[str, Any]:
    names = list(dict.fromkeys(name for row in rows for name in row[2]))
    return {"names": names, "q": np.array([[row[2].get(name, np.nan) for name in names] for row in rows])}
