"""Blocks, clearances, gains and readings of fixtures, against sampling and finite differences."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.random import default_rng as rng
from refusals import refuses

from workbench.base import se3
from workbench.base.errors import OptionError
from workbench.plate.measured_plate import load_plate
from workbench.plate.optimiser.capsules import capsule_arm
from workbench.plate.optimiser.search import gains
from workbench.plate.optimiser.shapes import plate_hull
from workbench.plate.optimiser.target_blocks import Blocks, tool_poses_at
from workbench.plate.tolerances import PIN_PLAY, Production

HALF = np.array([0.25, 0.2])


@pytest.fixture(scope="module")
def plate():
    turned = replace(load_plate("table2"), rpy=np.array([0.05, -0.1, 0.4]))
    return turned


def test_the_tool_points_into_the_face(plate):
    places = np.array([[0.1, 0.05, 0.07, np.deg2rad(30.0), np.deg2rad(90.0), 0.3]])
    local = se3.inverse(plate.pose) @ tool_poses_at(plate, places)[0]
    assert np.allclose(local[:3, 2], [0.0, -0.5, -np.sqrt(0.75)])
    assert np.allclose(local[:3, 3], [0.1, 0.05, 0.07])


@pytest.mark.parametrize("tilt", [0.0, 0.7])
def test_only_what_may_be_made_is_drawn(tilt):
    blocks = Blocks(heights=(0.06, 0.1), max_tilt=tilt)
    places = blocks.draw(200, HALF, rng=rng(0))
    assert (np.abs(places[:, :2]) <= HALF).all()
    assert ((places[:, 2] >= 0.06) & (places[:, 2] <= 0.1)).all()
    assert 0.9 * tilt <= places[:, 3].max() <= tilt
    assert np.allclose(blocks.makeable(places, HALF), places)


def test_an_arm_is_as_far_from_a_hull_as_its_samples_say(aria, plate):
    """Distance of a box: largest excess beyond its faces, in its own frame."""
    arm = capsule_arm(aria)
    q = rng(5).uniform(*aria.limits.T, (30, 6))
    placements = arm.placements(q)
    hull = plate_hull(plate.pose, plate.size)
    found = arm.hull_distances(placements, [hull], checked=np.ones(len(arm.pieces), bool))
    share = np.linspace(0.0, 1.0, 1500)[:, None]
    for row, distance in zip(placements, found, strict=True):
        gaps = []
        for piece in arm.pieces:
            capsule, ends = piece.solid.shape, np.outer([-1.0, 1.0], [0.0, 0.0, piece.solid.shape.halfLength])
            line = se3.apply(se3.inverse(plate.pose) @ row[piece.frame] @ piece.pose, ends)
            points = line[0] + share * (line[1] - line[0])
            points[:, 2] += 0.5 * plate.size[2]
            beyond = np.maximum(np.abs(points) - 0.5 * plate.size, 0.0)
            gaps.append(np.linalg.norm(beyond, axis=1).min() - capsule.radius)
        if min(gaps) > -0.02:
            assert distance == pytest.approx(min(gaps), abs=1e-3)
        else:
            assert distance < 0.0


def test_a_stretched_arm_is_clear_of_itself_and_a_folded_one_is_not(aria):
    arm = capsule_arm(aria)
    stretched = np.array([[0.0, 1.2, -1.4, 0.0, 0.3, 0.0]])
    folded = np.array([[0.0, 1.2, 2.2 - 2.0 * np.pi, 0.0, 0.3, 0.0]])
    assert arm.own_distances(arm.placements(stretched)).min() > 0.02
    assert arm.own_distances(arm.placements(folded)).min() < 0.0
    assert all(one.body < other.body for one, other in arm.pairs)


def test_gains_are_what_another_candidate_brings():
    blocks = rng(0).normal(size=(30, 6, 9))
    chosen = blocks[:3].reshape(-1, 9)
    information = chosen.T @ chosen + 0.01 * np.eye(9)
    root = rng(1).normal(size=(9, 9))
    weight = root @ root.T
    covariance = np.linalg.inv(information)
    expected = [
        np.trace(weight @ covariance) - np.trace(weight @ np.linalg.inv(information + b.T @ b))
        for b in blocks
    ]
    assert np.allclose(gains(blocks, covariance, weight), expected, rtol=1e-9)


def test_tall_blocks_are_less_well_known():
    """Against drawn errors: a hole off by ±a, a block turned by ±b about its foot."""
    production, height = Production(tolerance=(1e-4, 1e-3)), 0.1
    draws = rng(0).uniform(-1.0, 1.0, (200_000, 6)) * [*[1e-4] * 3, *[1e-3] * 3]
    moved = draws[:, :3] + np.cross(draws[:, 3:], [0.0, 0.0, height])
    position, rotation = production.sigma(np.array([height]))[0]
    assert position == pytest.approx(np.sqrt((moved**2).mean()), rel=0.01)
    assert rotation == pytest.approx(draws[:, 3:].std(), rel=0.01)


def test_play_of_a_probe_on_two_pins():
    """ISO 286: 6 H7 is +12/0, 6 g6 −4/−12; 3 H7 +10/0, 3 g6 −2/−8; in µm. Per axis, against drawn play."""
    shift, turn = PIN_PLAY
    assert shift == pytest.approx(12e-6)
    assert turn == pytest.approx((12e-6 + 9e-6) / 15e-3)
    draws = rng(0).uniform(-1.0, 1.0, (200_000, 3)) * [shift, shift, turn]
    position, rotation = Production(play=(shift, turn)).play_sigma
    assert position == pytest.approx(np.sqrt((draws[:, :2] ** 2).sum(1).mean() / 3.0), rel=0.01)
    assert rotation == pytest.approx(np.sqrt((draws[:, 2] ** 2).mean() / 3.0), rel=0.01)


def test_blocks_that_none_can_make():
    with refuses(OptionError, "heights must be positive and in order"):
        Blocks(heights=(0.1, 0.05))
