"""Files that can't be measurements: one sentence with file, line and column, as the right error."""

import numpy as np
import pytest
from binary_files import refusal, zipped
from refusals import mentions

from workbench.base.errors import DataError, OptionError, UnitError
from workbench.data.readers import read_measurements

HEAD = "q1[rad],q2[rad],x[m],y[m],z[m]\n"
ROWS = "0.1,0.2,1.0,2.0,3.0\n0.3,0.4,1.1,2.1,3.1\n"
TWICE = "".join(f"0,0,{k},{k * k},1,{k + 2},{k * k},{3 + 2 * (k % 2)}\n" for k in range(6))
TWICE = f"{HEAD.strip()},Xm,Ym,Zm\n{TWICE}"


def test_missing_units_are_named_together(file):
    path = file("q1,q2[rad],x,y,z\n" + ROWS)
    with pytest.raises(UnitError) as caught:
        _ = read_measurements(path).said
    parts = ("line 1", "'q1'", "q1[rad]", "likewise 'x', 'y', 'z'")
    assert (caught.value.unit, mentions(str(caught.value), *parts)) == ("", True)


@pytest.mark.parametrize("unit", ["flurbs", "mm", "1", ""])
def test_unknown_and_unfit_units(file, unit):
    error = refusal(file(HEAD.replace("x[m]", "x[deg]" if unit == "mm" else f"x[{unit}]") + ROWS), UnitError)
    assert error.unit == ("deg" if unit == "mm" else unit)
    assert "'x[" in str(error)


@pytest.mark.parametrize("cells", ["1,2,", ",,", "1,,3"])
def test_rows_with_gaps_in_the_observation_are_kept_out(file, cells):
    data = read_measurements(file(HEAD + ROWS + f"0.1,0.2,{cells}\n"))
    assert data.exclude.tolist() == [False, False, True]
    assert data.reason[2].startswith("lacks")
    assert any("line 4" in note and "excluded" in note for note in data.notes)


def test_unreadable_options(file):
    path = file(HEAD + ROWS)
    refusal(path, OptionError, layout="nonsense")
    refusal(path, OptionError, sheet="Data")
    lists, pairs = ["", "q1[rad]", "q1[rad],…,x[m],y,z"], ["q1[rad]=nothing", "q1[rad|mm]=q1[rad]", "a,b=c"]
    for columns in (*lists, "=", *pairs):
        refusal(path, OptionError, columns=columns)


@pytest.mark.parametrize(
    ("content", "word"),
    [
        (b"%PDF-1.7\n1 0 obj", "PDF"),
        (zipped(("a.txt", "hello")), "archive"),
        (b"%YAML:1.0\n---\nA: !!opencv-matrix\n", "handeye"),
        (b"Trajectories\n100\n,,Tool:m1\nFrame,Sub Frame,X\n1,0,2.5\n", "Vicon"),
        (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", "xlsx"),
        (b"\x89HDF\r\n\x1a\n" + bytes(9), "MATLAB v5"),
        pytest.param(b"MATLAB 5.0 MAT-file" + bytes(200), "MATLAB", marks=pytest.mark.extra("logs")),
        (b"PAR1" + bytes(9), "parquet"),
        (zipped(("xl/workbook.xml", "hello")) + b"[Content_Types].xml", "workbook"),
        (b'name = "arm"\nconvention = "dh"\n\n[[joint]]\ntheta = 0.0\nd = 0.2\n', "TOML"),
        (b'<?xml version="1.0"?>\n<robot name="arm"><link name="base"/></robot>', "a robot"),
        (b"<html><body>1,2,3</body></html>", "a web page"),
        (b"[mounting]\ndelta_theta = [ 1e-8, 0]", "--for ur-calibration"),
        (b"# UR\n[DH]\na = [0, -0.425]", "a UR controller"),
        (b"def main():\n  movej(posj(1.0, 2.0))\n", "KRL and URScript"),
        (b"/PROG  A\n   1:J P[1] FINE ;\n", "KRL and URScript"),
        (b".PROGRAM a()\n  JMOVE #p1\n", "KRL and URScript"),
        (b'{"schema": "workbench.identification/1"}', "JSON"),
        (bytes(range(256)) * 8, "text|binary"),
        (b"The quick brown fox\njumps over the lazy dog\n", "not a table"),
        ("q1[rad]\n1".encode("utf-16")[:-1], "UTF-16"),
    ],
)
def test_files_of_another_kind(file, content, word):
    error = refusal(file(content, "thing.csv"))
    assert any(part in str(error) for part in word.split("|"))


MATRIX_HEAD = HEAD.strip() + "," + ",".join(f"r{i}{j}" for i in "123" for j in "123") + "\n"


def matrix_row(matrix):
    return "0.1,0.2,1,2,3," + ",".join(map(repr, np.ravel(matrix).tolist())) + "\n"


QUATERNION_HEAD = HEAD.strip() + ",qw,qx,qy,qz\n"
BOTH = QUATERNION_HEAD.strip() + ",roll[deg],pitch[deg],yaw[deg]\n"


@pytest.mark.parametrize(
    ("content", "word"),
    [
        (MATRIX_HEAD + matrix_row([[1, 0, 0], [0, 0, -0.9999], [0, 0.9999, 0]]), "orthonormal"),
        (QUATERNION_HEAD + "0.1,0.2,1,2,3,0.707,0.707,0,0\n", "normalised"),
        (BOTH + "0.1,0.2,1,2,3,0.70710678,0.70710678,0,0,90,0,0\n", "agrees"),
    ],
)
def test_rotations_of_few_digits_are_mended_and_two_forms_compared(file, content, word):
    data = read_measurements(file(content))
    np.testing.assert_allclose(data.rotation[0], [[1, 0, 0], [0, 0, -1], [0, 1, 0]], atol=1e-12)
    assert any(word in note for note in data.notes)


BY_HAND = "# made by hand\n" + HEAD + ROWS
TWIN = "0.1,0.2,1.0,2.0,3.0,1.0\n"
SEMICOLONS = HEAD.replace(",", ";")
VALUES = {"direction1": 2, "sigma_x[mm]": -1, "exclude": "maybe", "distance[m]": -1}
MILLIMETRES = SEMICOLONS.replace("[m]", "[mm]")
WRONG = [
    # the file, its line and column that are named, and another part of the sentence
    ("q1[rad],q3[rad],x[m],y[m],z[m]\n" + ROWS, None, None, "joint 2"),
    (HEAD + "0.1,,1,2,3\n,0.1,1,2,3\n,0.2,1,2,3\n" + ROWS, 2, "q2[rad]", "exclude"),
    *((HEAD + ROWS + f"0.1,0.2,1,{v},3\n", 4, "y[m]", "infinite") for v in ("inf", "-Infinity", "1e999")),
    *((HEAD + ROWS + f"0.1,0.2,{v},2,3\n", 4, "x[m]", v) for v in ("abc", "1.2.3", "1_000", "0x10", "12 mm")),
    *((HEAD + f"{q},0.2,{x},2,3\n" * 3, 2, None, "") for q, x in (("abc", "x"), ("0.1", "1 mm"))),
    *((BY_HAND + f"0.1,0.2,1{v}\n", 5, None, "5 are named") for v in (",2", ",2,3,4")),
    *((HEAD.strip() + f",{v}\n{TWIN}", None, v, "") for v in ("x[m]", "x[mm]", "pos_x[m]")),
    (f"Report,,,,,\n{HEAD.strip()},x[m]\n{TWIN}", None, "x[m]", "both mean x"),
    *((HEAD.replace(v, "note") + ROWS, None, None, f"without {v[0]}") for v in ("x[m]", "z[m]")),
    *((content, None, None, "") for content in ("", "\n \n", "# only words\n")),
    *((content, 1, None, "") for content in ("a,b,c\n1,2,3\n", ROWS)),
    ("No q1 x y z\n   deg mm mm mm\n 0   1  2  3  4\n", 2, None, "5 are named"),
    (MATRIX_HEAD + matrix_row(np.eye(3)) + matrix_row(np.diag([1.0, 1.0, -1.0])), 3, "r11", "determinant"),
    (MATRIX_HEAD + matrix_row(np.eye(3)) + matrix_row(np.diag([1.0, 1.0, 1.1])), 3, "r11", "orthonormal"),
    (MATRIX_HEAD + matrix_row(np.eye(3)) + matrix_row(np.zeros((3, 3))), 3, "r11", "RᵀR"),
    *((QUATERNION_HEAD + f"0.1,0.2,1,2,3,{v}\n", 2, "qw", "") for v in ("0,0,0,0", "2,0,0,0", "0.7,0,0,0")),
    (HEAD.strip() + ",roll[deg],pitch[deg]\n0.1,0.2,1,2,3,4,5\n", None, None, "without yaw"),
    (BOTH + "0.1,0.2,1,2,3,1,0,0,0,0,0,0\n0.1,0.2,1,2,3,0.70710678,0.70710678,0,0,80,0,0\n", 3, None, "10°"),
    *((f"{HEAD.strip()},{h}\n0.1,0.2,1,2,3,{v}\n", 2, h, "") for h, v in VALUES.items()),
    (f"{HEAD.strip()},torque3[Nm]\n0.1,0.2,1,2,3,4\n", None, None, ""),
    (HEAD + "0,1,0,2,1,0,2,0,3,0\n0,3,0,4,1,1,2,1,3,1\n", None, None, "marks decimals"),
    (SEMICOLONS + "0,1;0,2;1.5;2;3\n", 2, None, "decimal comma"),
    (MILLIMETRES + "0;1;1,234;2;3\n", None, None, "thousands"),
    (HEAD + '0.1,"0.2,1,2,3\n', None, None, ""),
]


@pytest.mark.parametrize(("content", "line", "column", "part"), WRONG)
def test_what_is_wrong_is_named_with_its_place(file, content, line, column, part):
    error = refusal(file(content))
    assert line is None or error.line == line
    assert column is None or error.column == column
    assert part in str(error)


@pytest.mark.parametrize(
    ("content", "part"),
    [
        *((text, "") for text in (HEAD + "0.1,0.2,,,\n0.1,0.2,1,,\n", HEAD, "x[m],y[m],z[m]\n1,2,3\n")),
        ("q1[rad],q2[rad],q3[rad],k1,k2,k3\n0,1,2,0,1,2.01\n1,3,0,1,3,0\n", "joints of one motion"),
        ("q1[rad],goal_x[m],goal_y[m],goal_z[m],dx[m],dy[m],dz[m]\n0,1,2,3,1,-1,0\n", "are deviations"),
        ("q1[rad],q2[rad],TCP X[m],TCP Y[m],TCP Z[m]\n" + ROWS, "'workbench extract'"),
        ("q1[rad],q2[rad],a1x,a1y,a1z\n" + ROWS, "(--columns)"),
        (TWICE, "say which were measured"),
        ("q1[rad],q2[rad],x[m],y[m],z[m],dX[m],dY[m],dZ[m]\n0,0,1,2,3,1,-1,0\n", "places and deviations"),
        ("J1 command[rad],J1 feedback[rad],x[m],y[m],z[m]\n" + ROWS, "no joint columns"),
    ],
)
def test_rows_that_say_nothing_of_the_arm_are_refused(file, content, part):
    assert part in str(refusal(file(content), DataError))
