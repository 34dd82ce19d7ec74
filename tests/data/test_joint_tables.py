"""Measurements whose joints stand in a table of their own."""

import numpy as np
import pytest
from refusals import refuses

import workbench as wb
from workbench.base.errors import DataError

Q = np.random.default_rng(3).uniform(-1.0, 1.0, (8, 6))
PLACES = np.random.default_rng(4).uniform(-1.0, 1.0, (8, 3))


def points(folder, names=None):
    """A tracker's list of points."""
    lines = [("point;" if names else "") + "x[mm];y[mm];z[mm]"]
    rows = [[f"{1e3 * v:.9g}" for v in place] for place in PLACES]
    lines += [";".join([*(names or [])[k : k + 1], *row]) for k, row in enumerate(rows)]
    (folder / "points.csv").write_text("\n".join(lines))
    return folder / "points.csv"


def joints(folder, rows, names=None):
    heads = [*["point"] * bool(names), *(f"q{k}[rad]" for k in range(1, 7)), "roll[rad],pitch[rad],yaw[rad]"]
    cells = ([*(names or [])[k : k + 1], *map(repr, Q[k].tolist()), "0,0,0"] for k in rows)
    (folder / "q.csv").write_text("\n".join(map(",".join, [heads, *cells])))
    return folder / "q.csv"


def test_by_name_in_any_order(tmp_path):
    names = [f"P{k}" for k in range(8)]
    order = (5, 2, 7, 0, 1, 6, 4)  # one is missing
    data = wb.read_measurements(points(tmp_path, names), joint_table=joints(tmp_path, order, names))
    kept = [0, 1, 2, 4, 5, 6, 7]
    np.testing.assert_allclose(data.q, Q[kept])
    np.testing.assert_allclose(data.position, PLACES[kept], atol=1e-9)
    assert "left out: 'P3'" in " ".join(data.notes)
    for path in (tmp_path / "points.csv", tmp_path / "q.csv"):  # a heading of both that nobody knows
        path.write_text(path.read_text().replace("point", "Name"))
    again = wb.read_measurements(tmp_path / "points.csv", joint_table=tmp_path / "q.csv")
    np.testing.assert_array_equal(again.q, data.q)
    with refuses(DataError, column="point", found="P5"):
        wb.read_measurements(points(tmp_path, names), joint_table=joints(tmp_path, (*order, 5), names))


def test_by_row_or_time(tmp_path):
    data = wb.read_measurements(points(tmp_path), joint_table=joints(tmp_path, range(8)))
    np.testing.assert_allclose(data.q, Q)
    assert data.rotation is None  # the controller's own
    with refuses(DataError, "q.csv", found=(8, 7)):
        wb.read_measurements(points(tmp_path), joint_table=joints(tmp_path, range(7)))
    # by times without a unit
    names = [f"{k}.5" for k in range(8)]
    for path in (points(tmp_path, names), joints(tmp_path, range(7, -1, -1), names)):
        path.write_text(path.read_text().replace("point", "time"))
    data = wb.read_measurements(tmp_path / "points.csv", joint_table=tmp_path / "q.csv")
    np.testing.assert_allclose(data.q, Q)


def test_by_the_number_in_names_and_several_points_of_a_posture(tmp_path):
    names = [f"pose{8 - k}" for k in range(8)]
    path = joints(tmp_path, range(8), [f"Pose_{k + 1:02d}" for k in range(8)])
    data = wb.read_measurements(points(tmp_path, names), joint_table=path)
    np.testing.assert_allclose(data.q, Q[::-1])
    names = [f"P{1 + k // 2}-{1 + k % 2}" for k in range(8)]
    path = joints(tmp_path, range(4), [f"P{k + 1}" for k in range(4)])
    data = wb.read_measurements(points(tmp_path, names), joint_table=path)
    np.testing.assert_allclose(data.markers.reshape(8, 3), PLACES, atol=1e-9)
    np.testing.assert_allclose(data.q, Q[:4])


@pytest.mark.parametrize("form", ["t.npy", "t.txt", "t.csv"])
def test_matrices_have_their_joints_in_another_table(tmp_path, form):
    poses = np.tile(np.eye(4), (8, 1, 1))
    poses[:, :3, 3] = PLACES
    if form == "t.npy":
        np.save(tmp_path / form, poses)
    elif form == "t.txt":
        np.savetxt(tmp_path / form, poses.reshape(-1, 4))
    else:
        head = ",".join(f"T{i}{j}" for i in range(1, 5) for j in range(1, 5))
        np.savetxt(tmp_path / form, poses.reshape(8, 16), delimiter=",", header=head, comments="")
    data = wb.read_measurements(tmp_path / form, joint_table=joints(tmp_path, range(8)))
    assert data.position == pytest.approx(PLACES)
    assert data.q == pytest.approx(Q)
