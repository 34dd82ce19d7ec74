"""Parts of plates that were designed for what people own, as the search has them."""

import csv
import io
from dataclasses import replace

import numpy as np
import pytest

from tests.plate.test_fixture import HALF, rng
from workbench.arm.kinematics.forward import identification_jacobian
from workbench.arm.motion import Motion
from workbench.base import se3
from workbench.extras.workshop.csv_lists import distances_csv, parts_csv
from workbench.extras.workshop.fixture import fixture_of
from workbench.extras.workshop.meshes import mesh_of
from workbench.extras.workshop.parts import Purpose
from workbench.plate.design import optimise_plate
from workbench.plate.optimiser.optimise import DesignRequest
from workbench.plate.optimiser.result import PlateDesign
from workbench.plate.optimiser.target_blocks import Blocks, block_corners, tool_poses_at
from workbench.plate.plate import Kind, Target
from workbench.plate.plate_toml import read_plate, write_plate
from workbench.plate.stock import Stock
from workbench.plate.target_branches import choose_branches, plate_solutions
from workbench.plate.target_readings import linearise_targets, reading_named


def test_a_printed_cone_holds_ball_and_magnet(plate_of):
    """A ball of 12 mm, a magnet of 5 mm below it that it does not touch, in a watertight solid."""
    plate = plate_of((0.0, 0.0, 0.05, 0.4, 0.3, 0.0), kinds=("socket",))
    (block,) = fixture_of(plate, stock=Stock.named("printed")).blocks
    cone, pocket = (b for b in block.bores if b.direction[2] < 0.0)
    assert (cone.purpose, pocket.purpose) == (Purpose.SOCKET, Purpose.MAGNET)
    lowest_of_ball = 0.006 - 0.25 * 0.012  # below the face: the radius less the centre's height over it
    assert pocket.depth - 0.004 > lowest_of_ball  # a magnet 4 mm thick at the bottom stays clear of the ball
    assert mesh_of(block).is_watertight


def test_sockets_stand_over_their_screws_without_dowels(plate_of):
    """A block on a grid of holes stands on its hole, and turning it about its stud moves the ball nowhere."""
    plate = plate_of((0.05, -0.025, 0.05, 0.6, 1.1, 0.0), kinds=("socket",))
    for stock in (Stock.named("printed"), Stock.named("breadboard")):
        made = fixture_of(plate, stock=stock)
        (block,) = made.blocks
        assert np.allclose(block.pose[:2, 3], [0.05, -0.025], atol=1e-12)
        assert not any(bore.purpose is Purpose.DOWEL for bore in (*block.bores, *made.slab.bores))
        assert [bore.purpose for bore in made.probe.bores[:2]] == [Purpose.SOCKET, Purpose.MAGNET]
        assert "dowel" not in parts_csv(made)


def test_balls_have_no_spin_that_would_make_shapes(aria, plate):
    """Blocks that differ by the tool's turn about their axis alone are one shape, as the drawings have it."""
    turned = tuple(
        replace(
            t,
            kind=Kind.SOCKET,
            xyz=plate.targets[0].xyz + np.array([0.06 * i, 0.0, 0.0]),
            rpy=np.array([np.pi, 0.0, i]),
        )
        for i, t in enumerate(plate.targets[:3])
    )
    design = PlateDesign(plate=replace(plate, targets=turned), cost=1e-4, rotation=np.inf, start_cost=1e-4)
    assert design.plate_shapes == 1 == len(fixture_of(replace(design.plate, size=None)).shapes)
    seats = tuple(replace(t, kind=Kind.SEAT) for t in turned)
    assert replace(design, plate=replace(plate, targets=seats)).plate_shapes == 3


def test_a_ball_bar_plate_is_three_sockets_and_the_lengths_of_its_bar(aria, plate, tmp_path):
    """Its targets are places in the air: only the anchors are made, and each target is read by distances."""
    anchors = reading_named("ball-bar", aria, plate).anchors
    in_air = tuple(replace(target, kind=Kind.POINT) for target in plate.targets)
    bar = read_plate(write_plate(replace(plate, targets=in_air, anchors=anchors), tmp_path / "bar.toml"))
    assert np.allclose(bar.anchors, anchors)
    made = fixture_of(bar, stock=Stock.named("ball-bar"))
    assert len(made.blocks) == 3
    for block, place in zip(made.blocks, anchors, strict=True):
        (cone, *_) = block.bores
        held = block.pose @ [*(cone.bottom - np.sqrt(2.0) * 0.006 * cone.direction), 1.0]
        assert np.allclose(held[:3], place, atol=1e-12)
    assert all(mesh_of(block).is_watertight for block in made.blocks)
    first = next(csv.DictReader(io.StringIO(distances_csv(bar))))
    distance = np.linalg.norm(bar.poses[0, :3, 3] - bar.pose[:3, 3] - anchors[0])
    assert float(first["distance[mm]"]) == pytest.approx(1e3 * distance, abs=1e-3)
    assert "ball-bar, telescoping" in parts_csv(made)
    q = choose_branches(aria, plate, plate_solutions(aria, plate), goal="O1", rng=np.random.default_rng(0)).q
    rows = linearise_targets(aria, bar, q, sigma=(5e-6, 1e-3), additive=True)
    _, twists = identification_jacobian(aria, Motion(q), rows.names)
    assert rows.jacobian.shape == (30, len(rows.names))
    assert np.allclose(rows.jacobian[1] * rows.sigma[1], bar.from_anchors[0, 1] @ twists[0, :3])
    assert np.allclose(rows.sigma, np.hypot(5e-6, 5e-5))


def test_blocks_collide_as_they_are_made(plate):
    """The corners are those of the bars that the workshop saws."""
    places = Blocks().draw(40, HALF, rng=rng(3))
    poses = tool_poses_at(plate, places)
    for pose in poses:
        target = Target(pose[:3, 3], se3.matrix_to_rpy(pose[:3, :3]))
        block = fixture_of(replace(plate, targets=(target,))).blocks[0]
        foot = se3.apply(
            plate.pose @ block.pose,
            0.5 * block.side * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float),
        )
        mine = block_corners(plate, pose[None])[0]
        assert np.allclose(mine[:4], foot, atol=1e-9)
        heights = se3.apply(se3.inverse(plate.pose), mine[4:])[:, 2]
        assert sorted({heights.min(), heights.max()}) == pytest.approx(sorted(block.heights), abs=1e-9)


def test_a_plate_that_the_search_found_can_be_made(aria, plate):
    design = optimise_plate(aria, plate, request=DesignRequest(number=8, places=40, starts=1, shapes=2))
    made = fixture_of(design.plate)
    assert len(made.blocks) == 8
    assert len(made.shapes) <= 2
