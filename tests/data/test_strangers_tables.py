"""Tables as strangers have them: reflectors in rows, reports, lists of measuring machines, programs."""

import re

import numpy as np
import pytest
from refusals import refuses

from workbench.arm.robot_toml import robot_from_rows
from workbench.base.errors import DataError, FileError, WorkbenchError
from workbench.data.readers import read_measurements
from workbench.data.readers.column_meanings import unread_text
from workbench.data.readers.headings import meaning, number_in
from workbench.data.readers.read import read_fields

SPOTS, H = ("A", "B", "C"), np.pi / 2


def long_table(path, *, postures=6, drop=(), names=SPOTS):
    """Rows of every posture, one a reflector, but for those that are dropped."""
    q = np.random.default_rng(1).uniform(-1, 1, (postures, 3))
    rows = ["q1[rad],q2[rad],q3[rad],point,x[mm],y[mm],z[mm]"]
    for k in range(postures):
        for m, name in enumerate(names):
            if (k, m) not in drop:
                rows.append(",".join([*map(repr, q[k].tolist()), name, f"{100 * k + 9 * m}", f"{m}", "7"]))
    path.write_text("\n".join(rows))
    return q


@pytest.mark.parametrize("form", ["point", "merged", "by reflector"])
def test_reflectors_in_rows_are_markers_of_one_tool(tmp_path, form):
    q = long_table(tmp_path / "t.csv", drop={(2, 1)})
    head, *rows = (tmp_path / "t.csv").read_text().split("\n")
    if form == "merged":  # joints in the first row of a posture alone
        rows = [row if ",A," in row else ",,," + row.split(",", 3)[3] for row in rows]
    rows = sorted(rows, key=lambda row: row.split(",")[3]) if form == "by reflector" else rows
    (tmp_path / "t.csv").write_text("\n".join([head, *rows]))
    data = read_measurements(tmp_path / "t.csv")
    assert data.q == pytest.approx(q)
    assert (data.position, data.markers.shape) == (None, (6, 3, 3))
    assert data.markers[4, 2] == pytest.approx([0.418, 0.002, 0.007])
    assert np.argwhere(np.isnan(data.markers).all(2)).tolist() == [[2, 1]]
    assert any("markers of one tool" in note for note in data.notes)


def test_rows_that_are_excluded_are_markers_that_were_not_seen(tmp_path):
    long_table(tmp_path / "t.csv")
    head, *rows = (tmp_path / "t.csv").read_text().split("\n")
    marked = [f"{row},{'true' if k == 4 else ''}" for k, row in enumerate(rows)]
    (tmp_path / "t.csv").write_text("\n".join([f"{head},exclude", *marked]))
    data = read_measurements(tmp_path / "t.csv")
    assert np.argwhere(np.isnan(data.markers).all(2)).tolist() == [[1, 1]]
    assert data.included.all()


def test_sockets_and_repeats_stay_rows(tmp_path):
    long_table(tmp_path / "one.csv", names=("A",))
    assert len(read_measurements(tmp_path / "one.csv")) == 6
    drop = {(k, m) for k in range(6) for m in range(3) if m != k % 3}  # each posture at one of three sockets
    long_table(tmp_path / "sockets.csv", drop=drop)
    assert read_measurements(tmp_path / "sockets.csv").markers is None


REPORT = """Accuracy run
Arm,desk arm
Targets,3

TARGETS
Index,X,Y,Z
0,0.2,0.0,0.3
1,0.2,0.1,0.3

MEASUREMENTS
Number,Target,Joint 1[rad],Joint 2[rad],Actual X[m],Actual Y[m],Actual Z[m]
0,0,0.2929,0.2023,0.12981,0.11636,0.29711
1,1,0.7850,0.1551,0.27621,0.25728,0.23957
"""


def test_of_a_report_the_table_with_joints_is_read_and_of_several_the_lines_named(tmp_path):
    (tmp_path / "run.csv").write_text(REPORT + "\nSUMMARY\nMean,Max\n0.1,0.2\n")
    data = read_measurements(tmp_path / "run.csv")
    assert data.q.tolist() == [[0.2929, 0.2023], [0.785, 0.1551]]
    assert data.position[1].tolist() == [0.27621, 0.25728, 0.23957]
    assert any("lines 11–13" in note for note in data.notes)
    (tmp_path / "run.csv").write_text(REPORT + REPORT)
    with refuses(FileError, "lines 11–13", "lines 24–26"):
        read_measurements(tmp_path / "run.csv")


def test_a_list_of_a_measuring_machine_joins_by_its_names(tmp_path):
    rows = "\n".join(f"P{k},1,0.0,{k}.5,2,3" for k in range(3))
    head = "Element Name,Number,Deviation,MX Coord.[mm],MY Coord.[mm],MZ Coord.[mm]"
    (tmp_path / "cmm.csv").write_text(f"{head}\n{rows}")
    with refuses(DataError, "--joints"):
        read_measurements(tmp_path / "cmm.csv")
    (tmp_path / "q.csv").write_text("point,q1[deg]\nP2,20\nP0,0\nP1,10\n")
    data = read_measurements(tmp_path / "cmm.csv", joint_table=tmp_path / "q.csv")
    assert np.rad2deg(data.q[:, 0]) == pytest.approx([0, 10, 20])
    assert data.position[2] == pytest.approx([0.0025, 0.002, 0.003])


HEAD, R = "q1[deg],x[mm],y[mm],z[mm]", ",0,1,0,-1,0,0,0,0,1\n"


@pytest.mark.parametrize(
    ("text", "excluded"),
    [
        (f"{HEAD}\n1,1,2,3\n2,---,*,fehlt\n3,4,5,6\n", [1]),
        ("J1 / deg\tx, mm\ty, mm\tz, mm\n1\t1\t2\t3\n2\t9\t9\t9\n3\t4\t5\t6", []),
        (f"Page 1\n{HEAD}\n1,1,2,3\n2,9,9,9\nPage 2\n{HEAD}\n3,4,5,6\n", []),
        (",Robot (goal),Leica,,\nJ1[deg],X[mm],X[mm],Y[mm],Z[mm]\n1,0,1,2,3\n2,0,9,9,9\n3,0,4,5,6", []),
        ("J1 Ist[deg],Nom X[mm],Act X[mm],Act Y[mm],Act Z[mm]\n1,0,1,2,3\n2,0,9,9,9\n3,0,4,5,6\n", []),
        ("J1_cmd[deg],pos_x_mm,pos_y_mm,pos_z_mm\n1,1,2,3\n2,#REF!,#N/A,#DIV/0!\n3,4,5,6\n", [1]),
        (
            "J1[deg],J2[deg],J3[deg],elbow,X[mm],Y[mm],Z[mm]\n1,0,0,up,1,2,3\n2,0,0,up,1,2,3\n3,0,0,up,4,5,6",
            [],
        ),
        ("q1[deg],x[mm],y[mm],z[mm],fx,fy,fz,tx,payload\n1,1,2,3,,,,7,1\n2,9,9,9,,,,7,1\n3,4,5,6,,,,7,1", []),
        ("q1[deg],x[mm],y[mm],z[mm],LT_X[mm],Y FARO[mm]\n1,7,7,3,1,2\n2,0,0,9,9,9\n3,0,0,6,4,5", []),
        ("q1[deg];x[um];y[um];z[um]\n1;1;2;3\n2;#NV;lost;#NV\n3;4'000.0;5,000.0;6 000.0\n", [1]),
        ("| q1[deg] | x[mm] | y[mm] | z[mm] |\n|:--|--|--|--|\n|1|1|2|3|\n|2|0|0|0|\n|3|4|5|6|\n", []),
        (f"{HEAD},{','.join(f'R{k // 3}{k % 3}' for k in range(9))}\n1,1,2,3{R}2,0,0,0{R}3,4,5,6{R}", []),
        (f"{HEAD},qw,qx,qy,qz\n1,1,2,3,1,0,0,0\n2,9,9,9,,,,\n3,4,5,6,1,0,0,0\n", []),
        (
            "x1[mm],y1[mm],z1[mm],phix1[rad],phiy1[rad],phiz1[rad],q1[deg]\n1,2,3,0,0,0,1\n9,9,9,0,0,0,2\n4,5,6,0,0,0,3",
            [],
        ),
        ("q1[deg],x1[mm],y1[mm],z1[mm]\n1,1,2,3\n2,9,9,9\n3,4,5,6\n", []),
        ("A1[deg],A1_ACT[deg],q_ref1[deg],x[mm],y[mm],z[mm]\n0,1,5,1,2,3\n0,2,5,9,9,9\n0,3,5,4,5,6\n", []),
        ("q1[deg],q1[arcmin],x[mm],y[mm],z[mm]\n1,60,1,2,3\n2,120,9,9,9\n3,180,4,5,6\n", []),
        ("No,q1[deg],No,x[mm],y[mm],z[mm]\n1,1,3,4,5,6\n2,2,1,1,2,3\n3,3,2,9,9,9\n", []),
        ("Pose No,q1[deg],Run No,x[mm],y[mm],z[mm]\n1,1,3,1,2,3\n2,2,1,9,9,9\n3,3,2,4,5,6\n", []),
        (f"Day A\n{HEAD}\n1,1,2,3\n2,9,9,9\nDay B\n{HEAD}\n3,4,5,6\n", []),
        ("q1[Â°],x[mm],y[mm],z[mm]\n1,1,2,3\n2,9,9,9\n3,4,5,6\n", []),
        (
            "q1[deg],Control,Nom[mm],Meas[mm]\n1,X,0,1\n,Y,0,2\n,Z,0,3\n2,X,0,9\n,Y,0,9\n,Z,0,9\n3,X,0,4\n,Y,0,5\n,Z,0,6",
            [],
        ),
        (
            ",Nominal [mm],,,Actual [mm]\nJ1[deg],X,Y,Z,X,Y,Z\n1,0,0,0,1,2,3\n2,0,0,0,9,9,9\n3,0,0,0,4,5,6\n",
            [],
        ),
        ("J1/deg;X reached/mm;X goal/mm;Y/mm;Z/mm\n1;1;0;2;3\n2;2,5-;0;9;9\n3;4;0;5;6\n", []),
        ("q1[deg],Target,X [mm],Y [mm],Z [mm]\n1,A,1,2,3\n2,A,9,9,9\n3,B,4,5,6\n", []),
    ],
)
def test_gaps_in_words_headings_that_stand_again_or_in_two_rows_and_their_words(tmp_path, text, excluded):
    (tmp_path / "t.csv").write_text(text)
    data = read_measurements(tmp_path / "t.csv")
    assert np.rad2deg(data.q[:, 0]) == pytest.approx([1, 2, 3])
    assert data.position[2] == pytest.approx([0.004, 0.005, 0.006])
    assert np.flatnonzero(~data.included).tolist() == excluded
    assert "Target" not in text or data.point.tolist() == ["A", "A", "B"]


def test_each_of_several_distances_is_a_row(tmp_path):
    (tmp_path / "t.csv").write_text("A1[deg],A2[mm],dist1[mm],dist2[mm]\n90,5,1,2\n90,6,3,\n90,7,,\n")
    data = read_measurements(tmp_path / "t.csv", joints=2)
    assert data.q == pytest.approx(np.array([[H, 0.005], [H, 0.005], [H, 0.006], [H, 0.007]]))
    assert data.distance[data.included] == pytest.approx([0.001, 0.002, 0.003])
    assert data.anchor.tolist() == ["distance1", "distance2", "distance1", "distance1"]
    (tmp_path / "t.csv").write_text(f"{HEAD},dist1,dist2[mm]\n90,1,2,3,4,5\n")
    assert read_measurements(tmp_path / "t.csv").distance is None


@pytest.mark.parametrize("text", ["q[deg],-,xyz[mm]", "xyz[mm],q[deg],-"])
def test_names_of_joints_are_those_of_their_own_table(tmp_path, text):
    (tmp_path / "j.csv").write_text("90,5\n0,6\n")
    (tmp_path / "t.csv").write_text("1,2,3\n4,5,6\n")
    data = read_measurements(tmp_path / "t.csv", joint_table=tmp_path / "j.csv", columns=text)
    assert (data.q[0, 0], data.position[1, 2]) == pytest.approx((H, 0.006))


def test_a_row_that_lacks_a_joint_is_left_out(tmp_path):
    head = "q1[rad],q2[rad],x[m],y[m],z[m],temp[degC]\n"
    (tmp_path / "m.csv").write_text(f"{head}1,2,3,4,5,20\n,,3,4,5.5,\n2,3,4,5,6,21\n,,4,5,6.5,\n")
    assert read_measurements(tmp_path / "m.csv").exclude.tolist() == [False, True, False, True]
    (tmp_path / "m.csv").write_text(f"{head}1,2,3,4,5,20\n1,n/a,3,4,5.1,20\n2,3,4,5,6,21\n")
    data = read_measurements(tmp_path / "m.csv")
    assert data.exclude.tolist() == [False, True, False]
    assert "data row 1 (line 3) lacks q2 and is excluded" in data.notes


GAP = (" x=5 mm", "", " x=6 mm")
NAMED = {
    "&ACCESS\nDECL E6AXIS P={{A1 {},A2 {},A3 {},E1 0.0}}\nDECL E6POS Q={{X 1.0,Y 2.0}}\n": False,
    "/PROG A\nP[1]{{ J1= {} deg, J2= {} deg,\n J3= {} deg }};\n": False,
    "MODULE M\nCONST jointtarget j:=[[{},{},{}],[9E9,9E9,9E9,9E9,9E9,9E9]];\n": False,
    "q1={} q2={} q3={} X=1.0 mm\n": True,
}


@pytest.mark.parametrize("form", NAMED)
def test_joints_stand_behind_their_names(tmp_path, form):
    (tmp_path / "t.txt").write_text(form.format(10.5, -20, 30) + form.format(11.5, -21.0, 31))
    values = read_fields(tmp_path / "t.txt").values
    assert np.rad2deg([values[f"q{k}"][1] for k in (1, 2, 3)]) == pytest.approx([11.5, -21, 31])
    assert ("x" in values) == NAMED[form]


def test_angles_in_minutes_numbers_for_nothing_and_a_load_by_its_weight(tmp_path):
    rows = ["-130°30'36\"", "12°0′0.0″", "1.5"], ["-9999", "2", "99999.9"], ["9.80665", "0", "20"]
    text = "\n".join(map(";".join, zip(*rows, strict=True)))
    (tmp_path / "t.csv").write_text(f"A1[deg];x[mm];Load [N]\n{text}\n", encoding="utf-8")
    values = read_fields(tmp_path / "t.csv").values
    assert np.rad2deg(values["q1"]) == pytest.approx([-130.51, 12.0, 1.5])
    np.testing.assert_allclose(values["x"], [np.nan, 2e-3, np.nan])
    assert values["payload"] == pytest.approx([1.0, 0.0, 20.0 / 9.80665])


def test_a_line_of_names_is_a_row(tmp_path):
    """One that lacks a name has a gap there; comments and a tool's place are none; twice is refused."""
    text = "tool x=0 mm\n# q1=-360 q2=-360 q3=-360\n" + "".join(
        f"q1={k} q2=1 q3=2{x}\n" for k, x in enumerate(GAP)
    )
    (tmp_path / "t.txt").write_text(text)
    found = read_fields(tmp_path / "t.txt").values["x"]
    np.testing.assert_allclose(found, [5e-3, np.nan, 6e-3])
    (tmp_path / "t.txt").write_text(text + "q1=1 q2=1 q3=1 x=1 mm x=2 mm\n")
    with refuses(FileError, "line 6", "'x' stands twice"):
        read_fields(tmp_path / "t.txt")
    (tmp_path / "t.txt").write_text("# q1=1 q2=1 q3=2\n# q1=2 q2=1 q3=2\nq1[deg],x[mm]\n1,2\n")
    assert read_fields(tmp_path / "t.txt").rows == 1


@pytest.mark.parametrize(
    ("turn", "rows", "lost"),
    [(0, [2], [2]), (1, [2, 4], [2, 4]), (1, [2], []), ((0.6, 0.8, 0, 0), [2, 4], [])],
)
def test_poses_of_zeros_were_not_seen(tmp_path, turn, rows, lost):
    """Without an orientation, or with the same at several joints; a pose at the origin may be the first's."""
    q, table = np.arange(7.0), np.tile([0.0, 0, 0, 0, 0.6, 0.8, 0, 0], (7, 1))
    table[:, :4] = np.stack([q, np.sin(q), np.cos(q), q / 7], axis=1)
    table[rows, 1:4], table[rows, 4:] = 0.0, turn if np.ndim(turn) else (turn, 0, 0, 0)
    head = "q1[rad],x[m],y[m],z[m],qw,qx,qy,qz"
    np.savetxt(tmp_path / "t.csv", table, delimiter=",", header=head, comments="")
    assert np.flatnonzero(~read_measurements(tmp_path / "t.csv").included).tolist() == lost


def test_lists_of_joints_and_of_a_boards_pose_are_columns(tmp_path):
    (tmp_path / "r.json").write_text('[{"posj": [0.1, 2], "tvec": [3, 4, 5], "rvec": [0.1, 0, 0]}]')
    data = read_measurements(tmp_path / "r.json")
    assert (data.q[0, 1], data.position[0, 2], data.written.numbers[0, 0]) == pytest.approx((2, 5, 0.1))


POSTURES = np.random.default_rng(7).uniform(-1, 1, (12, 9)).round(4) + np.repeat([0, 2], [6, 3])
JOINTS = [f"q{k}[rad]" for k in range(1, 7)]


def named_table(path, *heads, words=()):
    """Rows under strangers' headings, words in the last column."""
    rows = np.hstack([POSTURES, *[POSTURES[:, 6:]] * 2]).astype(str).tolist()
    ends = [[*row[: len(heads) - bool(words)], *words[k : k + 1]] for k, row in enumerate(rows)]
    path.write_text("\n".join(map(",".join, [heads, *ends])))
    return path


@pytest.mark.parametrize(
    ("heads", "seen"),
    [
        ([*(f"关节{k}(弧度)" for k in range(1, 7)), *(f"{a}坐标(毫米)" for a in "XYZ")], "position"),
        ([*(f"Unión {k} [radianes]" for k in range(6)), *(f"Posición {a} [mm]" for a in "XYZ")], "position"),
        ([*(f"Glied {k} [rad]" for k in range(1, 7)), *(f"measured_mm_{a}" for a in "xyz")], "position"),
        ([*(f"measuredJointPosition[{k}]" for k in range(6)), *(f"{a} (мм)" for a in "XYZ")], "position"),
        ([*JOINTS, *(f"Reflector {m} {a} (mm)" for m in "ABC" for a in "XYZ")], "markers"),
        ([*JOINTS, *(f"P{k}.{a} (mm)" for k in (1, 2) for a in "XYZ")], None),
        ([*JOINTS, "Length_mm", "Ball"], "distance"),
    ],
)
def test_headings_of_any_language_are_told_by_units_and_each_other(tmp_path, heads, seen):
    words = [*"ABC"] * 4 if "Ball" in heads else ()
    path = named_table(tmp_path / "t.csv", *heads, words=words)
    if seen is None:  # of one point, or of a controller and an instrument
        with refuses(DataError, "x=P1.X,y=P1.Y,z=P1.Z"):
            read_measurements(path)
        return
    data = read_measurements(path)
    assert data.q == pytest.approx(POSTURES[:, :6])
    read = np.reshape(getattr(data, seen), (12, -1))[:, :3]
    assert read == pytest.approx(1e-3 * POSTURES[:, 6 : 6 + read.shape[1]])
    assert not words or data.anchor.tolist() == words


@pytest.mark.parametrize("above", [",".join(map(str, ["Pose", *range(12)])), "Report of the hall"])
def test_headings_in_the_first_column_are_read(tmp_path, above):
    path = named_table(tmp_path / "t.csv", *JOINTS, "x[mm]", "y[mm]", "z[mm]")
    lines = zip(*(line.split(",") for line in path.read_text().split("\n")), strict=True)
    path.write_text("\n".join([above, *map(",".join, lines)]))
    assert read_measurements(path).q == pytest.approx(POSTURES[:, :6])


@pytest.mark.parametrize("cell", ["{}", "9:{:02}:30"])
def test_a_lone_column_of_seconds_or_of_a_clock_that_goes_on_is_the_time(tmp_path, cell):
    """Play in a joint was called an encoder's scale, as 'Heure' was left out."""
    rows = [[cell.format(k), *row] for k, row in enumerate(POSTURES.astype(str).tolist())]
    heads = ["Heure" if ":" in cell else "Temps [s]", *JOINTS, "x[mm]", "y[mm]", "z[mm]"]
    (path := tmp_path / "t.csv").write_text("\n".join(map(",".join, [heads, *rows])))
    assert np.diff(read_measurements(path).time) == pytest.approx(60.0 if ":" in cell else 1.0)
    path.write_text("\n".join(map(",".join, [heads, *rows[6:], *rows[:6]])))  # each row's own duration, maybe
    assert read_measurements(path).time is None


def test_columns_that_say_what_they_are_or_nothing(tmp_path):
    head = f"Way,{HEAD},payload[N],tcp/C,q1/s,q1_mean[deg]"
    rows = (f"{'XYZ'[k % 3]},{k},{k},1,2,{5 * k % 9 + 1},7,8,9\n" for k in range(9))
    (tmp_path / "t.csv").write_text("".join([head, "\n", *rows]))
    data = read_measurements(tmp_path / "t.csv")
    assert data.temperature is None
    assert data.payload[:3] * 9.80665 == pytest.approx([1.0, 6.0, 2.0])
    assert data.position[:, 0] == pytest.approx(np.arange(9) * 1e-3)


@pytest.mark.parametrize(
    ("head", "key"),
    [
        *((f"{of} (°C)", "temperature") for of in ("Arm unten", "Klimaschrank")),
        ("CPU (°C)", None),
        ("Load [N]", None),
    ],
)
def test_a_lone_temperature_is_known_by_its_unit(tmp_path, head, key):
    """A force gauge's readings were loads, a controller's temperature the arm's."""
    path = named_table(tmp_path / "t.csv", head, *JOINTS[:5], "x[mm]", "y[mm]", "z[mm]")
    assert key or read_measurements(path).payload is None is read_measurements(path).temperature
    assert not key or getattr(read_measurements(path), key) == pytest.approx(POSTURES[:, 0])


@pytest.mark.parametrize(
    ("text", "why"),
    [
        (f"Before\n{HEAD}\n1,1,2,3\nAfter\n{HEAD}\n1,2,2,3\n", "'After' in lines 5–6"),
        (
            "q1[deg],x_calc[mm],y_calc[mm],z[mm]\n1,1,2,3\n",
            "as measured, not as in 'x_calc[mm]', 'y_calc[mm]'",
        ),
        (f"{HEAD}\n1,1,2,\n2,1,2,\n", "no cell of 'z[mm]' holds a value"),
    ],
)
def test_what_is_no_measurement_is_not_pooled_and_is_named(tmp_path, text, why):
    (tmp_path / "t.csv").write_text(text)
    with pytest.raises(WorkbenchError, match=re.escape(why)):
        read_measurements(tmp_path / "t.csv")


def test_joints_without_a_column_of_directions_have_none(tmp_path):
    """The one that has was 'missing in some rows'."""
    (tmp_path / "t.csv").write_text("q1[rad],q2[rad],x[m],y[m],z[m],direction2\n0,0,1,0,0,1\n1,1,0,1,0,-1\n")
    assert read_measurements(tmp_path / "t.csv").direction.tolist() == [[0, 1], [0, -1]]


def test_exponents_of_fortran_are_numbers():
    assert [*map(number_in, ("-2.5D-01", "2d+2"))] == [-0.25, 200.0]
    assert np.isnan(number_in("12D3"))


def test_humps_part_words_but_none_that_is_known():
    assert [*map(meaning, ("TimeStamp", "payLoad", "rotVecX", "PosX"))] == ["time", "payload", "rx", "x"]


def test_of_two_sets_of_one_numbering_the_first_is_named():
    sets = {f"{name}{k}": ["0.1", "0.2", "0.4"] for name in ("mp", "mt") for k in range(1, 7)}
    assert "q1=mp1,q2=mp2" in unread_text(sets, "q1", 6)
    beside = dict.fromkeys(("Pose ID", "E [rad]", "U95 [m]"), sets["mp1"])  # none but E is an angle
    assert "'q4=E' or 'q1=E,q2=S,q3=L,q4=U'" in unread_text(beside, "q4", 1, "SLU")


@pytest.mark.parametrize(
    "heads",
    [
        ([*JOINTS, "aX", "aY", "aZ"]),
        ([*JOINTS, "one", "two", "three"]),
        ([*JOINTS, "reading"]),
        ([*JOINTS, *(f"{cam} {a} [mm]" for cam in ("left", "right") for a in "XYZ")]),
        (["one", "two", "three", "four", "five", "six", "x[mm]", "y[mm]", "z[mm]"]),
        (["E1", *(f"A{k}" for k in range(1, 6)), "x[mm]", "y[mm]", "z[mm]"]),
        ([*JOINTS, "x[mm]", "y[mm]", "z[mm]", "Nick [deg]", "Roll[deg]"]),
    ],
)
def test_who_follows_an_advice_is_not_refused_again(tmp_path, heads):
    path = named_table(tmp_path / "t.csv", *heads)
    joints = ({"type": kind, "d": 0.1, "a": 0.2, "alpha": 1.0} for kind in ("prismatic", *["revolute"] * 5))
    arm = robot_from_rows([*joints], "dh", name="arm")
    with pytest.raises(WorkbenchError) as refused:
        read_measurements(path, joints=arm)
    advice = re.findall(r"'([^' ]*=[^']*)'", str(refused.value).partition("columns=")[2])
    assert [own for own in advice if "q6=E1" not in own] == advice != []
    for columns in advice:
        assert read_measurements(path, joints=arm, columns=columns).included.all()


def test_options_take_units_of_headings_and_seconds_since_1970_are_a_time(tmp_path):
    stamps = ["1691406519419"] * 12
    path = named_table(tmp_path / "t.csv", *JOINTS, "Length_mm", "Width_mm", "time", words=stamps)
    data = read_measurements(path, columns="distance=Length_mm")
    assert data.distance == pytest.approx(1e-3 * POSTURES[:, 6])
    assert data.time == pytest.approx(1691406519.419)


def test_a_column_that_is_empty_in_every_row_is_none(tmp_path):
    (tmp_path / "t.txt").write_text("\n".join("\t".join([*map(str, row), ""]) for row in POSTURES))
    data = read_measurements(tmp_path / "t.txt", columns="q1[rad],…,q6[rad],xyz[mm]")
    assert data.position == pytest.approx(1e-3 * POSTURES[:, 6:])


def test_yaml_of_joints_and_poses_is_read_row_by_row(tmp_path):
    pose = "{{qw: 1, qx: 0, qy: 0, qz: 0, x: 0.{0}, y: 0.2, z: 0.3}}"
    row = f"'{{0}}593701755':\n  camera_joints: []\n  pose: {pose}\n  target_joints:\n  - 0.{{0}}\n  - 0.5\n"
    (tmp_path / "m.yaml").write_text("".join(row.format(k) for k in range(1, 7)))
    data, tenths = read_measurements(tmp_path / "m.yaml"), [k / 10 for k in range(1, 7)]
    assert (data.q[:, 0].tolist(), data.position[:, 0].tolist()) == (tenths, tenths)
    (tmp_path / "q.yaml").write_text("\n".join(f"angles_{k}:\n- {k}\n- 0\n- 0" for k in (3, 1, 2)))
    assert read_fields(tmp_path / "q.yaml").values["q1"].tolist() == [1, 2, 3]
    (tmp_path / "real").mkdir()
    turn = "\n".join(f"- - {a}\n  - {b}\n  - {c}\n  - {d}" for a, b, c, d in np.eye(4))
    for k, (*q, x, y, z) in enumerate(POSTURES.tolist()):
        text = f"image_shape:\n- 480\n- 640\n- 3\njoint_values: {q}\nr_mtx:\n{turn}\nt_vec: {[x, y, z]}\n"
        (tmp_path / "real" / f"picture_{k:02d}.yaml").write_text(text)
    data = read_measurements(tmp_path / "real")
    assert (data.q.shape, data.position.shape, data.rotation.shape) == ((12, 6), (12, 3), (12, 3, 3))


@pytest.mark.parametrize("off", [0.1, 3e-4])
def test_places_of_three_kinds_are_no_markers(tmp_path, off):
    """Targets and places, or three repeats, were read as markers of a tool without a word."""
    places = np.hstack(
        [POSTURES[:, 6:] + off * np.random.default_rng(k).normal(size=(12, 3)) for k in range(3)]
    )
    heads = [*JOINTS, *(f"{k}_{a}[m]" for k in "abt" for a in "xyz")]
    rows = np.hstack([POSTURES[:, :6], places]).astype(str)
    (path := tmp_path / "t.csv").write_text("\n".join(map(",".join, [heads, *rows.tolist()])))
    with pytest.raises(DataError, match="nothing was observed"):
        read_measurements(path)
