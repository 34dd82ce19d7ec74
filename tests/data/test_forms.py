"""Every form of table and column that is read, on small files made by hand."""

import datetime

import numpy as np
import pytest
from binary_files import workbook
from hypothesis import given
from hypothesis import strategies as st
from refusals import mentions, refuses

from workbench.base.errors import DataError, FileError
from workbench.data.readers import preview, read_measurements, read_trajectory
from workbench.data.readers.text import separator_of

ROTATED = [[1, 0, 0], [0, 0, -1], [0, 1, 0]]  # 90° about x


@pytest.fixture
def read(file):
    return lambda content, name="rows.csv", **options: read_measurements(file(content, name), **options)


HEAD, UNITS = "q1[deg],q2[mm],x[mm],y[in],z[µm]", ("deg,mm,mm,in,um", "[deg],[mm],[mm],[in],[um]")
COMMA = f"{HEAD}\n90,500,1000,10,2000000\n-45.5,0.25,1,2,3\n"
CELLS = [row.split(",") for row in COMMA.split()]
GERMAN = [[cell.replace(".", ",") for cell in row] for row in CELLS]


@pytest.mark.parametrize(
    "content",
    [
        *(COMMA.encode(codec) for codec in ("utf-8", "utf-8-sig", "utf-16", "latin-1")),
        *(COMMA.replace("\n", end).encode() for end in ("\r\n", "\r")),
        *(COMMA.replace(",", mark).encode() for mark in ("\t", ";", "   ", ", ")),
        *(COMMA.replace(",", mark).replace(".", ",").encode() for mark in (";", " ; ")),
        COMMA.replace(",", "\t").replace(".", ",").encode("utf-16"),
        COMMA.replace("[", " [").replace(",", "   ").encode(),
        ("# made by hand\n\n" + COMMA.replace("\n", "\n\n") + "# the end\n").encode(),
        *((above + COMMA).encode() for above in ("# ", "Measured on Monday\n")),
        *("\n".join('","'.join(row).join('""') for row in rows).encode() for rows in (CELLS, GERMAN)),
        COMMA.replace("-45.5", "\u221245.5").encode(),
        "q1,q2,x[mm],y,z\n90°,500 mm,1000 mm,10inch,2000000µm\n-45.5 deg,0.25mm,1,2inch,3 µm\n".encode(),
        COMMA.replace("[", " (").replace("]", ")").encode(),
        *(COMMA.replace(HEAD, f"q1,q2,x,y,z\n{line}").encode() for line in UNITS),
    ],
)
def test_the_same_numbers_in_every_text_form(read, content):
    data = read(content)
    np.testing.assert_allclose(data.q, [[np.pi / 2, 0.5], [np.radians(-45.5), 0.00025]], rtol=1e-14)
    np.testing.assert_allclose(data.position, [[1.0, 0.254, 2.0], [0.001, 0.0508, 3e-6]], rtol=1e-14)
    assert data.row.tolist() == [0, 1]


TABLE = [["q1[deg]", "x[m]", "y[m]", "z[m]", "session"], [90, 1.0, 2.5, 3.0, "a"]]
TABLE.append([45.5, 1.0, None, 3.0, "b"])
OFF = [["#", *TABLE[0]], [1, *TABLE[1]], [2, *TABLE[2]], ["#", *TABLE[1]]]


@pytest.mark.parametrize("table", [TABLE, OFF])
def test_workbook_with_gap_and_labels(read, table):
    data = read(workbook({"Notes": [["hello"]], "Data": table}), "t.xlsx")
    np.testing.assert_allclose(data.q[:, 0], np.radians([90, 45.5]))
    assert data.exclude.tolist() == [False, True]
    assert data.reason[1] == "lacks y"
    assert data.sessions == ("a", "b")


def test_workbook_with_two_tables_asks_which(read, read_here):
    content = workbook({"A": TABLE, "B": TABLE})
    with refuses(FileError, "'A', 'B'"):
        read(content, "t.xlsx")
    assert "sheet 'B'" in read(content, "t.xlsx", sheet="B").notes[0]


def test_joints_and_points_in_two_sheets_are_joined(read):
    joints = [["Pose", "J1 [deg]", "X [mm]", "Y [mm]", "Z [mm]"], ["P1", 10, 7, 8, 9], ["P2", 20, 7, 8, 9]]
    points = [["Pose", "X [mm]", "Y [mm]", "Z [mm]"], ["P2", 4, 5, 6], ["P1", 1, 2, 3]]
    data = read(workbook({"Soll": points, "Robot": joints, "Leica": points}), "t.xlsx")
    np.testing.assert_allclose(np.rad2deg(data.q[:, 0]), [20, 10])
    np.testing.assert_allclose(data.position[0], [0.004, 0.005, 0.006])


def test_workbook_rows_count_as_in_the_workbook(read, read_here):
    head = [None, "q1[rad]", "x[m]", "y[m]", "z[m]"]
    rows = [[], ["title"], head, [None, 1, 1, 1, 1], [None, 1, "one", 1, 1]]
    with refuses(FileError, line=5, column="x[m]"):
        read(workbook({"A": rows}), "t.xlsx")


def test_dates_become_seconds(read, read_here):
    day = datetime.datetime(2020, 7, 14, 16, 39, 4)
    rows = [["q1[rad]", "x[m]", "y[m]", "z[m]", "time"]]
    rows += [[0.1 * i, i, i, i, day + datetime.timedelta(seconds=20 * i)] for i in range(3)]
    assert read(workbook({"A": rows}), "t.xlsx").time.tolist() == [0.0, 20.0, 40.0]
    for date in ("2020-07-14T16:39:0{}", "14.07.2020 16:39:0{}", "07/01/2020 04:39:0{} PM", "16:39:0{}"):
        rows = (f"{i},1,2,3,{date.format(i)}\n" for i in range(3))
        assert read("q1[rad],x[m],y[m],z[m],time[s]\n" + "".join(rows)).time.tolist() == [0.0, 1.0, 2.0]
    for doubtful in ("0{}/03/2024 16:39:04", "05:1{}.0", "16:39:0{}"):  # any day or hour
        rows = (f"{i},1,2,3,{doubtful.format(i)}\n" for i in "321")
        data = read("q1[rad],x[m],y[m],z[m],time\n" + "".join(rows))
        assert data.time is None
        assert mentions(" ".join(data.notes), "time", "left out")


def test_parquet(read, tmp_path):
    import pandas

    columns = {"q1[deg]": [90.0, 45.0], "x[m]": [1.0, 0.1], "y[m]": [2, 3], "z[m]": [3.0, None]}
    pandas.DataFrame({**columns, "session": ["a", "b"]}).to_parquet(tmp_path / "t.parquet")
    data = read_measurements(tmp_path / "t.parquet")
    np.testing.assert_allclose(data.q[:, 0], np.radians([90, 45]))
    assert data.position[1, 0] == 0.1
    assert data.reason.tolist() == ["", "lacks z"]


@pytest.mark.parametrize(
    "columns",
    [
        "qw,qx,qy,qz\n{h},{h},0,0",
        "qx,qy,qz,qw\n{h},0,0,{h}",
        "quat_w,quat_x,quat_y,quat_z\n{h},{h},0,0",
        "roll[deg],pitch[deg],yaw[deg]\n90,0,0",
        "yaw[rad],pitch[mrad],roll[arcmin]\n0,0,5400",
        "Roll [grad],Nick [grad],Gier [grad]\n100,0,0",
        "rx[deg],ry[deg],rz[deg]\n90,0,0",
        "zxz_phi[deg],zxz_theta[deg],zxz_psi[deg]\n0,90,0",
        "r11,r12,r13,r21,r22,r23,r31,r32,r33\n1,0,0,0,0,-1,0,1,0",
        "R_11,R_12,R_13,R_21,R_22,R_23,R_31,R_32,R_33\n1,0,0,0,0,-1,0,1,0",
    ],
)
def test_orientation_in_every_form(read, columns):
    head, row = columns.format(h=0.5**0.5).split("\n")
    data = read(f"q1[rad],x[m],y[m],z[m],{head}\n0.1,1,2,3,{row}\n")
    np.testing.assert_allclose(data.rotation[0], ROTATED, atol=1e-12)


NAMES = ("q", "Q", "J", "A", "joint_", "Joint ", "Gelenk", "Achse ", "theta", "panda_joint",
         "lbr_iiwa_joint_", "joint_a", "state.q")  # fmt: skip
HEADS = ["joint_0,joint_1,joint_2", "shoulder_pan_joint,shoulder_lift_joint,elbow_joint", "q3,q1,q2"]


@pytest.mark.parametrize("heads", [*(",".join(f"{name}{k}" for k in (1, 2, 3)) for name in NAMES), *HEADS])
def test_names_of_joints(read, heads):
    headings = ",".join(f"{name}[deg]" for name in heads.split(","))
    data = read(f"{headings},x[m],y[m],z[m]\n10,20,30,1,2,3\n")
    expected = [20, 30, 10] if heads == "q3,q1,q2" else [10, 20, 30]
    np.testing.assert_allclose(np.degrees(data.q[0]), expected)
    assert heads[0] in "qQ" or any("read as" in note for note in data.notes)


def test_the_caller_renames_columns(read):
    text = "a,b,x,y,z,q1\n90,45,1,2,3,7\n"
    data = read(text, columns="q1[deg]=a,q2[deg]=b,x[mm]=x,y[mm]=y,z[mm]=z")
    np.testing.assert_allclose(np.degrees(data.q[0]), [90, 45])
    assert data.position[0].tolist() == [0.001, 0.002, 0.003]
    assert any("'a' is read as q1[deg]" in note for note in data.notes)


def test_everything_else(read):
    head = "q1[rad],q2[rad],m1x[mm],m1y[mm],m1z[mm],m2x[mm],m2y[mm],m2z[mm],distance[mm],anchor,contact,point"
    head += ",tilt_x2[deg],tilt_y2[deg],time[ms],temperature[K],payload[g],torque1[Nm],direction1,direction2"
    head += ",session,group,sigma_x[um],sigma_roll[deg],exclude,reason"
    rows = "0,0,1,2,3,4,5,6,700,A,hole,s1,1,2,1500,300,250,3.5,+,-,front,g1,50,0.01,false,\n"
    rows += "0,0,1,2,3,,,,800,A,hole,s1,1,2,1500,,250,3.5,+,0,back,g1,50,0.01,yes,slipped\n"
    data = read(head + "\n" + rows)
    assert data.markers.shape == (2, 2, 3)
    assert np.isnan(data.markers[1, 1]).all()
    np.testing.assert_allclose(data.distance, [0.7, 0.8])
    np.testing.assert_allclose(data.tilt[2], np.radians([[1, 2], [1, 2]]))
    assert data.time.tolist() == [1.5, 1.5]
    np.testing.assert_allclose(data.temperature, [26.85, np.nan])
    assert data.payload.tolist() == [0.25, 0.25]
    np.testing.assert_array_equal(data.torque, [[3.5, np.nan]] * 2)
    np.testing.assert_array_equal(data.direction, [[1, -1], [1, 0]])
    np.testing.assert_allclose(data.sigma[0, [0, 3]], [5e-5, np.radians(0.01)])
    assert np.isnan(data.sigma[0, [1, 2, 4, 5]]).all()
    assert data.sessions == ("front", "back")
    assert [data.anchor[0], data.contact[0], data.point[0], data.group[0]] == ["A", "hole", "s1", "g1"]
    assert (data.exclude.tolist(), data.reason.tolist()) == ([False, True], ["", "slipped"])


def test_contacts_need_no_numbers(read):
    data = read("q1[rad],q2[rad],contact\n0,0,hole\n0,1,\n")
    assert (data.position, data.exclude.tolist()) == (None, [False, True])


@given(
    separators=st.permutations([",", ";", "\t"]),
    message=st.lists(st.text("ab 7,;\t", min_size=1, max_size=5), min_size=2, max_size=5),
    title=st.booleans(),
)
def test_the_separator_is_the_one_of_the_heading(separators, message, title):
    own, others = separators[0], separators[1:]
    labels = [word.replace(own, "") + "".join(others) for word in message]
    rows = [own.join(["1", "2.5", "3", "4", label]) for label in labels]
    lines = ["rows of today"] * title + [own.join(["q1[deg]", "x[mm]", "y[mm]", "z[mm]", "session"]), *rows]
    assert separator_of(lines) == own


def test_tabs_part_cells_of_several_numbers():
    assert separator_of(["name\tq1\tnote", "P 0\t1\t", "P 1\t2\t1 2"]) == "\t"
    assert separator_of(["1 2\t3", "4 5\t6"]) == " "


def test_preview_says_what_was_understood(tmp_path):
    path = tmp_path / "t.csv"
    path.write_text("Achse 1[°];x[mm];y[mm];z[mm];session;group;Nr\n90,5;1;2;3;a;g;1\n9;1;2;;b;g;2\n")
    shown = preview(path)
    assert (shown.problems, shown.rows, shown.joints) == ((), 2, 1)
    assert shown.dataset.sessions == ("a", "b")
    first, x = ((c.heading, c.key, c.unit, c.si) for c in shown.columns[:2])
    assert (first, x) == (("Achse 1[°]", "q1", "°", "rad"), ("x[mm]", "x", "mm", "m"))
    assert shown.columns[-1].key is None
    assert "decimal commas" in shown.decisions


def test_lists_in_cells_are_columns_and_other_units_are_left_out(read):
    row = '"[1, 2]","(3.0, 4.0, 5.0)","(7, 8)",3,4\n'
    data = read(f"q[deg],xyz[mm],point,load[N],mass[kg]\n{row}")
    np.testing.assert_allclose(data.q, np.radians([[1, 2]]))
    np.testing.assert_allclose(data.position, [[3e-3, 4e-3, 5e-3]])
    assert (data.point.tolist(), data.payload.tolist()) == (["(7, 8)"], [4.0])
    own = read('q1[deg],q2[deg],position,x[mm],y[mm],z[mm]\n1,2,"[3, 4, 5]",6,7,8\n')
    np.testing.assert_allclose(own.position, [[6e-3, 7e-3, 8e-3]])
    pose = np.vstack([np.column_stack([ROTATED, [1, 2, 3]]), [0, 0, 0, 1]]).tolist()
    np.testing.assert_allclose(read(f'q[deg],T\n"[1, 2]","{pose}"\n').rotation, [ROTATED])


def test_trajectories(file):
    read, joints = lambda text, **how: read_trajectory(file(text), **how), "time[s],q1[deg],q2[deg]\n0,0,10\n"
    found = read(joints + "0.1,1,11\n", joints=2)
    assert (found.q.shape, found.position) == ((2, 2), None)
    poses = read("x[mm],y[mm],z[mm],qw,qx,qy,qz\n1,2,3,1,0,0,0\n")
    assert (poses.q, poses.rotation.shape) == (None, (1, 3, 3))
    turned = "x[mm],y[mm],z[mm],rx[deg],ry[deg],rz[deg]\n1,2,3,10,0,40\n"
    with refuses(DataError, "rotation vector", "roll", "columns="):
        read(turned)
    assert read(turned, columns="rx[deg]=rx,ry[deg]=ry,rz[deg]=rz").rotation is not None
    with refuses(DataError, "line 3", row=1, column="time"):
        read(joints + "0,1,11\n")
    with refuses(FileError, line=3, column="q1[deg]"):
        read(joints + "1,,11\n")
