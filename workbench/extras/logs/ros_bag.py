"""Bags of ROS 1 and 2: joint states joined with the poses that an instrument published; extra `ros`.

A pose is a topic of PoseStamped or TransformStamped, or a frame of /tf by name. A bag often holds the robot's
own forward kinematics as well: with more than one candidate the user chooses which one is measured. Times are
those of the recorder, which has one clock for all topics; the senders' stamps may come from several.
"""

import re
from pathlib import Path
from typing import Any, final

import numpy as np

from workbench.base import se3
from workbench.base.errors import DataError
from workbench.base.remedy import remedy
from workbench.base.wording import listed
from workbench.data.readers.columns_option import Naming
from workbench.data.readers.fields import Fields
from workbench.data.readers.headings import meaning
from workbench.data.readers.layouts.layout import AbstractFileLayout
from workbench.extras.logs.binary_files import read_bag
from workbench.extras.logs.recording import Logged, choice, chosen
from workbench.extras.logs.standstills import join_by_time

SKEW = 0.1
"""Difference between senders' clocks that is reported [s]."""


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
        inner = (
            path.parent
            if path.suffix.lower() == ".db3" and (path.parent / "metadata.yaml").exists()
            else path
        )
        streams = read_bag(inner)
        if not streams["joints"]:
            raise DataError(f"{path}: there are no joint states (sensor_msgs/JointState) in this bag")
        topic = chosen(list(streams["joints"]), choice(naming, "joints"), f"{path}: joint topics", "joints")
        joints = _joints(path, topic, streams["joints"][topic], naming)
        if not streams["poses"]:
            return joints
        pose = chosen(list(streams["poses"]), choice(naming, "pose"), f"{path}: poses", "pose")
        found = streams["poses"][pose]
        numbers = found["pose"]
        turns = se3.quaternion_to_matrix(
            numbers[:, 3:] / np.linalg.norm(numbers[:, 3:], axis=1, keepdims=True)
        )
        measured = Logged(time=found["time"], bodies={pose: (numbers[:, :3], turns)}, notes=_skew(streams))
        return join_by_time(measured.fields(path, self.name, None), joints, one_clock=True)


def _joints(path: Path, topic: str, found: dict[str, Any], naming: Naming | None) -> Fields:
    given = {pair.left.name: pair.right[0].name for pair in naming.pairs} if naming is not None else {}
    values: dict[str, np.ndarray] = {"time": found["time"]}
    headings, left = {}, []
    for k, name in enumerate(found["names"]):
        known = meaning(given.get(name, name))
        if known is not None and re.fullmatch(r"q\d+", known.key) and known.key not in values:
            values[known.key], headings[known.key] = found["q"][:, k], name
        else:
            left.append(name)
    if not headings:
        raise DataError(
            f"{path}: the joints of {topic} are called {listed(found['names'])}, which does not say their "
            "order: name them with "
            + remedy(
                'columns="shoulder=q1,elbow=q2 …" (--columns), or a mapping',
                page="'workbench identify --columns', or load a CSV here",
            )
        )
    read = ", ".join(f"{name} is {key}" for key, name in sorted(headings.items()))
    notes = [f"joints from {topic}: {read}"]
    if left:
        notes.append(f"joints that are left out: {listed(left)}")
    return Fields(
        source=str(path),
        lines=tuple(range(1, len(found["time"]) + 1)),
        values=values,
        headings=headings,
        units=dict.fromkeys(headings, "rad"),
        notes=tuple(notes),
    )


def _skew(streams: dict[str, dict[str, dict[str, Any]]]) -> tuple[str, ...]:
    """How far the senders' clocks are from the recorder's, where that is worth a note."""
    notes = []
    for name, found in (pair for kind in streams.values() for pair in kind.items()):
        ahead = float(np.median(found["stamp"] - found["time"]))
        if abs(ahead) > SKEW and found["stamp"].any():
            notes.append(
                f"stamps of '{name}' are {ahead:+.2f} s off the recorder's clock, which is used for all"
            )
    return tuple(notes)
