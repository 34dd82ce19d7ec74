"""Original files of public data sets, each read by the layout of its maker as its SOURCE.md says."""

import numpy as np
import pytest
from refusals import refuses
from round_trip import angle

from workbench.base.errors import DataError, FileError
from workbench.data.readers import preview, read_measurements

pytestmark = [pytest.mark.data, pytest.mark.usefixtures("read_here")]


def test_ur10_grid_series(shared_data):
    ur10 = read_measurements(shared_data / "ur10_ipa" / "measurements.csv", joints=6)
    original = read_measurements(shared_data / "ur10_ipa" / "original" / "measurements_grid.csv", joints=6)
    assert len(original) == len(ur10) == 11911
    np.testing.assert_allclose(original.q, ur10.q, atol=1e-12)
    np.testing.assert_allclose(original.position, ur10.position, atol=6e-8)
    assert angle(original.rotation, ur10.rotation).max() < 2e-8
    np.testing.assert_allclose(original.time, ur10.time, atol=0.51)
    np.testing.assert_allclose(original.temperature, ur10.temperature, atol=6e-5)
    assert original.group.tolist() == ur10.group.tolist()
    assert any("goal columns are commanded" in note for note in original.notes)


@pytest.mark.parametrize(("arm", "folder"), [("UR5", "ur5_jacobi"), ("WAM", "wam_jacobi")])
def test_targets_with_deviations(shared_data, arm, folder):
    parts = [
        read_measurements(shared_data / folder / "original" / f"3D_{arm}_uncalibrated_{part}_cleaned.csv")
        for part in ("grid", "random")
    ]
    converted = read_measurements(shared_data / folder / "measurements.csv")
    np.testing.assert_allclose(np.vstack([part.q for part in parts]), converted.q, atol=6e-11)
    np.testing.assert_allclose(np.vstack([part.position for part in parts]), converted.position, atol=6e-8)
    assert parts[0].rotation is None
    assert any("target + deviation" in note for note in parts[0].notes)


PANDAS = [f"panda_{n}" for n in ("1", "2", "2_clean", "3", "3_bis", "4", "4_clean", "6", "7")]


@pytest.mark.parametrize("robot", ["kuka_14", *PANDAS])
def test_ball_in_two_sockets(shared_data, robot):
    folder = read_measurements(shared_data / "mukca" / "original" / robot)
    converted = read_measurements(shared_data / "mukca" / robot / "measurements.csv", joints=7)
    assert sorted(folder.sessions) == sorted(converted.sessions)
    for session in folder.sessions:
        ours, theirs = (data.take(data.session == session) for data in (folder, converted))
        np.testing.assert_allclose(ours.q, theirs.q, atol=6e-10)
        np.testing.assert_allclose(ours.position, theirs.position, atol=1e-12)
        assert ours.point.tolist() == theirs.point.tolist()


def test_one_socket_file_needs_its_layout_or_columns(shared_data):
    file = shared_data / "mukca" / "original" / "panda_3" / "backcenter" / "hole_1.csv"
    with refuses(FileError, line=1):
        read_measurements(file)
    with refuses(DataError, "x[m], y[m], z[m]"):
        read_measurements(file, columns="q1[rad],…,q7[rad]")
    data = read_measurements(file, layout="mukca")
    assert data.sessions == ("backcenter",)
    assert set(data.point) == {"socket1"}


@pytest.mark.parametrize("columns", [None, "x[m],y[m],z[m],qx,qy,qz,qw"])
def test_computed_poses_are_no_measurements(shared_data, columns):
    file = shared_data / "mukca" / "original" / "panda_3" / "backcenter" / "hole_0_pose.csv"
    with refuses(FileError, "hole_0.csv and hole_1.csv"):
        read_measurements(file, columns=columns)


def test_every_original_file_is_read_or_refused(shared_data):
    files = [p for p in shared_data.glob("*/original/**/*") if p.is_file()]
    assert len(files) > 100
    for file in files[::5]:
        shown = preview(file)
        if file.name.startswith("hole") and "pose" not in file.name:
            assert "no header" in shown.problems[0]
        elif "pose" in file.name or "Trafo" in file.name:
            assert "not measurements" in shown.problems[0] or "transform" in shown.problems[0]
        else:
            assert not shown.problems


def test_the_plain_layout_can_be_forced(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("step_order,x_t,y_t,z_t,x_dif,y_dif,z_dif,joint_1\n0,1,2,3,1,1,1,90\n")
    assert read_measurements(path).position[0].tolist() == [0.002, 0.003, 0.004]
    with refuses(DataError, "nothing was observed"):
        read_measurements(path, layout="plain")
    head = ",".join(["timestamp", *(f"actual_q_{k}" for k in range(6)), "x[mm],y[mm],z[mm]"])
    path.write_text(f"{head}\n0,{'0,' * 6}1,2,3\n")
    assert read_measurements(path).position[0].tolist() == [0.001, 0.002, 0.003]  # more than a log


@pytest.mark.parametrize("vertical", ["zenith[gon]", "elevation[deg]"])
def test_polar_coordinates_are_places(vertical, tmp_path):
    down = "33.33333333333" if "gon" in vertical else "60"
    (tmp_path / "a.csv").write_text(f"q1[deg],Hz[deg],{vertical},D[mm]\n0,90,{down},2000\n")
    seen = read_measurements(tmp_path / "a.csv").position[0]
    assert seen == pytest.approx([0.0, 1.0, np.sqrt(3.0)], abs=1e-9)
    (tmp_path / "a.csv").write_text(f"q1[deg],Hz[gon],{vertical},D[mm]\n0,100,{down},2000\n")
    assert read_measurements(tmp_path / "a.csv").position[0] == pytest.approx(seen * [1, -1, 1], abs=1e-9)
    (tmp_path / "a.csv").write_text("q1[deg],azimuth,zenith,distance[mm]\n0,90,60,2000\n")
    with refuses(FileError, "the unit is missing", "azimuth[deg]"):
        read_measurements(tmp_path / "a.csv")
