"""Camera and target are found from what cells have: a few points a picture, close together, or one."""

from dataclasses import replace

import camera_arms as virtual
import numpy as np
import pytest
from test_camera_fit import written

import workbench as wb
from workbench.extras.camera.rig import PictureReadings


def thinned(shots, rng, count):
    """With so many corners of each picture, those of different tags first."""
    kept = []
    for image in range(len(shots.q)):
        mine = [r for r in shots.rows if r[0] == image]
        rng.shuffle(mine)
        first = {row[2]: row for row in mine}.values()
        kept += [*first, *(r for r in mine if r not in first)][:count]
    return replace(shots, rows=kept)


def check_found(run, shots):
    fit = run.best.fit
    for owner, pose in (("camera[c0]", shots.camera[0]), ("target", shots.target)):
        at = [fit.problem.names.index(f"{owner}.{axis}") for axis in "xyz"]
        assert (np.abs(fit.x[at] - pose[:3, 3]) < 4.0 * fit.std[at] + 1e-4).all()
        assert fit.std[at].max() < 0.01


@pytest.mark.parametrize("on_tool", [False, True], ids=["eye to hand", "eye in hand"])
@pytest.mark.parametrize("count", [5, 4, 2, 1])
def test_few_points_off_one_plane(tmp_path, count, on_tool):
    rng = np.random.default_rng(count)
    arm = virtual.made(rng, "ur5")
    shots = thinned(virtual.scene(rng, arm, 40 if count < 3 else 20, on_tool=on_tool), rng, count)
    robot, data = written(tmp_path, "ur5", shots, mounted="tool" if on_tool else "world")
    assert PictureReadings.of(data).rig.rejected == ()
    check_found(wb.identify(robot, data, algorithms=("opt2",), free=(), held_out=0.0), shots)


def test_pictures_of_one_point_are_kept_beside_better_ones(tmp_path):
    """They were "1 m off", as they leave the tool's pose open."""
    rng = np.random.default_rng(6)
    arm = virtual.made(rng, "ur5", zeros=np.deg2rad(0.3))
    shots = virtual.scene(rng, arm, 20)
    few = thinned(shots, rng, 1)
    some = [r for r in few.rows if r[0] < 3] + [r for r in shots.rows if r[0] >= 3]
    robot, data = written(tmp_path, "ur5", replace(shots, rows=some))
    run = wb.identify(robot, data, algorithms=("opt2",), held_out=0.0)
    assert run.excluded == ()
    assert run.identifiability.taken


def test_a_single_row_of_a_board_places_no_camera(tmp_path):
    """Six corners on a line were "19939075.2 px" from where they should be, and lost."""
    rng = np.random.default_rng(3)
    arm = virtual.made(rng, "ur5")
    corners = [[0.03 * (k % 6), 0.03 * (k // 6), 0.0] for k in range(24)]
    eye = virtual.look([1.1, -0.4, 0.6], [0.0, 0.2, 0.3])
    held = virtual.shift(-0.07, -0.05, 0.1) @ virtual.small(rng, 0.2, 0.01)
    q = rng.uniform(-2.5, 2.5, (900, 6))
    seen = np.linalg.inv(eye) @ arm.poses(q) @ held
    uv = virtual.pixels(corners @ np.swapaxes(seen[:, :3, :3], 1, 2) + seen[:, None, :3, 3])
    inside = ((uv > 5) & (uv < virtual.SIZE - 5)).all((1, 2)) & (seen[:, 2, 3] > 0.3)
    inside &= seen[:, 2, 2] > 0.3
    q, uv = q[inside][:16], uv[inside][:16]
    uv += 0.2 * rng.normal(size=uv.shape)
    rows = [(i, "c0", k, 0, *uv[i, k]) for i in range(len(q)) for k in range(24) if i > 2 or k >= 18]
    shots = virtual.Scene(q, rows, arm.poses(q), np.array([eye]), [held])
    board = 'mounted = "tool"\n[charuco]\nsquares = [7, 5]\nsquare = 0.03\nmarker = 0.022\n'
    shots.targets[0] = held @ virtual.shift(-0.03, -0.03)
    robot, data = written(tmp_path, "ur5", shots, target=board)
    assert PictureReadings.of(data).rig.rejected == ()
    run = wb.identify(robot, data, algorithms=("opt2",), free=(), held_out=0.0)
    assert run.excluded == ()
    check_found(run, shots)


def test_points_close_together_are_not_set_apart(tmp_path):
    """Seven points within 30 mm, 1.5 m away: a linear start sees nothing of them."""
    rng = np.random.default_rng(1)
    body = rng.uniform(-0.015, 0.015, (7, 3))
    arm = virtual.made(rng, "ur5")
    eye = virtual.look([1.3, -0.4, 0.6], [0.0, 0.2, 0.3])
    target = virtual.shift(0.01, 0.02, 0.1) @ virtual.small(rng, 0.3, 0.01)
    q = rng.uniform(-2.5, 2.5, (400, 6))
    seen = np.linalg.inv(eye) @ arm.poses(q) @ target
    uv = virtual.pixels(body @ np.swapaxes(seen[:, :3, :3], 1, 2) + seen[:, None, :3, 3])
    inside = ((uv > 5) & (uv < virtual.SIZE - 5)).all((1, 2)) & (seen[:, 2, 3] > 0.4)
    q, uv = q[inside][:40], uv[inside][:40] + 0.3 * rng.normal(size=(min(40, inside.sum()), 7, 2))
    rows = [(i, "c0", k, 0, *uv[i, k]) for i in range(len(q)) for k in range(7)]
    shots = virtual.Scene(q, rows, arm.poses(q), np.array([eye]), [target])
    points = "".join(f"[[point]]\nid = {k}\nxyz = {xyz.tolist()}\n" for k, xyz in enumerate(body))
    robot, data = written(tmp_path, "ur5", shots, target='mounted = "tool"\n' + points)
    assert len(PictureReadings.of(data).rig.rejected) <= 2
    check_found(wb.identify(robot, data, algorithms=("opt2",), free=(), held_out=0.0), shots)


def test_points_that_nobody_has_measured(tmp_path):
    """Tags glued on by eye, and free ones: each comes out within its interval."""
    rng = np.random.default_rng(4)
    arm = virtual.made(rng, "ur5")
    shots = virtual.scene(rng, arm, 25)
    tags, _ = virtual.dodecahedron()
    lines = []
    for k, j in np.ndindex(tags.shape[:2]):
        more = {1: "free = true\n", 2: "sigma = 0.001\n"}.get(k, "")
        off = 0.001 * rng.normal(size=3) if k == 2 else np.zeros(3)
        xyz = "" if k == 1 else f"xyz = {(tags[k, j] + off).tolist()}\n"
        lines.append(f"[[point]]\nid = {k}\ncorner = {j}\n{xyz}{more}")
    robot, data = written(tmp_path, "ur5", shots, target='mounted = "tool"\n' + "".join(lines))
    run = wb.identify(robot, data, algorithms=("opt2",), free=(), held_out=0.0)
    check_found(run, shots)
    points = run.identifiability.json(run.best.fit)["camera"]["points"]
    assert [(p["id"], p["corner"]) for p in points] == [(k, j) for k in (1, 2) for j in range(4)]
    for point in points:
        spread = 1e-3 * np.array(point["xyz_std_mm"])
        assert (np.abs(point["xyz"] - tags[point["id"], point["corner"]]) < 4.0 * spread).all()
        assert spread.max() < 0.5e-3
