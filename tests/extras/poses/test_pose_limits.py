"""Poses that keep limits in pairs and one by one, conflicts that are named."""

import tomllib
from pathlib import Path

import numpy as np
import pytest
from numpy.random import default_rng as rng
from points_and_tilts import frames
from refusals import refuses

from workbench import Motion, PoseLimits, load_robot, tool_poses
from workbench.base.errors import DataError, OptionError
from workbench.extras.poses.informative_poses import informative_poses
from workbench.plate.free_constants import identified_names
from workbench.plate.poses.sampling import random_poses


@pytest.mark.parametrize("index", ["O", "O3", "I"])
def test_all_limits_are_kept_and_the_set_is_better_than_its_start(aria, plate, index):
    limits = PoseLimits(region=plate.region, margin=0.1)
    found = informative_poses(aria, 8, index=index, limits=limits, rng=rng(1))
    poses = tool_poses(aria, Motion(found.q))
    assert plate.region.contains(poses[:, :3, 3]).all()
    low, high = aria.limits.T
    assert np.minimum(found.q - low, high - found.q).min() >= 0.1 - 1e-12
    assert found.after > found.before


def test_candidates_beyond_the_limits_are_not_taken(aria):
    candidates = np.vstack([random_poses(aria, 80, rng=rng(2)), np.full((1, 6), 9.0)])
    for index in ("O", "O5"):
        found = informative_poses(aria, 6, index=index, candidates=candidates, rng=rng(3))
        assert len({tuple(row) for row in found.q} & {tuple(row) for row in candidates[:-1]}) == 6


def test_poses_for_a_free_base_and_tool(aria):
    """The index is of what can be seen at all: 30 combinations of 36 constants, five poses at least."""
    names = identified_names(aria, base=True, tool=True)
    found = informative_poses(aria, 6, names=names, rng=rng(8))
    assert found.after > found.before > 0.0
    with refuses(OptionError, "at least 5 poses", option="number", found=4):
        informative_poses(aria, 4, names=names, rng=rng(8))


def test_an_arm_keeps_above_the_table_that_it_stands_on():
    """The places of a UR10's joints by other code: the elbow of half of all postures would hit the table."""
    table = tomllib.loads((Path(__file__).parents[3] / "assets/robots/ur10.toml").read_text())["joint"]
    rows = np.array([[joint[key] for key in ("theta", "d", "a", "alpha")] for joint in table])
    found = informative_poses(load_robot("ur10"), 12, limits=PoseLimits(clearance=0.02), rng=rng(2))
    assert min(at[:, 2, 3].min() for at in frames(rows, found.q)[1:]) > 0.02


def test_conflicts_are_named(aria, plate):
    zeros = np.zeros((9, 6))
    with refuses(DataError, found=0):
        informative_poses(aria, 4, candidates=zeros, limits=PoseLimits(region=plate.region), rng=rng(16))
    with refuses(OptionError, option="margin"):
        PoseLimits(margin=-0.1)
    with refuses(OptionError, option="limits"):
        informative_poses(aria, 6, index="I", rng=rng(17))
