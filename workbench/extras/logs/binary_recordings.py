"""Bags of ROS 1 and 2 (mcap too) and C3D files: their arrays, read in a child with bounds of time and memory.

`read_bag` and `read_c3d` are the only entry points to the third-party readers.
"""

import math
import struct
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from workbench.base.bounded_process import MEBIBYTE, ChildError
from workbench.base.errors import MissingExtraError
from workbench.data.binary_tables import read_in_child

MEMORY = 400 * MEBIBYTE
"""What a child may take beside a few times the file's size [bytes]."""
MAX_MESSAGES = 5_000_000
JOINTS = "sensor_msgs/msg/JointState"
POSES = ("geometry_msgs/msg/PoseStamped", "geometry_msgs/msg/TransformStamped", "tf2_msgs/msg/TFMessage")

Streams = dict[str, dict[str, dict[str, Any]]]


def read_bag(path: Path) -> Streams:
    """Joint states by topic, poses by topic or by the child frame of a transform.

    Each has `time` (of the recorder) and `stamp` (of the sender) [s]; joints have `names` and `q`, NaN where
    a message lacks one; poses have `pose`: x, y, z [m] and the quaternion w, x, y, z.
    """
    texts = {"what": "this bag", "instead": "check it with 'ros2 bag info'"}
    return _read(bag_streams, path, "rosbags.highlevel", "ros", **texts)


def read_c3d(path: Path) -> tuple[np.ndarray, list[str], np.ndarray]:
    """Time of every frame [s], names of the points, and their places [m], NaN where one was not seen."""
    texts = {"what": "this C3D file", "instead": "export it again, or as CSV"}
    return _read(c3d_points, path, "ezc3d", "mocap", **texts)


def _read(function, path: Path, library: str, extra: str, *, what: str, **more: Any) -> Any:
    if find_spec(library.partition(".")[0]) is None:
        raise MissingExtraError(f"reading {what.removeprefix('this ')}s", extra=extra)
    files = [path] if path.is_file() else [p for p in path.iterdir() if p.is_file()]
    size = sum(p.stat().st_size for p in files)
    bounds: dict[str, Any] = {
        "seconds": 1.0 + 5.0 * size / MEBIBYTE,
        "memory": MEMORY + 4 * min(size, 1024 * MEBIBYTE),
    }
    return read_in_child(function, str(path.absolute()), path, needs=library, what=what, **bounds, **more)


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
    q = np.array([[row[2].get(name, np.nan) for name in names] for row in rows])
    return {"names": names, "q": q}


def _check_c3d(data: bytes) -> None:
    """Refuse parameters that reach beyond the file, by which the reader crashes or never ends.

    Source: The C3D File Format User Guide (Motion Lab Systems), chapter "The parameter section".
    """
    try:
        at = 512 * (data[0] - 1) + 4
        order = ">" if data[at - 1] == 86 else "<"  # SGI/MIPS; Intel and DEC
        while letters := struct.unpack_from("b", data, at)[0]:
            name_end = at + 2 + abs(letters)
            step = struct.unpack_from(f"{order}h", data, name_end)[0]
            end = name_end + 2
            if struct.unpack_from("b", data, at + 1)[0] > 0:  # a parameter; groups have negative numbers
                size, dimensions = data[end], data[end + 1]
                shape = data[end + 2 : end + 2 + dimensions]
                end += 2 + dimensions + {255: 1, 1: 1, 2: 2, 4: 4}[size] * math.prod(shape)
            at = name_end + step if step else len(data)
            if end < at:
                end += 1 + data[end]  # its description
            if end > at:
                raise IndexError
            if not step:
                return
    except (IndexError, KeyError, struct.error):
        raise ChildError("its parameters are broken") from None


def c3d_points(path: str) -> tuple[np.ndarray, list[str], np.ndarray]:
    """What `read_c3d` gives, in this process."""
    import ezc3d

    _check_c3d(Path(path).read_bytes())
    file = ezc3d.c3d(path)
    parameters, points = file["parameters"]["POINT"], np.asarray(file["data"]["points"], float)
    scale = {"m": 1.0, "mm": 1e-3, "cm": 1e-2}.get(str(parameters["UNITS"]["value"][0]).strip().lower())
    if scale is None:
        raise ChildError(f"its unit is '{parameters['UNITS']['value'][0]}', not m, cm or mm")
    rate = float(parameters["RATE"]["value"][0])
    names = [str(name) for name in parameters["LABELS"]["value"]][: points.shape[1]]
    places = scale * np.moveaxis(points[:3], 0, 2)  # points, frames, 3
    residuals = np.asarray(file["data"]["meta_points"]["residuals"])[0]
    places[(residuals < 0.0) | (np.abs(places) < 1e-12).all(2)] = np.nan
    return np.arange(points.shape[2]) / rate, names, places
