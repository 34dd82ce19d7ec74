"""Files without units, as programs of controllers write them: rows of a known arm tell them, or nobody."""

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from tests.generator import VirtualArm, shift
from tests.round_trip import placed
from workbench import evaluate, identify, load_robot, read_measurements
from workbench.base.errors import UnitError
from workbench.data.readers.read import preview

H = np.pi / 2
UR5E = [(0, 0.1625, 0, H), (0, 0, -0.425, 0), (0, 0, -0.3922, 0), (0, 0.1333, 0, H), (0, 0.0997, 0, -H),
        (0, 0.0996, 0, 0)]  # fmt: skip


@pytest.fixture(scope="module")
def measured():
    return poses_of_ur5e(np.random.default_rng(11), 40)


def poses_of_ur5e(rng, count):
    """Joints [rad] and poses [m] of a UR5e with errors of half a millimetre, elsewhere in a room."""
    table = np.column_stack([np.array(UR5E) + rng.normal(0.0, 5e-4, (6, 4)), np.zeros(6)])
    base = placed([0.4, -0.3, 0.9], [0.02, -0.01, 0.7])
    q = rng.uniform([-2, -2.2, 0.3, -2, -2, -2], [2, -0.4, 2.2, 2, 2, 2], (count, 6))
    return q, VirtualArm("dh", table, base=base, tool=shift([0.01, 0.02, 0.08])).pose(q)


def table(names, *columns):
    """A file without a unit in it."""
    rows = np.column_stack(columns)
    return "\n".join([",".join(names), *(",".join(f"{v:.9g}" for v in row) for row in rows)])


def joints(*stems):
    return [f"{stem}{k}" for stem in stems for k in range(1, 7)]


def quat(t):
    return Rotation.from_matrix(t[:, :3, :3]).as_quat()


def degrees(q, t, axes):
    """Joints [deg], places [mm], and Euler angles [deg]."""
    return np.degrees(q), 1e3 * t[:, :3, 3], Rotation.from_matrix(t[:, :3, :3]).as_euler(axes, degrees=True)


def numbered(name, count, first=0):
    return [f"{name}{k}" for k in range(first, first + count)]


UR = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
TF = [f"/tf/tool/{n}" for n in (*(f"translation/{a}" for a in "xyz"), *(f"rotation/{a}" for a in "xyzw"))]
T44, NOAP = [f"T{i}{j}" for i in "1234" for j in "1234"], "nx ox ax px ny oy ay py nz oz az pz"
FORMS = {
    "a controller": lambda q, t: ([*joints("J"), *"XYZABC"], np.degrees(q), 1e3 * t[:, :3, 3], 0 * q[:, 3:]),
    "ROS": lambda q, t: (["timestamp", "tx", "ty", "tz", "qx", "qy", "qz", "qw", *joints("joint_")],
                         np.arange(len(q)), t[:, :3, 3], quat(t), q),
    "KUKA": lambda q, t: ([*joints("A"), *"XYZABC"], *degrees(q, t, "ZYX")),
    "Fanuc": lambda q, t: ([*joints("J"), *"XYZWPR"], *degrees(q, t, "xyz")),
    "ABB": lambda q, t: ([*joints("rax_"), *"xyz", "q1", "q2", "q3", "q4"],
                         *degrees(q, t, "xyz")[:2], np.roll(quat(t), 1, axis=1)),
    "RAPID": lambda q, t: ([*joints("rax_"), "trans_x", "trans_y", "trans_z", *numbered("rot_q", 4, 1)],
                           *degrees(q, t, "xyz")[:2], np.roll(quat(t), 1, axis=1)),
    "Yaskawa": lambda q, t: ([*"SLURBTXYZ", "Rx", "Ry", "Rz"], *degrees(q, t, "xyz")),
    "w first, called 0": lambda q, t: ([*joints("J"), *"xyz", "q0", "qx", "qy", "qz"],
                                       q, t[:, :3, 3], np.roll(quat(t), 1, axis=1)),
    "UR's names": lambda q, t: ([*(f"/ur/joint_states/{n}_joint/position" for n in UR), *TF],
                                q, t[:, :3, 3], quat(t)),
    "libfranka": lambda q, t: ([*(f"q[{k}]" for k in range(6)), *(f"O_T_EE[{k}]" for k in range(16))],
                               q, by_columns(t)),
    "Leica": lambda q, t: ([*joints("J"), *"XYZ", *numbered("Q", 4)], q, t[:, :3, 3], np.roll(quat(t), 1, 1)),
    "Epson": lambda q, t: ([*joints("J"), *"XYZUVW", *joints("tau_")], *degrees(q, t, "ZYX"), q),
    "matrices": lambda q, t: ([*joints("q"), *T44[:12]], q, t[:, :3].reshape(-1, 12)),
    "matrices by columns": lambda q, t: ([*joints("q"), *T44], q, by_columns(t)),
    "numbered matrices": lambda q, t: ([*joints("q"), *numbered("m", 16)], q, t.reshape(-1, 16)),
    "axes": lambda q, t: ([*joints("q"), *NOAP.split()], q, t[:, :3].reshape(-1, 12)),
    "poses of six": lambda q, t: ([*joints("q"), *numbered("tcp_pose_", 6)], q, t[:, :3, 3],
                                  Rotation.from_matrix(t[:, :3, :3]).as_rotvec()),
    "a position of six": lambda q, t: ([*joints("J"), *numbered("position_", 6, 1)], *degrees(q, t, "xyz")),
    "Mecademic": lambda q, t: ([*joints("theta"), "Xm", "Ym", "Zm", "alpha", "beta", "gamma"],
                               *degrees(q, t, "XYZ")),
    "poses of seven": lambda q, t: ([*joints("q"), *numbered("pose_", 7, 1)], q, t[:, :3, 3], quat(t)),
    "w first, called x": lambda q, t: ([*joints("J"), *"xyz", "qx", "qy", "qz", "qw"],
                                       q, t[:, :3, 3], np.roll(quat(t), 1, axis=1)),
}  # fmt: skip


def by_columns(t):
    return t.transpose(0, 2, 1).reshape(-1, 16)


@pytest.mark.parametrize("form", FORMS)
def test_rows_tell_the_units(form, measured, tmp_path):
    names, *columns = FORMS[form](*measured)
    path = tmp_path / "rows.csv"
    path.write_text(table(names, *columns))
    assert not preview(path, joints=6).problems
    errors = identify("ur5e", path).best.held_out
    assert errors.position_mm.mean < 1e-3
    assert form == "a controller" or errors.orientation_deg.mean < 1e-4


@pytest.mark.parametrize("form", ["lines", "rows", "objects", "columns", "npz", "npz of columns", "files"])
def test_arrays_of_programs_are_tables(form, measured, tmp_path):
    q, t = measured
    xyz, quat = t[:, :3, 3], Rotation.from_matrix(t[:, :3, :3]).as_quat()
    each = [*zip(q.tolist(), xyz.tolist(), quat.tolist(), strict=True)]
    rows = [{"q": a, "xyz": p, "quat": o} for a, p, o in each]
    path = tmp_path / f"rows.{'npz' if form[:3] == 'npz' else 'json'}"
    if form == "files":
        path = tmp_path
        for k, (a, pose) in enumerate(zip(q, t, strict=True)):
            np.savetxt(path / f"joints_{k:02}.txt", a)
            np.savetxt(path / f"pose_{k:02}.txt", pose, delimiter=",")
    elif form[:3] == "npz":
        columns = (q, t) if form == "npz" else (q.T, np.moveaxis(t, 0, 2))
        np.savez(path, joint_positions=columns[0], poses=columns[1], commanded_poses=np.ones_like(t))
    else:
        columns = {"joints": q.tolist(), "position": xyz.tolist(), "orientation": quat.tolist()}
        lines = "\n".join(map(json.dumps, rows))
        poses = [{"joints_rad": a, "pose": {"position": p, "orientation": o}} for a, p, o in each]
        forms = {"rows": rows, "columns": columns, "objects": {"robot": "ur5e", "samples": poses}}
        path.write_text(lines if form == "lines" else json.dumps(forms[form]))
    errors = identify("ur5e", path).best.held_out
    assert errors.position_mm.mean < 1e-3
    assert errors.orientation_deg.mean < 1e-4


SHAPES = [
    {"q": (9, 6), "poses": (9, 4, 4), "T_base": (4, 4), "T_tool": (4, 4)},
    {"K": (3, 3), "q": (9, 6), "points": (9, 3), "R_cam": (3, 3)},
    {"q": (9, 6), "positions": (9, 3), "limits": (6, 2), "dh": (6, 4), "masses": (6, 6)},
    *({"q": (n, 6), "tcp_pose": (n, 6)} for n in (3, 4, 5, 6)),
    {"q": (5, 6), "x": (5,), "y": (5,), "z": (5,)},
    *({"q_rad": (6, n), "points_m": (3, n), "limits": (6, 2), "masses": (6, 6)} for n in (4, 9)),
]


@pytest.mark.parametrize("shapes", SHAPES)
def test_rows_of_arrays_are_those_of_the_joints(shapes, tmp_path):
    fill = {name: np.eye(4) if shape[-2:] == (4, 4) else 0.5 for name, shape in shapes.items()}
    np.savez(tmp_path / "rows.npz", **{name: np.broadcast_to(fill[name], s) for name, s in shapes.items()})
    data = read_measurements(tmp_path / "rows.npz")
    assert (data.joints, data.position.shape) == (6, (len(data), 3))


@settings(max_examples=6, deadline=None)
@given(
    angle=st.sampled_from([1.0, 180.0 / np.pi]),
    length=st.sampled_from([1.0, 1e3, 1e2, 1.0 / 0.0254]),
    turned=st.booleans(),
    seed=st.integers(0, 99),
)
def test_any_units_of_a_few_rows(measured, tmp_path_factory, angle, length, turned, seed):
    q, t = measured
    some = np.random.default_rng(seed).choice(len(q), 25, replace=False)
    angles = Rotation.from_matrix(t[some, :3, :3]).as_euler("xyz") * angle
    names, columns = [*joints("q"), *"xyz"], [angle * q[some], length * t[some, :3, 3]]
    if turned:
        names, columns = [*names, "roll", "pitch", "yaw"], [*columns, angles]
    path = tmp_path_factory.mktemp("units") / "rows.csv"
    path.write_text(table(names, *columns))
    rows = evaluate("ur5e", path, fit_frames=True)
    assert rows.errors.position.mean() < 0.01
    assert np.allclose(rows.data.q, q[some], atol=1e-6)


def test_rows_of_another_arm_tell_no_units(measured, tmp_path):
    names, *columns = FORMS["a controller"](*measured)
    path = tmp_path / "rows.csv"
    path.write_text(table(names, *columns))
    for robot in ("aria", "iiwa14" if load_robot("iiwa14").dof == 6 else "xarm6"):
        with pytest.raises(UnitError, match="the unit is missing"):
            identify(robot, path)
    path.write_text(table(names, *(c[:5] for c in columns)))  # too few
    with pytest.raises(UnitError, match=r"write 'J1\[deg\]'"):
        identify("ur5e", path)
    with pytest.raises(UnitError, match="the unit is missing"):  # who reads a file alone has no arm to ask
        _ = read_measurements(path).said
