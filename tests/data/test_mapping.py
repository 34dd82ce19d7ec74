"""Meanings of columns by their headings, and by the names of joints."""

import json

import numpy as np
import pytest
from refusals import refuses

import workbench as wb
from workbench.base.errors import OptionError
from workbench.data.readers.read import preview
from workbench.views.page.panels.data import understood_as


def test_columns_are_said_by_their_headings(tmp_path, run):
    text = "Achse 1 [deg],Unbekannt,y[mm],z[mm],Halle,temp[degC]\n90,1,2,3,4,20\n45,1,2,4,5,21\n"
    (tmp_path / "a.csv").write_text(text)
    columns = understood_as(preview(tmp_path / "a.csv"))
    assert (columns["Achse 1 [deg]"], columns["Unbekannt"]) == ("q1[deg]", "-")
    columns |= {"Unbekannt": "x[cm]", "temp[degC]": "-"}
    data = wb.read_measurements(tmp_path / "a.csv", columns=columns)
    np.testing.assert_allclose(data.q[:, 0], np.deg2rad([90, 45]))
    np.testing.assert_allclose(data.position, [[1e-2, 2e-3, 3e-3], [1e-2, 2e-3, 4e-3]])
    assert data.temperature is None
    assert run("preview", "a.csv")[0] == 1  # there is no x
    assert run("preview", "a.csv", "--columns", json.dumps(columns))[0] == 0
    with refuses(OptionError, "Unbekannt=nothing"):
        wb.read_measurements(tmp_path / "a.csv", columns=columns | {"Unbekannt": "nothing[m]"})


NAMES = ("turn", "shoulder_joint", "elbow")


@pytest.mark.parametrize(
    "header", ["turn[deg],shoulder[deg],elbow[deg]", "Turn [deg],Shoulder-Joint [deg],elbow[deg]"]
)
def test_columns_called_as_the_robots_joints_are_those_joints(header, tmp_path):
    (tmp_path / "a.csv").write_text(f"x[mm],{header},y[mm],z[mm]\n1,90,45,30,2,3\n4,-90,10,20,5,6\n")
    data = wb.read_measurements(tmp_path / "a.csv", joints=NAMES)
    np.testing.assert_allclose(np.rad2deg(data.q), [[90, 45, 30], [-90, 10, 20]])
    np.testing.assert_allclose(data.position, 1e-3 * np.array([[1, 2, 3], [4, 5, 6]]))
    said = wb.read_measurements(tmp_path / "a.csv", joints=NAMES, columns={"x[mm]": "x[mm]"})
    assert (said.q == data.q).all()
    shown = preview(tmp_path / "a.csv", joints=NAMES).columns
    assert [c.heading for c in shown[1:4]] == header.split(",")
    assert [c.key for c in shown[1:4]] == ["q1", "q2", "q3"]


def test_joints_are_named_above_a_row_of_units(tmp_path):
    rows = "name0,position0,name1,position1,x,y,z\n,rad,,rad,mm,mm,mm\nb,1,a,2,3,4,5\n"
    (tmp_path / "a.csv").write_text(rows)
    assert wb.read_measurements(tmp_path / "a.csv", joints=("a", "b")).q.tolist() == [[2.0, 1.0]]
