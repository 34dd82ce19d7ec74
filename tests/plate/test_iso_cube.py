"""The ISO cube: largest, its diagonal planes met, all joints moved; and what it says where there is none."""

import numpy as np

from workbench import Region
from workbench.plate.poses.iso_cube import MIN_MOVE, iso_cube_poses, largest_full, plane_points
from workbench.plate.poses.sampling import in_base

UNIT = Region(min=np.zeros(3), max=np.ones(3), cube=1.0)


def on_planes(shares):
    """Which points of the unit cube lie on one of the standard's diagonal planes."""
    x, y, z = shares.T
    return np.min(np.abs([y - z, x + z - 1.0, y + z - 1.0, x - z]), axis=0) < 1e-9


def test_cubes_of_voxels_against_brute_force():
    full = np.random.default_rng(0).uniform(size=(9, 8, 7)) < 0.93
    cubes = [(-n, place) for n in range(1, 8) for place in np.ndindex(*np.subtract(full.shape, n - 1))]
    most, first = min((n, p) for n, p in cubes if full[tuple(slice(i, i - n) for i in p)].all())
    place, edge = largest_full(full)
    assert (edge, tuple(place)) == (-most, first)


def test_the_standards_points_come_first():
    points = plane_points(UNIT, 40)
    assert on_planes(points).all()
    assert len({tuple(p.round(9)) for p in points}) == 40
    assert np.allclose(points[0], 0.5)
    corners = points[1:9]  # a tenth of the diagonal from the corners; each lies on two planes
    assert np.isin(corners.round(9), [0.1, 0.9]).all()
    assert (np.abs(points - 0.5).max(axis=1) > 0.499).sum() >= 4


def test_the_poses_stand_on_the_planes_and_move_all_joints(katana):
    poses = iso_cube_poses(katana, rng=np.random.default_rng(3))
    places = in_base(katana, poses.q)[:, :3, 3]
    shares = (places - poses.cube.min) / poses.cube.size
    assert len(shares) == 118
    assert on_planes(shares.round(6)).all()
    assert ((poses.q >= katana.limits[:, 0]) & (poses.q <= katana.limits[:, 1])).all()
    assert np.isclose(poses.min_move, np.abs(np.diff(poses.q, axis=0)).min())
    assert poses.min_move >= MIN_MOVE
