"""Readers of what the package writes, from the documentation of those who load it; nothing of ours inside."""

import csv
import io
import re
from collections.abc import Callable

import numpy as np
import yaml
from generator import VirtualArm, turn
from round_trip import placed, rows_of, toml_arm

Kinematics = Callable[[np.ndarray], np.ndarray]
"""Joint positions of one pose to the flange's pose in the arm's base."""


def origin(x, y, z, roll, pitch, yaw) -> np.ndarray:
    return placed([x, y, z], [roll, pitch, yaw])


def kinematics_file(text: str, head: str, inner: str) -> Kinematics:
    """UR, xArm, Franka: each joint in the link before it, turning about its z axis."""
    table = yaml.safe_load(text)
    table = table[head] if head else table
    entries = [e[inner] if inner else e for name, e in table.items() if name != "hash"]
    frames = [origin(*(e[k] for k in ("x", "y", "z", "roll", "pitch", "yaw"))) for e in entries]

    def pose(q):
        out = np.eye(4)
        for k, frame in enumerate(frames):
            out = out @ frame @ (turn("z", q[k]) if k < len(q) else np.eye(4))
        return out

    return pose


def ur_controller(text: str, nominal: np.ndarray) -> Kinematics:
    """calibration.conf added to the controller's table of θ, d, a, α."""
    deltas = {
        name: np.array([float(v) for v in re.search(rf"delta_{name} = \[(.*)\]", text)[1].split(",")])
        for name in ("theta", "d", "a", "alpha")
    }
    table = np.column_stack([nominal + np.column_stack(list(deltas.values())), np.zeros(len(nominal))])
    return lambda q: VirtualArm("dh", table).pose(q)[0]


def spreadsheet(text: str) -> Kinematics:
    """A table of five constants a joint in the convention that its first line names."""
    head, _, table = text.partition("\n")
    lines = [f'convention = "{head.split("convention = ")[1].strip()}"']
    for row in csv.DictReader(io.StringIO(table)):
        numbers = [f"{name.partition('[')[0]} = {value}" for name, value in row.items() if "[" in name]
        lines += ["[[joint]]", f'type = "{row["type"]}"', *numbers]
    arm = toml_arm("\n".join(lines))
    return lambda q: arm(rows_of(q[None]))[0][0]


def mjcf(path: str) -> Kinematics:
    """By pinocchio's own reader of MJCF: the site `tool` in the measuring frame.

    Pinocchio up to 4.1 leaves out where a first body without joint stands (its issue 2782).
    """
    import xml.etree.ElementTree as ET

    import pinocchio as pin

    first = ET.parse(path).find("worldbody/body")
    x, y, z, w, i, j, k = (float(v) for name in ("pos", "quat") for v in first.get(name).split())
    base = pin.SE3(pin.Quaternion(w, i, j, k), np.array([x, y, z])).homogeneous
    model = pin.buildModelFromMJCF(path)
    data, frame = model.createData(), model.getFrameId("tool")

    def pose(q):
        pin.framesForwardKinematics(model, data, q)
        return base @ data.oMf[frame].homogeneous

    return pose
