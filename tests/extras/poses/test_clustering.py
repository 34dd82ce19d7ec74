"""Workspace clustering in Table 2's region: equal O, different cubes, full rank; what equal O alone is."""

from dataclasses import replace

import numpy as np
import pytest
from refusals import refuses

from workbench import Motion, identification_jacobian, tool_poses
from workbench.base.errors import DataError
from workbench.extras.poses.clustering import cluster_region
from workbench.extras.poses.pose_limits import folded
from workbench.plate.plate_toml import read_plate, write_plate
from workbench.plate.target_branches import single_branches


def ratio(robot, q):
    """σmin/σmax of the stacked, unscaled Jacobian, and the same pose by pose: eq. (17)."""
    blocks = identification_jacobian(robot, Motion(q), robot.default_free)[1]
    whole = np.linalg.svd(blocks.reshape(-1, blocks.shape[2]), compute_uv=False)
    each = np.linalg.svd(blocks, compute_uv=False)
    return whole[-1] / whole[0], each[:, -1] / each[:, 0], int((whole > 1e-9 * whole[0]).sum())


@pytest.fixture(scope="module")
def found(aria, plate):
    return cluster_region(aria, replace(plate.region, cube=0.1))


def test_ten_poses_of_equal_o_in_ten_cubes_with_full_rank(aria, plate, found):
    best = found.best
    stacked, o, rank = ratio(aria, best.q)
    assert np.allclose(best.o, o, rtol=1e-9)
    assert o.max() / o.min() - 1.0 < 1e-8
    places = tool_poses(aria, Motion(best.q))[:, :3, 3]
    corners = np.floor((places - plate.region.min) / plate.region.size * [6, 5, 3]).astype(int)
    assert plate.region.contains(places).all()
    assert len({tuple(c) for c in corners}) == 10
    assert rank == best.rank == 24
    assert best.stacked == pytest.approx(stacked)
    low, high = aria.search_limits.T
    assert ((best.q >= low) & (best.q <= high)).all()


def test_better_than_table_2_with_any_one_branch(aria, solutions, found):
    alike = single_branches(solutions).values()
    assert found.best.stacked >= max(ratio(aria, q)[0] for q in alike)
    assert found.best.value >= found.plain.value


def test_equal_o_alone_may_have_rank_six(aria, found):
    """Turning joint 1 alone changes O of no pose, and adds nothing to the rank."""
    turned = found.turned
    assert len(turned.q) == len(set(turned.cubes.tolist())) >= 2
    assert np.ptp(turned.q[:, 1:], axis=0).max() == 0.0
    assert turned.difference < 1e-9
    assert turned.rank == ratio(aria, turned.q)[2] == 6
    assert turned.stacked == 0.0


def test_its_plate_round_trips(aria, found, tmp_path):
    again = read_plate(write_plate(found.plate(), tmp_path / "cluster.toml"))
    assert np.allclose(again.poses, tool_poses(aria, Motion(found.best.q)))
    assert np.allclose(np.stack([t.q for t in again.targets]), found.best.q)


def test_what_does_not_fit_is_said(aria, plate, monkeypatch):
    monkeypatch.setattr("workbench.extras.poses.clustering.CANDIDATES", 300)
    coarse = replace(plate.region, cube=0.25)
    with refuses(DataError, 13, found=12):
        cluster_region(aria, coarse, index="O1", number=13)
    with refuses(DataError, 60, found=24):
        cluster_region(aria, plate.region, index="O1", number=60)


def test_folded_poses_are_the_same_within_limits(aria):
    q = np.random.default_rng(0).uniform(*aria.search_limits.T, (50, 6))
    near = folded(aria, q)
    assert np.allclose(tool_poses(aria, Motion(near)), tool_poses(aria, Motion(q)))
    low, high = aria.search_limits.T
    assert ((near >= low) & (near <= high)).all()
    middle = 0.5 * (low + high)
    assert (np.abs(near - middle) <= np.abs(q - middle) + 1e-12).all()
