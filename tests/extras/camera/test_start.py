"""Camera and target are found from what cells have: four points a picture, off one plane."""

from dataclasses import replace

import camera_arms as virtual
import numpy as np
import pytest
from test_camera_fit import check_found, written

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


@pytest.mark.parametrize("on_tool", [False, True], ids=["eye to hand", "eye in hand"])
@pytest.mark.parametrize("count", [5, 4])
def test_few_points_off_one_plane(tmp_path, count, on_tool):
    rng, arm = virtual.made(count, "ur5")
    shots = thinned(virtual.scene(rng, arm, 20, on_tool=on_tool), rng, count)
    robot, data = written(tmp_path, "ur5", shots, mounted="tool" if on_tool else "world")
    assert PictureReadings.of(data).rig.rejected == ()
    run = wb.identify(robot, data, algorithms=("opt2",), free=(), held_out=0.0)
    check_found(run.best.fit, shots, 0.01, 1e-4)


def test_points_that_nobody_has_measured(tmp_path):
    """Tags glued on by eye, and free ones: each comes out within its interval."""
    rng, arm = virtual.made(4, "ur5")
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
    fit = run.best.fit
    check_found(fit, shots, 0.01, 1e-4)
    for k, j in np.ndindex(2, 4):
        at = [fit.problem.names.index(f"target.point{k + 1}_{j}.{axis}") for axis in "xyz"]
        assert (np.abs(fit.x[at] - tags[k + 1, j]) < 4.0 * fit.std[at]).all()
        assert fit.std[at].max() < 0.5e-3
