"""The cuboid and its cubes."""

from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from refusals import refuses

from workbench.base.errors import OptionError
from workbench.plate.plate_toml import load_plate
from workbench.plate.region import Region
from workbench.plate.region_poses import plate_region_poses


def region(cube=0.05) -> Region:
    return Region(min=np.array([0.05, 0.10, 0.15]), max=np.array([0.60, 0.60, 0.45]), cube=cube)


def test_table_2_has_660_cubes_of_5_cm():
    assert region().shape == (11, 10, 6)
    assert region().cubes == len(region().centres) == 660
    assert np.allclose(region().centres[0], [0.075, 0.125, 0.175])
    assert np.allclose(region().centres[1], [0.075, 0.125, 0.225])


def test_cubes_shrink_where_they_do_not_divide_an_edge():
    assert region(0.1).shape == (6, 5, 3)
    assert region(5.0).shape == (1, 1, 1)


def test_contains_its_faces():
    points = np.array([[0.05, 0.10, 0.15], [0.60, 0.60, 0.45], [0.61, 0.3, 0.3], [0.3, 0.3, 0.1]])
    assert region().contains(points).tolist() == [True, True, False, False]
    assert region().cells(points).tolist() == [0, 659, -1, -1]


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


def test_whole_numbers_are_lengths_too(aria):
    plate = replace(load_plate("table2"), region=Region(min=np.array([0, -1, 0]), max=np.array([1, 1, 1])))
    as_floats = replace(plate, region=Region(min=np.array([0.0, -1.0, 0.0]), max=np.array([1.0, 1.0, 1.0])))
    assert plate.region.min.dtype == float
    assert plate_region_poses(aria, plate, 3).tolist() == plate_region_poses(aria, as_floats, 3).tolist()
