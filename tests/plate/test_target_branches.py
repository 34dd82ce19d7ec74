"""Branches of the Table 2 plate, poses that matter, and the difference that a mix of branches makes."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.random import default_rng as rng
from refusals import refuses

from workbench import Motion, Target, tool_poses
from workbench.arm.linearisation import linearise
from workbench.base import se3
from workbench.base.errors import DataError
from workbench.plate.plate import Kind
from workbench.plate.poses.sampling import in_base
from workbench.plate.predicted_error import predicted_error
from workbench.plate.region_poses import nearby_poses, region_poses
from workbench.plate.target_branches import choose_branches, plate_solutions, single_branches


@pytest.fixture(scope="module")
def everywhere(aria, plate):
    """Any place and branch, orientations within 60° of the targets'."""
    return region_poses(
        aria, plate.region, 60, rng=rng(1), towards=plate.poses[:, :3, :3], cone=np.deg2rad(60.0)
    )


def test_a_good_mix_of_branches_beats_every_single_one_sevenfold(aria, plate, solutions, everywhere):
    """At 0.1 mm / 0.02°: 1.2–1.5 mm with one branch for all ten targets, about 0.16 mm mixed."""
    choice = choose_branches(aria, plate, solutions, goal=everywhere, rng=rng(2))
    single = np.array(list(choice.single.values())) * 1e3
    assert ((single > 1.0) & (single < 1.8)).all()
    assert choice.cost * 1e3 == pytest.approx(0.157, abs=0.015)
    assert min(single) > 7 * choice.cost * 1e3
    error = predicted_error(linearise(aria, choice.q), aria, everywhere)
    assert error.position_rms == pytest.approx(choice.cost, rel=1e-6)
    near = nearby_poses(aria, plate.region, 200, rng=rng(3), measured=choice.q)
    local = predicted_error(linearise(aria, choice.q), aria, near)
    assert local.position_mean < 0.16e-3
    assert local.rotation_mean < np.deg2rad(0.026)


def test_an_unreachable_target_is_named(aria, plate):
    far = replace(plate, targets=(*plate.targets[:2], Target(np.array([3.0, 0.0, 0.0]))))
    with refuses(DataError, "'Table 2'", target=2):
        plate_solutions(aria, far)


def test_sockets_leave_orientation_open_not_the_position(aria, plate, solutions, everywhere):
    """Turning the last frame about the tool point moves no ball: the position error stays finite."""
    sockets = replace(plate, targets=tuple(replace(t, kind=Kind.SOCKET) for t in plate.targets))
    seats, choice = (
        choose_branches(aria, p, solutions, goal=everywhere, rng=rng(0)) for p in (plate, sockets)
    )
    assert seats.cost < choice.cost < np.inf
    full = linearise(aria, choice.q)
    rows = np.arange(len(full.sigma)) % 6 < 3
    chosen = replace(
        full, jacobian=full.jacobian[rows], sigma=full.sigma[rows], measurement=full.measurement[rows]
    )
    assert chosen.rank() < 24
    assert np.isinf(predicted_error(chosen, aria, everywhere).rotation_rms)
    assert choice.cost == pytest.approx(predicted_error(chosen, aria, everywhere).position_rms, rel=1e-6)


def test_a_designed_socket_is_measured_at_its_own_joint_angles(aria, plate, solutions, everywhere):
    """Such plates could not be scored: a free orientation has other branches than the designed one."""
    q = choose_branches(aria, plate, solutions, goal=everywhere, rng=rng(0))
    there = plate.with_joints(q.q, q.branches)
    sockets = replace(there, targets=tuple(replace(t, kind=Kind.SOCKET) for t in there.targets))
    found = [own[0] for own in plate_solutions(aria, sockets)]
    assert np.allclose([branch.q for branch in found], q.q, atol=1e-6)
    assert tuple(branch.name for branch in found) == q.branches


def test_poses_that_matter_lie_in_region_and_cone(aria, plate, solutions, everywhere):
    low, high = aria.limits.T
    tools = in_base(aria, everywhere)
    assert plate.region.contains(tools[:, :3, 3] * (1 - 1e-9)).mean() > 0.97
    gaps = se3.matrix_to_rotvec(tools[:, None, :3, :3] @ np.swapaxes(plate.poses[None, :, :3, :3], -1, -2))
    assert np.linalg.norm(gaps, axis=-1).min(1).max() <= np.deg2rad(60.0) + 1e-6
    assert ((everywhere >= low - 1e-9) & (everywhere <= high + 1e-9)).all()
    measured = next(iter(single_branches(solutions).values()))
    near = nearby_poses(aria, plate.region, 40, rng=rng(4), measured=measured)
    tools = tool_poses(aria, Motion(near))
    gaps = se3.matrix_to_rotvec(tools[:, None, :3, :3] @ np.swapaxes(plate.poses[None, :, :3, :3], -1, -2))
    assert np.linalg.norm(gaps, axis=-1).min(1).max() <= np.deg2rad(20.0) + 1e-6
