"""Readers of what the package writes, from the documentation of those who load it; nothing of ours inside."""

import csv
import io
import re
from collections.abc import Callable

import numpy as np
import yaml
from generator import move, turn
from round_trip import placed

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


def standard_dh(rows: np.ndarray) -> Kinematics:
    """Rows of θ, d, a, α."""

    def pose(q):
        out = np.eye(4)
        for angle, (theta, d, a, alpha) in zip(q, rows, strict=True):
            out = out @ turn("z", angle + theta) @ move("z", d) @ move("x", a) @ turn("x", alpha)
        return out

    return pose


def ur_controller(text: str, nominal: np.ndarray) -> Kinematics:
    """calibration.conf added to the controller's table of θ, d, a, α."""
    deltas = {
        name: np.array([float(v) for v in re.search(rf"delta_{name} = \[(.*)\]", text)[1].split(",")])
        for name in ("theta", "d", "a", "alpha")
    }
    return standard_dh(nominal + np.column_stack(list(deltas.values())))


def spreadsheet(text: str) -> Kinematics:
    """A table of five constants a joint in the convention that its first line names."""
    convention = text.splitlines()[0].split("convention = ")[1]
    rows = list(csv.DictReader(io.StringIO(text.partition("\n")[2])))
    order = {"craig": "abxzd", "craig-hayati": "abxzd"}.get(convention, "zdxab")

    def pose(q):
        out, k = np.eye(4), 0
        for row in rows:
            c = {n.split("[")[0]: float(v) for n, v in row.items() if "[" in n}
            turned = slide = 0.0
            if row["type"] != "fixed":
                turned, slide = (q[k], 0.0) if row["type"] == "revolute" else (0.0, q[k])
                k += 1
            steps = {
                "z": turn("z", c["theta"] + turned),
                "d": move("z", c["d"] + slide),
                "x": move("x", c["a"]),
                "a": turn("x", c["alpha"]),
                "b": turn("y", c["beta"]),
            }
            for letter in order:
                out = out @ steps[letter]
        return out

    return pose


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
