"""A user with nothing but the pendant: the controller's model, or the reason why there is none."""

import json
from itertools import count
from pathlib import Path

import numpy as np
import pytest
from displays import STYLES, TOOL, hidden, lines, model_error, poses, random_joints
from refusals import mentions
from round_trip import write_table
from scipy.spatial.transform import Rotation
from slow import slow

import workbench as wb
from workbench.arm.effects import JointCompliance
from workbench.extras.pendant.displayed import read_display
from workbench.extras.pendant.extract import ModelVerdict


def write(rows, path: str = "read.csv", head: str = "") -> Path:
    return write_table(path, head, rows)


def form(arm: str, actual: Path, number: int = 30, **display) -> Path:
    """Joints in whole degrees, with what the display shows there."""
    q = np.deg2rad(np.rad2deg(random_joints(arm, number)).round())
    return write(lines(actual, q, **display), "form.csv")


def test_thirty_poses_from_the_pendant_give_the_model_of_my_ur5e(run, told, tmp_path):
    actual = hidden("ur5e", tmp_path / "hidden.toml")
    form("ur5e", actual)
    found, out = told("extract", "form.csv", "--robot", "ur5e", "--save", "mine.toml")
    assert (found["verdict"], found["reading_margin"] > 10.0) == ("extracted", True)
    assert (found["message"] in " ".join(out.split()), "user frame" in out) == (True, False)
    off = model_error(Path("mine.toml"), actual, random_joints("ur5e", 200))
    assert off.mean() < 3e-5
    assert 0.3 < off.mean() / found["expected"]["position_m"] < 3.0
    nominal = hidden("ur5e", tmp_path / "nominal.toml", length=0, angle=0)
    assert model_error(nominal, actual, random_joints("ur5e", 200)).mean() > 1e-3
    run("export", "mine.toml", "--for", "ur-kinematics", "--out", "ur.yaml")
    assert Path("ur.yaml").stat().st_size > 500


def test_a_table_with_a_wrong_length_is_put_right(run, tmp_path):
    """The convention, Euler angles named rx, ry, rz, isn't open where the arm is 30 mm off its table."""
    actual = wb.load_robot(hidden("ur5e", tmp_path / "hidden.toml"))
    longer = {"joint3.a": float(actual.values("joint3.a")[0]) + 0.03}
    actual.with_values(longer).save(tmp_path / "hidden.toml")
    write(
        lines(tmp_path / "hidden.toml", random_joints("ur5e", 30), style="x y z"),
        head="Base (°),Shoulder (°),Elbow (°),Wrist 1 (°),Wrist 2 (°),Wrist 3 (°),x[mm],y[mm],z[mm],rx,ry,rz",
    )
    found = wb.extract("ur5e", Path("read.csv"))
    assert found.verdict is ModelVerdict.EXTRACTED
    found.robot.save("mine.toml")
    off = model_error(Path("mine.toml"), tmp_path / "hidden.toml", random_joints("ur5e", 100))
    assert off.mean() < 1e-4


def test_readings_of_the_sister_arm_set_no_frames(run, tmp_path):
    """A UR10's larger shoulder height would pass for a user frame, its longer flange for a tool."""
    actual = hidden("ur10e", tmp_path / "hidden.toml", length=3e-4, angle=3e-4)
    head = ",".join([*(f"q{k}[deg]" for k in range(1, 7)), "x[mm],y[mm],z[mm],rx[rad],ry[rad],rz[rad]"])
    write(lines(actual, 0.3 * random_joints("ur10", 30)), "form.csv", head)
    for how, status in ("auto", 1), ("given", 2):
        asked = ("--robot", "ur10", "--save", "mine.toml", "--reading", how)
        done, out, err = run("extract", "form.csv", *asked)
        assert (done, mentions(err, "ur10e"), Path("mine.toml").exists()) == (status, True, False)
        assert not mentions(out, "is set")


def test_zeros_that_a_program_wrote_behind_are_no_digits(run, tmp_path):
    rows = lines(hidden("ur5e", tmp_path / "hidden.toml"), random_joints("ur5e", 30))
    write([f"{float(cell):.5f}" for cell in row] for row in rows)
    assert wb.extract("ur5e", "read.csv").verdict is ModelVerdict.EXTRACTED


@pytest.mark.parametrize(
    ("arm", "style"), [*(slow("iiwa7", s) for s in STYLES), ("so101", "x y z"), ("so101", "x, y, z, w")]
)
def test_the_display_is_understood_with_and_without_a_tool(run, tmp_path, arm, style):
    actual = hidden(arm, tmp_path / "hidden.toml")
    tool = TOOL if style == "z y' x''" else None
    form(arm, actual, style=style, tool=tool)
    found = wb.extract(arm, "form.csv")
    assert style in found.meaning.orientation
    assert bool(found.run.frames.tool) == (tool is not None)
    found.robot.save(tmp_path / "mine.toml")
    assert model_error(tmp_path / "mine.toml", actual, random_joints(arm, 200), tool).mean() < 3e-5


def test_a_nominal_controller_is_said_to_be_one(run, tmp_path):
    actual = hidden("ur5e", tmp_path / "hidden.toml", length=0.0, angle=0.0)
    form("ur5e", actual, 15)
    status, out, _ = run("extract", "form.csv", "--robot", "ur5e", "--save", "mine.toml")
    assert (status, "your controller is nominal" in out) == (0, True)
    assert model_error(Path("mine.toml"), actual, random_joints("ur5e", 50)).max() < 1e-6


@pytest.mark.parametrize(
    ("length", "angle", "verdict"), [(0.0, 0.0, ModelVerdict.NOMINAL), (1e-3, 2e-3, ModelVerdict.EXTRACTED)]
)
def test_a_log_with_all_digits_may_scatter_by_micrometres(tmp_path, length, angle, verdict):
    """Joints and pose of one row were read up to 20 µm apart: no sag is looked for in that."""
    q, rng = random_joints("ur5e", 30), np.random.default_rng(5)
    shown = poses(hidden("ur5e", tmp_path / "hidden.toml", length=length, angle=angle), q)
    turned = Rotation.from_matrix(shown[:, :3, :3]) * Rotation.from_rotvec(2e-5 * rng.normal(size=(30, 3)))
    rows = wb.Dataset(q, shown[:, :3, 3] + 1e-5 * rng.normal(size=(30, 3)), turned.as_matrix())
    assert wb.extract(wb.load_robot("ur5e"), rows).verdict is verdict


@pytest.mark.slow
def test_a_controller_that_compensates_sag_is_sent_to_diagnose(run, tmp_path):
    sag = JointCompliance((1, 2), (2e-5, 2e-5))
    actual = hidden("ur5e", tmp_path / "hidden.toml", effects=(sag,))
    form("ur5e", actual, 40)
    asked = ("--robot", "ur5e", "--rows", "rows.csv", "--save", "mine.toml")
    status, _, err = run("extract", "form.csv", *asked)
    assert (status, "sag" in err, Path("mine.toml").exists()) == (2, True, False)
    assert run("diagnose", "rows.csv", "--robot", "ur5e", "--held-out", 0, "--save", "mine.toml")[0] == 0
    assert model_error(Path("mine.toml"), actual, random_joints("ur5e", 200)).mean() < 1e-4


def test_readings_of_another_arm_name_it(run, tmp_path):
    write(lines(hidden("ur10", tmp_path / "hidden.toml"), random_joints("ur10", 30)))
    status, _, err = run("extract", "read.csv", "--robot", "ur5e", "--save", "mine.toml")
    assert (status, Path("mine.toml").exists()) == (1, False)
    assert mentions(err, "don't belong to UR5e; UR10", "choose the robot 'ur10'")
    assert not any(word in err for word in ("--force", "--reading", "labelled"))
    assert run("extract", "read.csv", "--robot", "iiwa7")[0] == 1


def test_a_mistyped_reading_is_named_and_left_out(told, tmp_path):
    actual = hidden("ur5e", tmp_path / "hidden.toml")
    rows = lines(actual, np.round(random_joints("ur5e", 35), 1))
    rows[11][6] = f"{float(rows[11][6]) + 30.0:.1f}"
    found, out = told("extract", write(rows), "--robot", "ur5e", "--save", "mine.toml")
    assert found["outliers"] == [11]
    assert mentions(out, "reading 12")
    assert model_error(Path("mine.toml"), actual, random_joints("ur5e", 200)).mean() < 1e-4


SHORT, UNITS = "A1,A2,A3,A4,A5,A6,X,Y,Z,RX,RY,RZ", "°,°,°,°,°,°,mm,mm,mm,°,°,°"
BEFORE, BEHIND = (",".join(map(name.format, range(1, 7))) for name in ("q{} [deg]", "J{}"))
KUKA = ";".join(
    [
        *(f"AxisPos_Act{k}[°]" for k in range(1, 7)),
        *(f"{a}_Act[mm]" for a in "XYZ"),
        "A_Act[°];B_Act[°];C_Act[°]",
    ]
)
NUMBERS = count(1)


@pytest.mark.parametrize(
    ("head", "change"),
    [
        ("J1;J2;J3;J4;J5;J6;X;Y;Z;A;B;C", lambda row: ";".join(row).replace(".", ",")),
        (f"X[mm],Y[mm],Z[mm],RX,RY,RZ,{BEHIND}", lambda row: ",".join(row[6:] + row[:6]) + "\n" + 11 * ","),
        (f"No,{BEFORE},tcp_x,tcp_y,TCP Z,r,p,y2,note", lambda row: ",".join(["1", *row, "ok"])),
        (KUKA, lambda row: ";".join(row)),
        (SHORT, lambda row: ",".join([*row[:6], *(f"{float(v) / 25.4:.2f}" for v in row[6:9]), *row[9:]])),
        (f"image,{SHORT}", lambda row: ",".join(["images/01.png", *row])),
        (f"Nr.,Gelenke,,,,,,TCP,,,,,\n,{SHORT}\n,{UNITS}", lambda row: ",".join(["1", *row])),
        ("", lambda row: f"{next(NUMBERS)} {' '.join(row)}"),
    ],
)
def test_tables_as_people_write_them(tmp_path, head, change):
    actual = hidden("ur5e", tmp_path / "hidden.toml")
    rows = lines(actual, np.round(random_joints("ur5e", 20), 2), style="z y' x''")
    path = tmp_path / "read.csv"
    path.write_text("\n".join([head, *map(change, rows)]))
    found = wb.extract("ur5e", path)
    assert ("z y' x''" in found.meaning.orientation, found.verdict) == (True, ModelVerdict.EXTRACTED)


def test_a_sliding_joint_is_read_by_its_unit_where_positions_have_none(tmp_path):
    rows = [[0.0, 0.3, 0.2, 0.0], {"theta": 0.0, "d": 0.0, "a": 0.0, "alpha": 0.0, "type": "prismatic"}]
    numbers = [["30.0", "250.0", "173.2", "100.0", "550", "30", "0", "0"]] * 2
    path = write(numbers, str(tmp_path / "read.csv"), "q1[deg],q2[mm],x,y,z,A[deg],B[deg],C[deg]")
    shown = read_display(path, wb.Robot.from_dh(rows, name="two"))
    assert shown.data.q[0] == pytest.approx([np.radians(30.0), 0.25])
    assert shown.steps[0][0] == pytest.approx([np.radians(0.1), 1e-4])


def test_poses_may_be_typed_and_metres_and_radians_are_found(run, tmp_path):
    q = random_joints("ur5e", 12)
    at = poses(hidden("ur5e", tmp_path / "hidden.toml"), q)
    parts = zip(q, at[:, :3, 3], Rotation.from_matrix(at[:, :3, :3]).as_rotvec(), strict=True)
    rows = [[",".join(f"{v:.5f}" for v in part) for part in (j, (*p, *t))] for j, p, t in parts]
    found = wb.extract("ur5e", [" = ".join(row) for row in rows])
    assert found.meaning[:3] == ("rad", "m", "rad")
    head = HEADS.replace("mm", "m").replace("a,b,c", "rx[rad],ry[rad],rz[rad]")
    assert wb.extract("ur5e", wb.read_measurements(write(rows, head=head))).left == pytest.approx(found.left)


def test_a_log_of_rtde_replaces_the_form(run, tmp_path):
    actual, q = hidden("ur5e", tmp_path / "hidden.toml"), np.repeat(random_joints("ur5e", 30), 50, axis=0)
    names = [f"{part}_{k}" for part in ("actual_q", "actual_TCP_pose") for k in range(6)]
    at = poses(actual, q, TOOL)
    numbers = np.column_stack([q, at[:, :3, 3], Rotation.from_matrix(at[:, :3, :3]).as_rotvec()])
    rows = [" ".join(f"{v:.7g}" for v in (0.002 * k, *row)) for k, row in enumerate(numbers)]
    Path("log.csv").write_text("\n".join([" ".join(["timestamp", *names]), *rows]))
    assert run("extract", "log.csv", "--robot", "ur5e", "--save", "mine.toml")[0] == 0
    assert model_error(Path("mine.toml"), actual, random_joints("ur5e", 50), TOOL).max() < 1e-5


@pytest.mark.parametrize("form", ["csv", "json"])
def test_a_log_of_libfranka_replaces_the_form(run, tmp_path, form):
    """`O_T_EE` is a matrix column by column, as a list or in numbered columns."""
    actual, q = hidden("panda", tmp_path / "hidden.toml"), random_joints("panda", 30)
    flat = poses(actual, q).swapaxes(1, 2).reshape(30, 16).tolist()
    states = [json.dumps({"q": j, "O_T_EE": m}) for j, m in zip(q.tolist(), flat, strict=True)]
    names = [*(f"q_{k}" for k in range(7)), *(f"O_T_EE_{k}" for k in range(16))]
    rows = (",".join(map(repr, [*j, *m])) for j, m in zip(q.tolist(), flat, strict=True))
    text = f"[{','.join(states)}]" if form == "json" else "\n".join([",".join(names), *rows])
    Path(f"log.{form}").write_text(text)
    assert run("extract", f"log.{form}", "--robot", "panda", "--save", "mine.toml")[0] == 0
    assert model_error(Path("mine.toml"), actual, random_joints("panda", 50)).max() < 1e-7


HEADS = "q1[rad],q2[rad],q3[rad],q4[rad],q5[rad],q6[rad],x[mm],y[mm],z[mm],a,b,c"


def turned(*moves):
    """Poses between which the tool turns about one axis alone."""
    q = np.tile(np.deg2rad([0, -90, 90, -90, -60, 0]), (12, 1))
    q[:, moves] = random_joints("ur5e", 12)[:, moves]
    return q


@pytest.mark.parametrize("head", ["A,B,C", "roll,pitch,yaw"])
def test_headings_name_the_convention_where_the_tool_turns_about_one_axis(run, tmp_path, head):
    style = "x y z" if head[0] == "r" else "z y' x''"
    rows = lines(hidden("ur5e", tmp_path / "hidden.toml"), turned(0), style=style)
    found = wb.extract("ur5e", write(rows, head=f"q1,q2,q3,q4,q5,q6,x,y,z,{head}"))
    assert style in found.meaning.orientation


def test_a_log_of_a_moving_arm_counts_where_it_stood(run, tmp_path):
    """The pose is a thousandth of a move older than the joints."""
    actual, marks = hidden("ur5e", tmp_path / "hidden.toml"), random_joints("ur5e", 30)
    at = np.concatenate([np.r_[k, k, k + 0.1 : k + 1.0 : 0.1] for k in range(29)])
    q = np.stack([np.interp([at, at - 1e-3 * (at % 1 > 0)], np.arange(30), j) for j in marks.T], 2)
    now, late = (lines(actual, each) for each in q)
    rows = [[*own[:6], *pose[6:]] for own, pose in zip(now, late, strict=True)]
    status, out, _ = run("extract", write(rows), "--robot", "ur5e", "--save", "mine.toml")
    assert (status, out.count("left out")) == (0, 1)
    assert model_error(Path("mine.toml"), actual, random_joints("ur5e", 100)).mean() < 1e-4


def test_joints_of_another_table_and_a_reading_that_is_accepted(run, tmp_path):
    rows = lines(hidden("ur5e", tmp_path / "hidden.toml"), random_joints("ur5e", 20))
    write([row[:6] for row in rows], "joints.csv", "q1,q2,q3,q4,q5,q6")
    write([row[6:] for row in rows], "poses.csv", "x[mm],y[mm],z[mm],rx[rad],ry[rad],rz[rad]")
    assert run("extract", "poses.csv", "--joints", "joints.csv", "--robot", "ur5e")[0] == 0
    wrong = write(rows, head=HEADS)
    assert run("extract", wrong, "--robot", "ur5e", "--reading", "found")[0] == 0


@pytest.mark.parametrize(
    ("rows", "text"),
    [
        (lambda rows: rows[:3], "3 poses"),
        (lambda rows: lines(Path("hidden.toml"), turned(0), style="z y' x''"), "all axes"),
        (lambda rows: [row[:9] for row in rows], "columns"),
        (lambda rows: [[*row[:7], "O.1", *row[8:]] for row in rows], "is not a number"),
        (lambda rows: [[*row[:9], *row[6:9]] for row in rows], "the orientations in another frame"),
        (lambda rows: [HEADS.split(","), *rows], "degrees labelled rad"),
    ],
)
def test_bad_readings_are_refused_in_one_sentence(run, tmp_path, rows, text):
    good = lines(hidden("ur5e", tmp_path / "hidden.toml"), random_joints("ur5e", 20))
    status, _, err = run("extract", write(rows(good)), "--robot", "ur5e")
    assert (status, len(err.strip().splitlines())) == (1, 1)
    assert text in err


@pytest.mark.parametrize(("number", "still", "digits"), [(6, 5, 8), (20, 6, 0)])
def test_poses_that_leave_the_model_uncertain_save_nothing(run, tmp_path, number, still, digits):
    """A joint that stays, and joints shown in whole degrees."""
    q = np.where(np.arange(6) < still, random_joints("ur5e", number), 0.3)
    rows = lines(hidden("ur5e", tmp_path / "hidden.toml"), q)
    rows = [[*(f"{float(cell):.{digits}f}" for cell in row[:6]), *row[6:]] for row in rows]
    status, _, err = run("extract", write(rows), "--robot", "ur5e", "--save", "mine.toml")
    assert (status, Path("mine.toml").exists()) == (2, False)
    assert mentions(err, f"{number} readings")


@pytest.mark.parametrize(("seeds", "least"), [(range(2), 2), slow(range(2, 12), 9)])
def test_six_readings_say_how_far_to_trust_them(tmp_path, seeds, least):
    """36 numbers for 26 constants and more: within twice the expected error, whatever the arm."""
    within = []
    for seed in seeds:
        actual = hidden("ur5e", tmp_path / "hidden.toml", seed=seed)
        q = np.deg2rad(np.rad2deg(random_joints("ur5e", 6, seed=300 + seed)).round())
        found = wb.extract("ur5e", write(lines(actual, q), str(tmp_path / "read.csv")))
        assert found.verdict != ModelVerdict.MORE
        found.robot.save(tmp_path / "mine.toml")
        off = model_error(tmp_path / "mine.toml", actual, random_joints("ur5e", 200, seed=900 + seed)).mean()
        within.append(off < 2.0 * found.expected.position)
    assert sum(within) >= least


def test_six_readings_that_agree_within_their_digits_accuse_none():
    """One of them stood 0.5 mm off the other five, whose model leaves 0.01 mm."""
    numbers = """97.86 -47.13 3.86 -68.73 -127.79 -38.76 = 235.83 -956.64 979.1 0.803 -2.267 0.229
        -29.37 -143.26 -113.76 160.16 43.65 -88.23 = 317.44 -475.08 85.27 -0.144 -1.076 2.422
        -20.87 -26.17 100.26 110.45 -30.82 -2.32 = -822.83 20.41 14.81 -0.861 -1.72 1.671
        56.69 -141.3 14.02 -73.33 108.76 -144.82 = 645.42 734.42 1092.35 -1.096 -2.084 -1.613
        57.49 -39.29 -68.74 126.88 106.63 -160.00 = -77.88 -384.09 962.22 -1.219 -1.935 1.58
        66.58 -148.82 0.85 -20.32 -85.01 -58.17 = 514.04 723.61 895.57 0.656 -1.862 1.271"""
    assert not wb.extract("ur10e", numbers.splitlines()).run.outliers
