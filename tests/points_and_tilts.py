"""An arm by numpy alone, and tables of points and inclinometer readings mixed."""

import csv

import numpy as np
from generator import VirtualArm, shift, three_parallel

DH = three_parallel().table[:, :4]
"""theta, d, a, alpha of a UR5 [rad, m]."""
LINK = 3
"""The link that carries the inclinometer."""
TOOL = np.array([0.02, -0.03, 0.12])


def arm(dh, **more):
    return VirtualArm("dh", np.column_stack([dh, np.zeros(len(dh))]), **more)


def frames(dh, q):
    """Frames after every joint, standard DH."""
    return arm(dh).straight(q)[1]


def points(dh, q, tool=TOOL):
    last = frames(dh, q)[-1]
    return last[:, :3, :3] @ tool + last[:, :3, 3]


def upwards(dh, q):
    """The direction upwards in the axes of the link."""
    return frames(dh, q)[LINK - 1][:, 2, :3]


def hidden(size, seed=0):
    """An arm that was made a little wrong."""
    return DH + size * np.random.default_rng(seed).normal(size=DH.shape)


def write_rows(path, dh, *, seen, tilted, seed, noise=0.0):
    """A table whose first rows have a point and whose other rows have an inclinometer's reading alone."""
    rng = np.random.default_rng(seed)
    q = rng.uniform(-1.5, 1.5, (seen + tilted, 6)) - [0, 1.0, 0, 0, 0, 0]
    xyz = points(dh, q) + noise * rng.normal(size=(len(q), 3))
    u = upwards(dh, q) + 1e-5 * rng.normal(size=(len(q), 3))
    tilt = np.stack([np.arctan2(u[:, 1], u[:, 2]), np.arctan2(-u[:, 0], np.hypot(u[:, 1], u[:, 2]))], 1)
    heads = [f"q{i}[rad]" for i in range(1, 7)] + ["x[m]", "y[m]", "z[m]"]
    with path.open("w", newline="") as file:
        write = csv.writer(file).writerow
        write([*heads, f"tilt_x{LINK}[rad]", f"tilt_y{LINK}[rad]"])
        for i in range(len(q)):
            point = [*xyz[i].tolist(), "", ""] if i < seen else ["", "", "", *tilt[i].tolist()]
            write([*q[i].tolist(), *point])
    return q, xyz, tilt


def robot_file(path, dh=DH, *, free=False):
    path.write_text(arm(dh, tool=shift(TOOL)).toml("typed", free=str(free).lower()))
    return path


def write_mixed(tmp_path):
    """Ten points, 30 inclinometer readings, and the file of the nominal arm."""
    made = hidden(1e-3)
    q, xyz, tilt = write_rows(tmp_path / "mixed.csv", made, seen=10, tilted=30, seed=1)
    robot_file(tmp_path / "arm.toml")
    return q, xyz, tilt
