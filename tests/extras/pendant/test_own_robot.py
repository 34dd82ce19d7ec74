"""One's own robot: tables that are read wrongly in every way, found out by three poses of the pendant."""

import json
import tomllib

import numpy as np
import pytest
from binary_files import workbook
from displays import TOOL
from generator import VirtualArm
from points_and_tilts import frames
from refusals import mentions, refuses
from round_trip import placed
from scipy.spatial.transform import Rotation
from slow import slow

import workbench as wb
from workbench import Dataset, Motion, Robot, load_robot, tool_poses
from workbench.arm.conventions import CONSTANTS
from workbench.arm.robot_toml import robot_to_table
from workbench.arm.signs_and_offsets import with_signs_and_offsets
from workbench.arm.statics.moments import joint_moments
from workbench.base import se3
from workbench.base.errors import DataError, FileError, OptionError, ShapeError
from workbench.extras.pendant.displayed import Displayed, Shown, displayed
from workbench.extras.pendant.own_robot.find_convention import FoundConvention, find_convention
from workbench.extras.pendant.own_robot.table_meanings import TableReading, read_joint_table, table_readings
from workbench.session.commands.arm import LoadModel, holds_robot

ANGLES = (se3.matrix_to_rpy, lambda r: se3.matrix_to_rpy(r)[..., ::-1], se3.matrix_to_rotvec)


def plain(name: str) -> Robot:
    return load_robot(name).bare


def shown(numbers: np.ndarray, robot: Robot) -> Displayed:
    """Numbers as a pendant shows them, without units."""
    parts = np.split(numbers, [robot.dof, robot.dof + 3], axis=1)
    return displayed(robot, [Shown(own, 0.0 * own) for own in parts], "typed", np.arange(len(numbers)))


def exactly(q: np.ndarray, poses: np.ndarray) -> Dataset:
    return Dataset(q=q, position=poses[:, :3, 3], rotation=poses[:, :3, :3])


def rows_of(robot: Robot, length: float = 1.0, angle: float = 1.0) -> list[dict]:
    keep = ("type", *CONSTANTS)
    size = dict.fromkeys(CONSTANTS, angle) | {"d": length, "a": length}
    rows = robot_to_table(robot)["joint"]
    return [{k: v if k == "type" else v * size[k] for k, v in row.items() if k in keep} for row in rows]


def wrong_choice(rng: np.random.Generator, name: str):
    """An arm, how its pendant counts, its table in some units, and three poses as they are typed."""
    arm = plain(name)
    low, high = arm.search_limits.T
    q = rng.uniform(np.maximum(low, -2.5), np.minimum(high, 2.5), (3, arm.dof))
    poses = tool_poses(arm, Motion(q))
    signs = np.where(rng.random(arm.dof) < 0.3, -1.0, 1.0)
    offsets = (
        np.zeros(arm.dof),
        rng.choice([0.0, 0.5 * np.pi, np.pi, -0.5 * np.pi], arm.dof),
        np.where(rng.random(arm.dof) < 0.4, rng.uniform(-np.pi, np.pi, arm.dof), 0.0),
    )[rng.integers(3)]
    table = rows_of(arm, rng.choice([1.0, 1e3]), rng.choice([1.0, np.rad2deg(1.0)]))
    shown = signs * (q - offsets)
    angles = ANGLES[rng.integers(3)](poses[:, :3, :3])
    parts = [
        np.round(np.rad2deg(shown), 2) if rng.random() < 0.7 else np.round(shown, 4),
        np.round(1e3 * poses[:, :3, 3], 1) if rng.random() < 0.7 else np.round(poses[:, :3, 3], 4),
        np.round(np.rad2deg(angles), 2) if rng.random() < 0.7 else np.round(angles, 4),
    ]
    return arm, signs, offsets, table, np.column_stack(parts)


def right(found: FoundConvention, arm: Robot, signs: np.ndarray, offsets: np.ndarray) -> bool:
    """Whether the arm that was found goes where the pendant says, everywhere."""
    q = np.random.default_rng(0).uniform(-2.0, 2.0, (50, arm.dof))
    distance = tool_poses(found.robot, Motion(q)) - tool_poses(arm, Motion(signs * q + offsets))
    return bool(np.abs(distance[:, :3, 3]).max() < 2e-3)


@pytest.mark.parametrize(("name", "seed"), [slow("ur10", 10), ("aria", 1), ("iiwa14", 8), ("katana450", 9)])
def test_signs_offsets_units_and_convention_are_found(name, seed):
    arm, signs, offsets, table, numbers = wrong_choice(np.random.default_rng(seed), name)
    found = find_convention(readings := table_readings(table), shown(numbers, readings[0].robot))
    assert right(found, arm, signs, offsets)
    wanted = "modified DH (Craig)" if arm.convention.startswith("craig") else "standard DH"
    assert found.assumptions[0] == wanted
    assert found.reading.position < 1e-3


def test_a_wrong_table_is_refused_and_an_unmoved_joint_is_named():
    arm = plain("ur10")
    table = rows_of(arm)
    table[2]["a"] *= 1.1
    for many, facts in ((3, ("11.9 mm", "standard DH")), (8, ("joint3.a -572.3 instead of -629.5 mm",))):
        q = np.random.default_rng(4).uniform(-2.0, 2.0, (many, 6))
        with refuses(DataError, *facts):
            find_convention(table_readings(table), exactly(q, tool_poses(arm, Motion(q))))
    q[:, 4] = 0.7
    poses = tool_poses(arm, Motion(q))
    still = exactly(q, poses)
    with refuses(DataError, "joint 5"):
        find_convention(table_readings(rows_of(arm)), still)
    for few in (q[:2], q[:, :5]):
        with pytest.raises(ShapeError):
            find_convention(table_readings(rows_of(arm)), exactly(few, poses[: len(few)]))


def test_a_slip_in_one_pose_is_named_with_its_size():
    arm = plain("ur10")
    q = np.random.default_rng(4).uniform(-2.0, 2.0, (4, 6))
    poses = tool_poses(arm, Motion(q)).copy()
    poses[2, 1, 3] += 0.040
    with refuses(DataError, "pose 3", "40 mm"):
        find_convention([TableReading(arm, ("as given",))], exactly(q, poses))


@pytest.mark.parametrize(
    ("axes", "expected"), [("ZYZ", "Doosan"), ("XYZ", "Stäubli"), ("", "ABB"), ("R", "matrix")]
)
def test_makers_angles_are_read(axes, expected):
    """R = R1(a) R2(b) R3(c), each about an axis that the last one turned; or a quaternion; or R itself."""
    arm = plain("ur10")
    q = np.random.default_rng(7).uniform(-2.0, 2.0, (3, 6))
    poses = tool_poses(arm, Motion(q))
    turned = Rotation.from_matrix(poses[:, :3, :3])
    angles = turned.as_matrix().reshape(3, 9) if axes == "R" else turned.as_quat(scalar_first=True)
    angles = turned.as_euler(axes, degrees=True) if axes[1:] else angles
    numbers = np.column_stack([np.rad2deg(q), 1e3 * poses[:, :3, 3], angles])
    found = find_convention([TableReading(arm)], shown(numbers, arm))
    assert expected in found.assumptions[-1]
    assert found.reading.position < 1e-6


def test_tables_are_read_as_they_stand_in_books(tmp_path):
    path = tmp_path / "table.csv"
    rows = "0,20,0,0,fixed\nq1-90,100,0,pi/2,r\nθ2,0,425,-2*π/3,p\n"
    path.write_text(f"theta[deg],d[mm],Length (a) [m],alpha[rad],type\n{rows}")  # each exact in its own units
    given = read_joint_table(path)
    assert (given.lengths, given.angles, given.rows[2]["a"]) == (("m",), ("rad",), 425.0)
    assert given.rows[1]["theta"] == pytest.approx(-np.pi / 2)
    path.write_text("theta,d,a,alpha\nθ1,0.1,0,0\n0,d2*,0,0\nq3,1,0,0\n")
    assert [row["type"] for row in read_joint_table(path).rows] == ["revolute", "prismatic", "revolute"]
    for unsaid in ("θ1,d1,0,0\n0,d2,0,0\n", "0,d1,0,0\n90,0,1,0\n"):
        path.write_text(f"theta,d,a,alpha\n{unsaid}")
        with refuses(FileError, "d is 'd1'", line=2):
            read_joint_table(path)
    path.write_text(f"theta[rad],d[mm],a[mm],alpha[rad],type\n{rows.replace('q1-90', 'q1 − pi/2')}")
    rows = read_joint_table(path).rows
    assert [row["type"] for row in rows] == ["fixed", "revolute", "prismatic"]
    np.testing.assert_allclose([row["theta"] for row in rows], [0.0, -np.pi / 2, 0.0])
    np.testing.assert_allclose([row["alpha"] for row in rows], [0.0, np.pi / 2, -2.0 * np.pi / 3])
    path.write_text("theta,d,a,alpha\npie,0,0,0\n")
    with refuses(FileError, "theta is 'pie'", line=2):
        read_joint_table(path)


@pytest.mark.parametrize("name", ["ur10", "aria", "panda", "katana450"])
def test_joints_counted_otherwise_are_the_same_arm_with_the_same_weights(name):
    arm = plain(name)
    rng = np.random.default_rng(6)
    signs, offsets = np.where(rng.random(arm.dof) < 0.5, -1.0, 1.0), rng.uniform(-2.0, 2.0, arm.dof)
    signs[0], signs[-1] = -1.0, -1.0
    again = with_signs_and_offsets(arm, signs, offsets)
    assert again.convention == arm.convention
    q = rng.uniform(-1.0, 1.0, (20, arm.dof))
    counted = Motion(signs * q + offsets)
    np.testing.assert_allclose(tool_poses(again, Motion(q)), tool_poses(arm, counted), atol=1e-12)
    np.testing.assert_allclose(np.sort((signs * again.limits.T + offsets).T), arm.limits, atol=1e-12)
    if arm.has_masses:
        moments = joint_moments(again, Motion(q)).about
        np.testing.assert_allclose(moments, signs * joint_moments(arm, counted).about, atol=1e-9)


def test_tables_as_people_write_them(tmp_path):
    path = tmp_path / "t.csv"
    path.write_text("Joint;θ [°];d (mm);r [mm];α [deg];type\n1;0;89.2;0;90;R\n2;0;0;-425;;revolute\n\n")
    table = read_joint_table(path)
    path.write_text("Joint;θ_i (deg);d_i;a_{i-1} (mm);alpha_{i-1}\n1;q1;89.2;0;90°\n2;q2 − 90°;0;-425;0\n")
    as_in_papers = [[row[name] for name in CONSTANTS[:4]] for row in read_joint_table(path).rows]
    assert as_in_papers == [[0.0, 89.2, 0.0, 90.0], [-90.0, 0.0, -425.0, 0.0]]
    assert (table.lengths, table.angles, table.conventions) == (("mm",), ("deg",), ("dh", "craig"))
    assert table.rows[1] == {"type": "revolute"} | dict.fromkeys(CONSTANTS, 0.0) | {"a": -425.0}
    for head in (
        "i,θ(i) [deg],d(i) [mm],a i-1 (mm),alpha(i-1)",
        "Joint,Angle [deg],Offset [mm],Length,Twist",
    ):
        path.write_text(f"{head}\n1,0,89.2,0,90\n2,-90,0,-425,0\nLength: along x\n")
        assert [[row[name] for name in CONSTANTS[:4]] for row in read_joint_table(path).rows] == as_in_papers
    path.write_text("theta_deg,d_mm,a_mm,alpha_deg\n1,89.2,0,2\n")
    assert (read_joint_table(path).lengths, read_joint_table(path).angles) == (("mm",), ("deg",))
    for text in ("theta,d,a\n0,0,0\n", "", "theta[mm],d,a,alpha\n0,0,0,0\n", "theta,d,a,alpha\n0,x,0,0\n"):
        path.write_text(text)
        with pytest.raises(FileError):
            read_joint_table(path)


@pytest.mark.parametrize(("alpha", "units"), [(5.0, {"rad", "deg"}), (1.571, {"rad"}), (90.0, {"deg"})])
def test_small_angles_may_be_degrees_where_none_is_a_quarter_turn(alpha, units):
    rows = [{"theta": 1.0, "d": 0.1, "a": 0.2, "alpha": alpha}] * 3
    assert {reading.assumptions[-1].split()[-1] for reading in table_readings(rows)} == units


def test_tables_of_programs_are_those_of_spreadsheets(refused, tmp_path):
    """JSON, YAML and a workbook of one table; what is none of these is refused before poses are typed."""
    rows = [[0.0, 89.2, 0.0, 90.0], [-90.0, 0.0, -425.0, 0.0]]
    path = tmp_path / "t.csv"
    path.write_text("theta,d,a,alpha,type\n" + "".join(f"{','.join(map(str, r))},p\n" for r in rows))
    table = read_joint_table(path)
    keys = ("theta_offset", "d", "a", "alpha")
    joints = [{"joint_id": "a1", "joint_type": "prismatic", **dict(zip(keys, r, strict=True))} for r in rows]
    (tmp_path / "t.json").write_text(json.dumps({"order": ["a1"], "joints": joints}, indent=2))
    listed = dict(zip(keys, zip(*rows, strict=True), strict=True)) | {"type": ["p", "p"]}
    (tmp_path / "lists.json").write_text(json.dumps(listed))
    lines = ("".join(f"    {key}: {v} # d: 5\n" for key, v in reversed(joint.items())) for joint in joints)
    (tmp_path / "t.yaml").write_text("# DH\ndh_parameters:\n" + "".join(f"  joint:\n{own}" for own in lines))
    cells = [["my arm"], ["theta", "d", "a", "alpha", "type"], *([*r, "p"] for r in rows)]
    (tmp_path / "t.xlsx").write_bytes(workbook({"DH": cells}))
    links = [f"offset={q}, d={d}, a={a}, alpha={t}, sigma=1" for q, d, a, t in rows]
    keyed = ["'" + link.replace(", ", ", '").replace("=", "', ") for link in links]
    (tmp_path / "t.m").write_text("".join(f"L = Link({link});\n" for link in keyed))
    (tmp_path / "t.py").write_text("dh = [" + "".join(f"dict({link}),\n" for link in links) + "]")
    (tmp_path / "across.csv").write_text(
        ",J1,J2\n转角theta,0,-90\nd_mm,89.2,0\na,0,-425\nalpha,90,0\njoint_type,1,1\n"
    )
    assert read_joint_table(tmp_path / "across.csv") == table._replace(lengths=("mm",))
    for name in ("t.json", "lists.json", "t.yaml", "t.xlsx", "t.m", "t.py"):
        assert read_joint_table(tmp_path / name) == table, name
    del joints[1]["a"]
    (tmp_path / "t.json").write_text(json.dumps([*joints, {"coupling": {"type": "none"}}]))
    with refuses(FileError, "2 of d", "1 of a"):
        read_joint_table(tmp_path / "t.json")
    path.write_text("theta,d,a,alpha,type,max theta,delta_d\n0,89.2,0,90,p,3,1\n-90,0,-425,0,p,3,1\n")
    assert read_joint_table(path) == table
    path.write_text("theta,offset,d,a,alpha\nq1,5,0,1,0\n5,6,0,1,0\n")
    with refuses(FileError, "line 3", "theta is 5 and 6"):
        read_joint_table(path)
    (tmp_path / "a.yaml").write_text("joint_1: [0, 0.05, 0.5, 0]\n")
    refused(["a.yaml", "theta, d, a, alpha"], "new", tmp_path / "a.yaml", "--out", tmp_path / "o.toml")


def test_tables_without_names_or_with_some_constants_left_out_are_told_by_poses(tmp_path):
    """Rows of four numbers in any order; `Link`, whose theta or zeros are left out; all of one arm."""
    arm = [(0.4, 0.025, -1, 0), (0, 0.455, 0, -1), (0, 0.035, -1, 0), (0.42, 0, 1, 0), (0, 0, -1, 0)]
    arm += [(0.08, 0, 0, 0)]  # d, a [m], alpha, theta in quarter turns
    files = {
        "t.py": [
            f"RevoluteDH(d={d}, {f'a={a}, ' * bool(a)}alpha={s} * np.pi / 2, offset={z}*pi/2),  # a=1"
            for d, a, s, z in arm
        ],
        "t.m": [f"L1 = Link([0 {d} {a} {s}*pi/2 0 {z}*pi/2]);" for d, a, s, z in arm],
        "t.yaml": ["dh:", *(f"  - [{a}, {s * 90}, {d}, {z * 90}]" for d, a, s, z in arm)],
        "t.txt": [f"{k} {d} {a} {s * 1.5708} {z * 1.5708}" for k, (d, a, s, z) in enumerate(arm, 1)],
        "t.csv": ["d,a,alpha", *(f"{d},{a},{s * 90}" for d, a, s, _ in arm)],
    }
    rows = np.array([(z * np.pi / 2, d, a, s * np.pi / 2) for d, a, s, z in arm])
    q = np.random.default_rng(5).uniform(-1.5, 1.5, (4, 6))
    for name, lines in files.items():
        (path := tmp_path / name).write_text("\n".join([*lines, ""]))
        poses = frames(rows, q)[-1]
        table = read_joint_table(path)
        found = find_convention(table_readings(**table._asdict()), exactly(q, poses))
        np.testing.assert_allclose(tool_poses(found.robot.bare, Motion(q)), poses, atol=1e-4, err_msg=name)
        assert name == "t.py" or ("columns" in found.assumptions[0]) == (name in ("t.yaml", "t.txt"))
        assert (found.changes == ("joint 2 = q2 - 90°",)) == (name == "t.csv")


def test_lengths_along_nearly_parallel_axes_that_cancel_are_metres():
    """As in UR's calibrated tables: d2 = 439 m, d3 = -446 m; its scale is still that of the arm."""
    d, a = (0.1805, 439.141, -446.027, 7.0603, 0.1198, 0.1157), (0.0, 0.0193, -0.5693, 0.0, 0.0, 0.0)
    alpha, theta = (1.57015, 0.001394, 0.006938, 1.56998, -1.57039, 0.0), (0.0, 1.6023, -1.6861, 0.0837, 0, 0)
    rows = np.column_stack([theta, d, a, alpha])
    q = np.random.default_rng(5).uniform(-1.5, 1.5, (12, 6))
    readings = table_readings([dict(zip(CONSTANTS, row, strict=False)) for row in rows.tolist()])
    found = find_convention(readings, exactly(q, frames(rows, q)[-1]))
    assert found.assumptions == ("standard DH", "lengths in m", "angles in rad", *found.assumptions[3:])
    assert 0.5 < found.robot.reach < 2.0


FANUC = [
    *((0, 0, 55, -90), (-90, 0, 345, 180), (0, 0, 30, -90)),
    *((0, -360, 0, 90), (0, 0, 0, -90), (0, -85, 0, 180)),
]


def test_a_table_on_the_page_says_its_convention_or_gives_poses():
    table = "\n".join(["theta,d,a,alpha", *(",".join(map(str, row)) for row in FANUC)]).encode()
    assert holds_robot("own.csv", table)
    assert not holds_robot("rows.csv", b"q1[deg],d[mm],x[mm],alpha[deg]\n")
    with refuses(OptionError, "standard DH", "modified DH (Craig)", "give poses"):
        LoadModel("own.csv", table).model()
    found = LoadModel("own.csv", b"# convention = dh\n" + table).model()
    assert (found.dof, found.convention) == (6, "dh")


@pytest.mark.parametrize("signs", [(1.0,) * 6, (1, -1, 1, -1, 1, -1)])
def test_a_third_axis_that_counts_from_the_horizontal_is_in_the_robots_file(told, refused, tmp_path, signs):
    """joint 3 = q3 + q2, by the FK of the file alone; three poses are enough, and `extract` finds it, too."""
    table = tmp_path / "table.csv"
    lines = [",".join(map(str, row)) for row in FANUC]
    table.write_text("\n".join(["theta[deg],d[mm],a[mm],alpha[deg]", *lines]))
    rows = np.array(FANUC) * [np.pi / 180, 1e-3, 1e-3, np.pi / 180]
    q = np.random.default_rng(2).uniform(-1.5, 1.5, (24, 6))
    joints = q * signs
    joints[:, 2] += joints[:, 1]
    poses = frames(rows, joints)[-1]
    turned = np.rad2deg(se3.matrix_to_rpy(poses[:, :3, :3]))
    numbers = np.column_stack([np.rad2deg(q), 1e3 * poses[:, :3, 3], turned])
    shown = [",".join(f"{v:.4f}" for v in row) for row in numbers]
    cells = [line.split(",") for line in shown[:3]]
    options = [v for c in cells for v in ("--pose", f"{','.join(c[:6])} = {','.join(c[6:])}")]
    out = tmp_path / "a.toml"
    found, message = told("new", table, "--out", out, *options)
    assert mentions(message, "joint 3", "standard DH")
    assert found["position_m"] < 1e-3
    refused(["--pose"], "new", table, "--out", out, status=64)
    refused(["6 joint positions"], "new", table, "--out", out, "--pose", "1,2 = 3", status=64)
    saved = load_robot(tmp_path / "a.toml")
    np.testing.assert_allclose(tool_poses(saved, Motion(q)), poses, atol=2e-5)
    facts = tomllib.loads((tmp_path / "a.toml").read_text())["joint"][2]
    assert (facts["follows"], abs(facts["ratio"])) == (2, 1.0)

    heads = "j1,j2,j3,j4,j5,j6,x_mm,y_mm,z_mm,rx_deg,ry_deg,rz_deg"
    (tmp_path / "shown.csv").write_text("\n".join([heads, *shown]))
    told("new", table, "--poses", tmp_path / "shown.csv", "--out", out)
    found = wb.extract(Robot.from_dh(rows, name="arm"), tmp_path / "shown.csv")
    assert found.verdict == "nominal"
    np.testing.assert_allclose(found.robot.predict(q), poses, atol=2e-5)


WRIST = [
    *((0, 487, 0, 0), (-90, 0, 85, -90), (0, 0, 640, 0)),
    *((0, 720, 205, -90), (0, 0, 0, 90), (180, 75, 0, -90)),
]
"""theta [deg], d [mm], a [mm], alpha [deg] in modified DH."""
BASE = placed([3.2, 1.9, 0.5], [0.4, -0.3, 2.5])


def write_measured(path, convention: str, table: list, q: np.ndarray, seen: str, *, joints=None, tool=TOOL):
    """What an instrument sees of an arm 2 mm off its table, in mm and deg, mostly without units; its joints
    are at `joints`, else at q, which its file shows."""
    rng, many = np.random.default_rng(3), seen == "markers"
    rows = np.column_stack([np.array(table) * [np.pi / 180, 1e-3, 1e-3, np.pi / 180], np.zeros(6)])
    rows[:, :4] += rng.uniform(-1.0, 1.0, (6, 4)) * [1e-3, 2e-3, 2e-3, 1e-3]
    at = VirtualArm(convention, rows, base=BASE, tool=tool).pose(q if joints is None else joints)
    corners = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.02]])[: 3 if many else 1]
    points = 1e3 * (np.einsum("rij,mj->rmi", at[:, :3, :3], corners) + at[:, None, :3, 3])
    points[100:101] += 300.0  # one of many was mistaken
    heads = [f"m{m}{axis}[mm]" for m in (1, 2, 3) for axis in "xyz"] if many else ["X", "Y", "Z"]
    heads, cells = [*(f"J{k}" for k in range(1, 7)), *heads], [np.rad2deg(q), points.reshape(len(q), -1)]
    if seen == "poses":
        heads += ["RX", "RY", "RZ"]
        cells.append(Rotation.from_matrix(at[:, :3, :3]).as_euler("xyz", degrees=True))
    np.savetxt(path, np.column_stack(cells), "%.4f", ",", header=",".join(heads), comments="")


def write_table(path, table: list, length: float = 1.0):
    """alpha, a, D, Theta in this order, without units."""
    rows = "".join(f"{alpha},{a * length},{d * length},{theta}\n" for theta, d, a, alpha in table)
    path.write_text(f"alpha, a, D, Theta\n{rows}")


@pytest.mark.parametrize(
    ("convention", "table", "length", "seen", "inverted"),
    [
        ("craig", WRIST, 1.0, "poses", ()),
        ("craig", WRIST, 1e-3, "points", (3,)),
        ("dh", FANUC, 1.0, "markers", (1, 4)),
        ("dh", FANUC, 1e-3, "points", ()),
    ],
)
def test_a_table_is_read_by_what_a_tracker_saw(told, tmp_path, convention, table, length, seen, inverted):
    """With several markers, six rows are enough."""
    number, turns = 6 if seen == "markers" else 200, np.ones(6)
    q = np.random.default_rng(5).uniform(-1.5, 1.5, (number, 6))
    turns[[*inverted]] = -1.0
    path, rows, out = (tmp_path / name for name in ("dh.csv", "m.csv", "r.toml"))
    write_table(path, table, length)
    write_measured(rows, convention, table, q, seen, joints=q * turns)
    found, message = told("new", path, "--poses", rows, "--out", out)
    kind = "modified DH" if convention == "craig" else "standard DH"
    words = kind, f"{number} rows", "rows 100 (rows count from 0) don't count"
    assert mentions(message, *words[: 2 + (number > 100)])
    changes = [change for change in found["changes"] if change.startswith("joint ")]
    assert changes == [f"joint {k + 1} = -q{k + 1}" for k in inverted]
    assert 1e-4 < found["position_m"] < 8e-3
    constants = np.array(table) * [np.pi / 180, 1e-3, 1e-3, np.pi / 180]
    true = VirtualArm(convention, np.column_stack([constants, np.zeros(6)])).pose(q * turns)
    moved = tool_poses(load_robot(out).bare, Motion(q))
    np.testing.assert_allclose(se3.inverse(moved[:1]) @ moved, se3.inverse(true[:1]) @ true, atol=1e-6)
    if seen == "points" and not inverted:  # pasted into the page's field for poses
        own = LoadModel("dh.csv", path.read_bytes(), tuple(rows.read_text().splitlines())).model()
        np.testing.assert_allclose(tool_poses(own.bare, Motion(q)), moved, atol=1e-9)


@pytest.mark.parametrize(
    ("actual", "moving", "facts"),
    [
        (WRIST, [1.0] * 6, ("none", "base and tool")),
        (FANUC, [1.0, 0, 0, 0, 0, 1.0], ("joint 2, 3, 4, 5",)),
        (FANUC, [1.0, 0, 0, 0, 0, 0], ("standard", "modified")),
    ],
)
def test_rows_of_another_arm_or_that_tell_no_convention_are_refused(refused, tmp_path, actual, moving, facts):
    write_table(tmp_path / "dh.csv", FANUC)
    q = np.random.default_rng(5).uniform(-1.5, 1.5, (60, 6)) * moving
    write_measured(tmp_path / "m.csv", "dh", actual, q, "points")
    refused(facts, "new", tmp_path / "dh.csv", "--poses", tmp_path / "m.csv", "--out", tmp_path / "r.toml")


def test_of_two_ways_to_count_that_fit_alike_none_is_written_without_force(run, tmp_path):
    """A point near the last axis shows no direction of the last joint."""
    write_table(tmp_path / "dh.csv", FANUC)
    q, out = np.random.default_rng(5).uniform(-1.5, 1.5, (30, 6)), tmp_path / "r.toml"
    q[:, 5] *= 0.2
    write_measured(tmp_path / "m.csv", "dh", FANUC, q, "points", tool=placed([0.001, 0.0, 0.1], [0.0] * 3))
    call = ("new", tmp_path / "dh.csv", "--poses", tmp_path / "m.csv", "--out", out)
    for options in ((), ("--force",)):
        status, _, said = run(*call, *options)
        assert (status, out.exists()) == (2, bool(options))
        assert mentions(said, "as given", "joint 6 = -q6", "--force")


@pytest.mark.parametrize("verb", ["identify", "evaluate", "diagnose"])
def test_a_table_in_place_of_a_robot_ends_with_the_command_for_it(refused, tmp_path, monkeypatch, verb):
    monkeypatch.chdir(tmp_path)
    write_table(tmp_path / "dh.csv", FANUC)
    refused(["workbench new dh.csv --poses m.csv --out dh.toml"], verb, "m.csv", "--robot", "dh.csv")
