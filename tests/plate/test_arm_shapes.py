"""An arm's clearance by the meshes of its URDF, and by capsules where it has none."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from checks import DESCRIPTIONS
from numpy.random import default_rng as rng
from scipy.spatial import cKDTree

from workbench import Frame, Motion, link_frames, load_robot
from workbench.base import se3
from workbench.plate.optimiser.capsules import capsule_arm
from workbench.plate.optimiser.meshes import arm_shape, mesh_arm
from workbench.plate.optimiser.shapes import plate_hull

NAMES = ("base", "shoulder", "upperarm", "forearm", "wrist1", "wrist2", "wrist3")
SPACING = 0.008
"""Farthest that a point of a link is from one of its samples [m]."""


UR5 = DESCRIPTIONS / "ur_description"


@pytest.fixture(scope="module")
def ur5():
    return load_robot(UR5 / "urdf" / "ur5_robot.urdf", tip="tool0")


@pytest.fixture(scope="module")
def arm(ur5):
    found = mesh_arm(ur5, 0.01)
    assert found is not None
    return found


@pytest.fixture(scope="module")
def q(ur5):
    return rng(2).uniform(-2.0, 2.0, (3, 6))


@pytest.fixture(scope="module")
def samples(ur5, q):
    """Points on every link's collision mesh in every posture, read without Pinocchio."""
    frames = link_frames(ur5, Motion(q))
    clouds = []
    for body, name in enumerate(NAMES):
        mesh = trimesh.load(UR5 / "meshes" / "ur5" / "collision" / f"{name}.stl", force="mesh")
        points = np.concatenate([mesh.vertices, trimesh.sample.sample_surface_even(mesh, 6_000, seed=1)[0]])
        clouds.append(se3.apply(frames[:, None, body + 1], points))
    return clouds


def beyond(points, plate):
    """Distance of points from a plate's box."""
    local = se3.apply(se3.inverse(plate.pose), points) + 0.5 * plate.size * [0.0, 0.0, 1.0]
    return np.linalg.norm(np.maximum(np.abs(local) - 0.5 * plate.size, 0.0), axis=-1)


def test_meshes_are_as_far_from_the_plate_as_their_samples_say(arm, q, samples, plate):
    hull = plate_hull(plate.pose, plate.size)
    for body in range(len(NAMES)):
        found = arm.hull_distances(arm.placements(q), [hull], checked=arm.bodies == body)
        sampled = beyond(samples[body], plate).min(1)
        assert (found <= sampled + 1e-9).all()
        assert (found >= sampled - SPACING).all()


def test_links_are_as_far_apart_as_their_samples_say(arm, q, samples):
    placements = arm.placements(q)
    for row in range(len(q)):
        trees = [cKDTree(cloud[row]) for cloud in samples]
        for pair in arm.pairs:
            i, j = (arm.pieces.index(piece) for piece in pair)
            found = replace(arm, pairs=(pair,)).own_distances(placements[row : row + 1])[0]
            sampled = trees[i].query(samples[j][row])[0].min()
            assert sampled - 2.0 * SPACING <= found <= sampled + 1e-9


def test_what_only_tells_whether_the_clearance_is_kept_agrees_with_the_distances(arm, plate):
    placements = arm.placements(rng(3).uniform(-3.0, 3.0, (200, 6)))
    every, hulls = np.ones(len(arm.pieces), bool), [plate_hull(plate.pose, plate.size)]
    for measure in (arm.own_distances, lambda *a, **k: arm.hull_distances(*a, hulls, checked=every, **k)):
        exact = measure(placements)
        quick = measure(placements, minimum=0.01)
        assert ((exact >= 0.01) == (quick >= 0.01)).all()
        assert 0 < (exact < 0.01).sum() < len(exact)


def test_neighbours_are_not_checked_and_the_flange_is_the_probe(arm):
    assert min(abs(a.body - b.body) for a, b in arm.pairs) == 2
    assert len(arm.pairs) == 15
    assert arm.probes.tolist() == [False] * 6 + [True]


def test_a_sphere_about_a_mesh_has_all_of_it_inside(arm):
    for piece in arm.pieces:
        centre, radius = piece.solid.sphere
        assert np.linalg.norm(piece.solid.shape.vertices() - centre, axis=1).max() <= radius + 1e-9


def test_a_tool_beyond_the_flange_is_a_slender_probe(ur5):
    long = ur5.with_frames(tool=Frame(xyz=np.array([0.0, 0.03, 0.15])))
    found = mesh_arm(long, 0.01)
    assert found.probes.tolist() == [False] * 7 + [True]
    tip = link_frames(long, Motion(np.zeros((1, 6))))[0, -1, :3, 3]
    rod = found.pieces[-1]
    shape, at = rod.solid.shape, found.placements(np.zeros((1, 6)))[0, rod.frame] @ rod.pose
    end = np.array([0.0, 0.0, shape.halfLength + shape.radius])
    assert se3.apply(at, end) == pytest.approx(tip, abs=1e-9)


def test_primitives_of_a_urdf_are_exact(tmp_path):
    shapes = {
        "a": '<box size="0.1 0.1 0.1"/>',
        "b": '<sphere radius="0.05"/>',
        "c": '<cylinder radius="0.05" length="0.2"/>',
        "d": '<box size="0.02 0.02 0.02"/>',
    }
    links = "".join(
        f'<link name="{n}"><collision><geometry>{s}</geometry></collision></link>' for n, s in shapes.items()
    )
    joints = "".join(
        f'<joint name="{a}{b}" type="revolute"><parent link="{a}"/><child link="{b}"/>'
        '<origin xyz="0 0 0.5"/><axis xyz="0 1 0"/>'
        '<limit lower="-2" upper="2" effort="1" velocity="1"/></joint>'
        for a, b in ("ab", "bc", "cd")
    )
    path = tmp_path / "stack.urdf"
    path.write_text(f'<robot name="stack">{links}{joints}</robot>')
    arm = mesh_arm(load_robot(path), 0.01)
    placements = arm.placements(np.array([[0.0, 0.0, 0.0], [0.0, 0.5 * np.pi, 0.0]]))
    apart = [0.85, np.hypot(0.49, 0.49) - 0.05]
    assert arm.own_distances(placements) == pytest.approx(apart, abs=1e-6)
    lowest = arm.lowest(placements)
    assert lowest[:, 1] == pytest.approx([0.45, 0.45], abs=1e-9)
    assert lowest[:, 2] == pytest.approx([0.9, 0.95], abs=1e-4)


def test_a_urdf_without_its_meshes_is_capsules_and_says_so(tmp_path):
    alone = tmp_path / "alone.urdf"
    alone.write_bytes((UR5 / "urdf" / "ur5_robot.urdf").read_bytes())
    arm = arm_shape(load_robot(alone, tip="tool0"), 0.01)
    assert "capsules" in arm.source
    assert "alone.urdf" in arm.source
    table = load_robot("ur5")
    assert arm_shape(table, 0.01).source == capsule_arm(table).source
