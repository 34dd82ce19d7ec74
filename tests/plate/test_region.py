"""The cuboid and its cubes."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from refusals import refuses

from workbench import Frame, Region
from workbench.base.errors import DataError, OptionError
from workbench.plate.poses.sampling import in_base, random_poses


def region(cube=0.05) -> Region:
    return Region(min=np.array([0.05, 0.10, 0.15]), max=np.array([0.60, 0.60, 0.45]), cube=cube)


def test_table_2_has_660_cubes_of_5_cm():
    assert region().shape == (11, 10, 6)
    assert region().cubes == len(region().centres) == 660
    assert np.allclose(region().centres[0], [0.075, 0.125, 0.175])
    assert np.allclose(region().centres[1], [0.075, 0.125, 0.225])


@given(cube=st.floats(0.02, 0.4), seed=st.integers(0, 100))
def test_centres_lie_in_their_own_cubes_and_samples_in_the_region(cube, seed):
    box = region(cube)
    assert np.array_equal(box.cells(box.centres), np.arange(box.cubes))
    assert box.contains(box.sample(20, rng=np.random.default_rng(seed))).all()


def test_bad_regions():
    with refuses(OptionError, option="max", found="y"):
        Region(min=np.array([0.0, 0.3, 0.0]), max=np.array([1.0, 0.2, 1.0]))
    with refuses(OptionError, option="cube", found=0.0):
        region(0.0)


def test_random_poses_in_a_region_of_a_base_elsewhere(aria):
    box = Region(min=np.array([0.05, 0.10, 0.15]), max=np.array([0.60, 0.60, 0.45]))
    turned = aria.with_frames(base=Frame(np.array([5.0, 1.0, 0.0]), np.diag([-1.0, -1.0, 1.0])))
    q = random_poses(turned, 30, rng=np.random.default_rng(0), region=box)
    assert box.contains(in_base(turned, q)[:, :3, 3]).all()
    assert np.array_equal(q, random_poses(aria, 30, rng=np.random.default_rng(0), region=box))
    far = Region(min=np.full(3, 5.0), max=np.full(3, 6.0))
    with refuses(DataError, "[5.0, 5.0, 5.0] to [6.0, 6.0, 6.0]", "0 of 12000"):
        random_poses(aria, 1, rng=np.random.default_rng(0), region=far)
