"""Files that can't be measurements: one sentence with file, line and column, as the right error."""

import io
import zipfile

import numpy as np
import pytest

from workbench.base.errors import DataError, FileError, OptionError, ShapeError, UnitError
from workbench.data.readers import preview, read_measurements

HEAD = "q1[rad],q2[rad],x[m],y[m],z[m]\n"
ROWS = "0.1,0.2,1.0,2.0,3.0\n0.3,0.4,1.1,2.1,3.1\n"


@pytest.fixture
def file(tmp_path):
    def write(content, name="rows.csv"):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return write


def refusal(path, error=FileError, **options):
    """The error that reading raises; the preview must list the same sentence instead."""
    with pytest.raises(error) as caught:
        read_measurements(path, **options)
    shown = preview(path, **options)
    assert not shown.ok
    assert str(caught.value) in shown.problems
    assert "\n" not in str(caught.value)
    return caught.value


def test_missing_units_are_named_together(file):
    error = refusal(file("q1,q2[rad],x,y,z\n" + ROWS), UnitError)
    assert error.unit == ""
    assert all(part in str(error) for part in ("line 1", "'q1'", "q1[rad]", "likewise 'x', 'y', 'z'"))


@pytest.mark.parametrize("unit", ["furlongs", "flurbs", "mm", "1", ""])
def test_unknown_and_unfit_units(file, unit):
    error = refusal(file(HEAD.replace("x[m]", "x[deg]" if unit == "mm" else f"x[{unit}]") + ROWS), UnitError)
    assert error.unit == ("deg" if unit == "mm" else unit)
    assert "'x[" in str(error)


def test_wrong_number_of_joints(file):
    error = refusal(file(HEAD + ROWS), ShapeError, joints=6)
    assert (error.expected, error.found) == (6, 2)


def test_missing_joint_column(file):
    error = refusal(file("q1[rad],q3[rad],x[m],y[m],z[m]\n" + ROWS))
    assert "joint 2" in str(error)


@pytest.mark.parametrize("blank", ["", "NaN", "nan", "n/a"])
def test_missing_joint_position(file, blank):
    error = refusal(file(HEAD + ROWS + f"0.1,{blank},1,2,3\n"))
    assert (error.line, error.column) == (4, "q2[rad]")


def test_missing_joint_position_of_a_row_that_is_kept_out(file):
    data = read_measurements(
        file("q1[rad],q2[rad],x[m],y[m],z[m],exclude\n0.1,,1,2,3,true\n0.1,0.2,1,2,3,false\n")
    )
    assert data.exclude.tolist() == [True, False]


@pytest.mark.parametrize("cells", ["1,2,", ",,", "1,,3"])
def test_rows_with_gaps_in_the_observation_are_kept_out(file, cells):
    data = read_measurements(file(HEAD + ROWS + f"0.1,0.2,{cells}\n"))
    assert data.exclude.tolist() == [False, False, True]
    assert data.reason[2].startswith("lacks")
    assert any("line 4" in note and "kept out" in note for note in data.notes)


def test_a_file_of_nothing_but_gaps(file):
    refusal(file(HEAD + "0.1,0.2,,,\n0.1,0.2,1,,\n"), DataError)


@pytest.mark.parametrize("value", ["inf", "-Infinity", "1e999"])
def test_infinite_values(file, value):
    error = refusal(file(HEAD + ROWS + f"0.1,0.2,1,{value},3\n"))
    assert (error.line, error.column) == (4, "y[m]")
    assert "infinite" in str(error)


@pytest.mark.parametrize("text", ["abc", "1.2.3", "1_000", "0x10", "12 mm"])
def test_text_in_a_number_column(file, text):
    error = refusal(file(HEAD + ROWS + f"0.1,0.2,{text},2,3\n"))
    assert (error.line, error.column) == (4, "x[m]")
    assert text in str(error)


def test_text_in_the_first_data_row(file):
    error = refusal(file(HEAD + "abc,0.2,x,y,3\n" + ROWS))
    assert error.line == 2


@pytest.mark.parametrize("row", ["0.1,0.2,1.0,2.0\n", "0.1,0.2,1,2,3,4\n"])
def test_rows_of_another_length(file, row):
    error = refusal(file("# made by hand\n" + HEAD + ROWS + row))
    assert error.line == 5
    assert "5 are named" in str(error)


def test_trailing_separators_do_no_harm(file):
    data = read_measurements(file(HEAD.strip() + ",\n" + "".join(row + ",\n" for row in ROWS.split())))
    assert data.q.shape == (2, 2)


@pytest.mark.parametrize("second", ["x[m]", "x[mm]", "pos_x[m]"])
def test_columns_of_the_same_meaning(file, second):
    error = refusal(file(HEAD.strip() + f",{second}\n" + "0.1,0.2,1.0,2.0,3.0,1.0\n"))
    assert error.column == second


@pytest.mark.parametrize("gone", ["x[m]", "z[m]"])
def test_two_coordinates_of_three(file, gone):
    error = refusal(file(HEAD.replace(gone, "note") + ROWS))
    assert f"without {gone[0]}" in str(error)


@pytest.mark.parametrize(
    ("content", "error"), [("", FileError), ("\n \n", FileError), ("# only words\n", FileError)]
)
def test_empty_files(file, content, error):
    refusal(file(content), error)


def test_header_without_rows(file):
    refusal(file(HEAD), DataError)


def test_header_that_says_nothing(file):
    error = refusal(file("a,b,c\n1,2,3\n"))
    assert error.line == 1


def test_no_header(file):
    assert refusal(file(ROWS)).line == 1


def test_no_joints(file):
    refusal(file("x[m],y[m],z[m]\n1,2,3\n"), DataError)


def test_nothing_observed(file):
    refusal(file("q1[rad],q2[rad]\n0.1,0.2\n"), DataError)


def test_goals_are_no_observation(file):
    error = refusal(file("q1[rad],q2[rad],goal_x[m],goal_y[m],goal_z[m]\n" + ROWS), DataError)
    assert "nothing was observed" in str(error)


def test_missing_file_and_folder(tmp_path):
    refusal(tmp_path / "none.csv")
    refusal(tmp_path)


def test_unreadable_options(file):
    path = file(HEAD + ROWS)
    refusal(path, OptionError, layout="nonsense")
    refusal(path, OptionError, sheet="Data")
    for columns in (
        "q1[rad]",
        "",
        "=",
        "q1[rad]=nothing",
        "q1[rad|mm]=q1[rad]",
        "a,b=c",
        "q1[rad],…,x[m],y,z",
    ):
        refusal(path, OptionError, columns=columns)


def archive(name):
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as made:
        made.writestr(name, "hello")
    return buffer.getvalue()


@pytest.mark.parametrize(
    ("content", "word"),
    [
        (b"\x89PNG\r\n\x1a\n" + bytes(20), "PNG"),
        (b"%PDF-1.7\n1 0 obj", "PDF"),
        (archive("a.txt"), "zip"),
        (b"\x1f\x8b\x08" + bytes(9), "gzip"),
        (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", ".xlsx"),
        (b"\x89HDF\r\n\x1a\n" + bytes(9), "-v7"),
        (b"MATLAB 7.3 MAT-file" + bytes(200), "-v7"),
        (b"MATLAB 5.0 MAT-file" + bytes(200), "MATLAB"),
        (b"PAR1" + bytes(9), "parquet"),
        (archive("xl/workbook.xml") + b"[Content_Types].xml", "workbook"),
        (b'name = "arm"\nconvention = "dh"\n\n[[joint]]\ntheta = 0.0\nd = 0.2\n', "TOML"),
        (b'<?xml version="1.0"?>\n<robot name="arm"><link name="base"/></robot>', "URDF"),
        (b"<html><body>1,2,3</body></html>", "XML"),
        (b'{"schema": "workbench.identification/1"}', "JSON"),
        (bytes(range(256)) * 8, "text|binary"),
        (b"The quick brown fox\njumps over the lazy dog\n", "not a table"),
        ("q1[rad]\n1".encode("utf-16")[:-1], "broken"),
    ],
)
def test_files_of_another_kind(file, content, word):
    error = refusal(file(content, "thing.csv"))
    assert any(part in str(error) for part in word.split("|"))


def test_a_transform_is_no_data(file):
    assert "transform" in str(refusal(file("1 0 0 0\n0 1 0 0\n0 0 1 0\n0. 0. 0. 1.\n", "t.txt")))


MATRIX_HEAD = HEAD.strip() + "," + ",".join(f"r{i}{j}" for i in "123" for j in "123") + "\n"


def matrix_row(matrix):
    return "0.1,0.2,1,2,3," + ",".join(map(repr, np.ravel(matrix).tolist())) + "\n"


@pytest.mark.parametrize(
    ("matrix", "word"),
    [
        (np.diag([1.0, 1.0, -1.0]), "determinant"),
        (np.diag([1.0, 1.0, 1.1]), "orthonormal"),
        (np.zeros((3, 3)), "RᵀR"),
    ],
)
def test_matrices_that_are_no_rotations(file, matrix, word):
    error = refusal(file(MATRIX_HEAD + matrix_row(np.eye(3)) + matrix_row(matrix)))
    assert (error.line, error.column) == (3, "r11")
    assert word in str(error)


def test_matrices_with_few_digits_are_mended_and_said(file):
    c, s = 0.866, 0.5
    data = read_measurements(file(MATRIX_HEAD + matrix_row([[c, -s, 0], [s, c, 0], [0, 0, 1]])))
    np.testing.assert_allclose(data.rotation[0].T @ data.rotation[0], np.eye(3), atol=1e-14)
    assert any("orthonormal" in note for note in data.notes)


QUATERNION_HEAD = HEAD.strip() + ",qw,qx,qy,qz\n"


@pytest.mark.parametrize("quaternion", ["0,0,0,0", "2,0,0,0", "0.7,0,0,0"])
def test_quaternions_without_norm(file, quaternion):
    error = refusal(file(QUATERNION_HEAD + f"0.1,0.2,1,2,3,{quaternion}\n"))
    assert (error.line, error.column) == (2, "qw")


def test_quaternions_with_few_digits_are_normalised_and_said(file):
    data = read_measurements(file(QUATERNION_HEAD + "0.1,0.2,1,2,3,0.707,0.707,0,0\n"))
    np.testing.assert_allclose(data.rotation[0], [[1, 0, 0], [0, 0, -1], [0, 1, 0]], atol=1e-12)
    assert any("normalised" in note for note in data.notes)


def test_an_impossible_orientation_of_a_row_that_is_kept_out(file):
    head = QUATERNION_HEAD.strip() + ",exclude,reason\n"
    data = read_measurements(file(head + "0.1,0.2,1,2,3,0,0,0,0,true,slipped\n0.1,0.2,1,2,3,1,0,0,0,,\n"))
    assert data.reason.tolist() == ["slipped", ""]
    assert np.isnan(data.rotation[0]).all()


def test_orientation_without_all_columns(file):
    error = refusal(file(HEAD.strip() + ",roll[deg],pitch[deg]\n0.1,0.2,1,2,3,4,5\n"))
    assert "without yaw" in str(error)


BOTH = QUATERNION_HEAD.strip() + ",roll[deg],pitch[deg],yaw[deg]\n"


def test_two_forms_that_agree(file):
    data = read_measurements(file(BOTH + "0.1,0.2,1,2,3,0.70710678,0.70710678,0,0,90,0,0\n"))
    assert any("agrees" in note for note in data.notes)


def test_two_forms_that_disagree(file):
    error = refusal(
        file(BOTH + "0.1,0.2,1,2,3,1,0,0,0,0,0,0\n0.1,0.2,1,2,3,0.70710678,0.70710678,0,0,80,0,0\n")
    )
    assert error.line == 3
    assert "10°" in str(error)


@pytest.mark.parametrize(
    ("column", "value"),
    [("direction1", "2"), ("sigma_x[mm]", "-1"), ("exclude", "maybe"), ("distance[m]", "-1")],
)
def test_values_out_of_range(file, column, value):
    error = refusal(file(HEAD.strip() + f",{column}\n0.1,0.2,1,2,3,{value}\n"))
    assert (error.line, error.column) == (2, column)


def test_more_torques_than_joints(file):
    refusal(file(HEAD.strip() + ",torque3[Nm]\n0.1,0.2,1,2,3,4\n"))


# Commas that part fields or mark decimals.


def test_commas_for_both(file):
    error = refusal(file(HEAD + "0,1,0,2,1,0,2,0,3,0\n0,3,0,4,1,1,2,1,3,1\n"))
    assert "decimals too" in str(error)


def test_points_and_commas_mixed(file):
    error = refusal(file(HEAD.replace(",", ";") + "0,1;0,2;1.5;2;3\n"))
    assert error.line == 2
    assert "decimal comma" in str(error)


def test_thousands(file):
    assert "thousands" in str(
        refusal(file(HEAD.replace(",", ";").replace("[m]", "[mm]") + "0;1;1.234,5;2;3\n"))
    )
    assert "thousands" in str(
        refusal(file(HEAD.replace(",", ";").replace("[m]", "[mm]") + "0;1;1,234;2;3\n"))
    )


def test_a_quote_that_never_closes(file):
    refusal(file(HEAD + '0.1,"0.2,1,2,3\n'))
