"""From targets to parts: the tool that sits in a made block stands where the plate's target is."""

from dataclasses import replace

import numpy as np
import pytest

from tests.extras.workshop.conftest import plate_of
from tests.plate.test_fixture import HALF, rng
from workbench import load_plate, load_robot, optimise_plate
from workbench.base import se3
from workbench.base.errors import OptionError
from workbench.extras.workshop.fixture import fixture_of
from workbench.extras.workshop.parts import Purpose
from workbench.plate.optimiser.target_blocks import SIDE, Blocks, block_corners, tool_poses_at
from workbench.plate.plate import Kind, Target
from workbench.session.start import default_circle


def bores(part, purpose):
    return [bore for bore in part.bores if bore.purpose is purpose]


def test_table_2_is_two_shapes():
    fixture = fixture_of(load_plate("table2"))
    numbers = {letter: [block.number for block in alike] for letter, alike in fixture.shapes.items()}
    assert numbers == {"A": [1, 3, 5, 7, 9], "B": [2, 4, 6, 8, 10]}
    assert np.allclose(np.rad2deg([alike[0].tilt for alike in fixture.shapes.values()]), [30.0, 20.0])
    assert np.allclose([b.height for b in fixture.blocks], 0.05)


def test_what_the_blocks_hold_is_the_target(made_plate, fixture):
    """Seat and index pin, the ball's centre, and the probe's tip, rebuilt from the bores alone."""
    for block, target in zip(fixture.blocks, made_plate.targets, strict=True):
        frame = made_plate.pose @ block.pose
        if target.kind is Kind.SEAT:
            (seat,), (index,) = bores(block, Purpose.SEAT), bores(block, Purpose.INDEX)
            z = frame[:3, :3] @ seat.direction
            x = frame[:3, :3] @ (index.mouth - seat.mouth)
            held = np.column_stack([x / np.linalg.norm(x), np.cross(z, x / np.linalg.norm(x)), z])
            assert np.allclose(held, target.pose[:3, :3], atol=1e-12)
            place = seat.mouth
        elif target.kind is Kind.SOCKET:
            (socket,) = bores(block, Purpose.SOCKET)
            place = socket.bottom - np.sqrt(2.0) * 0.006 * socket.direction  # a 12 mm ball in a 90° cone
        else:
            (tip,) = bores(block, Purpose.TIP)
            place = tip.bottom
        assert np.allclose(se3.apply(frame, place), target.xyz, atol=1e-12)


def test_mouths_lie_in_the_face_and_holes_meet(fixture):
    for block in fixture.blocks:
        for bore in block.bores:
            if bore.direction[2] < 0.0:
                x, _, z = bore.mouth
                assert np.isclose(z, block.height - x * np.tan(block.tilt), atol=1e-12)
        feet = [se3.apply(block.pose, b.mouth) for b in block.bores if b.direction[2] > 0.0]
        below = [b.mouth for b in fixture.slab.bores if b.label.rstrip("ab") == f"{block.number}"]
        assert np.allclose(feet, below)


@pytest.mark.parametrize("name", ["ar4", "katana450", "panda", "so101"])
def test_the_plate_that_an_arm_begins_on_can_be_made(name):
    """A Katana's targets were moved nearer until their blocks overlapped, or beyond the plate."""
    fixture = fixture_of(default_circle(load_robot(name)))
    assert len(fixture.blocks) == 10
    assert len(bores(fixture.slab, Purpose.MOUNTING)) == 4


@pytest.mark.parametrize(
    ("places", "text"),
    [
        ([(0.0, 0.0, 0.05, 1.3, 0.0, 0.0)], ("target 1", "turn")),
        ([(0.0, 0.0, 0.015, 0.1, 0.0, 0.0)], ("target 1", "raise")),
        ([(0.0, 0.0, 0.05, 0.0, 0.0, 0.0), (0.14, 0.0, 0.05, 0.0, 0.0, 0.0)], ("target 2", "edge")),
        ([(0.0, 0.0, 0.05, 0.0, 0.0, 0.0), (0.05, 0.05, 0.05, 0.2, 0.8, 0.0)], None),
        ([(0.0, 0.0, 0.05, 0.0, 0.0, 0.0), (0.03, 0.02, 0.05, 0.0, 0.0, 0.0)], ("targets 1 and 2", "move")),
        ([], ("no targets",)),
    ],
)
def test_what_cannot_be_made_is_named(places, text):
    plate = plate_of(*places)
    if text is None:
        assert len(fixture_of(plate).blocks) == len(places)
        return
    with pytest.raises(OptionError) as error:
        fixture_of(plate)
    assert all(word in str(error.value) for word in text)


def test_blocks_collide_as_they_are_made(plate):
    """The corners are those of the bars that the workshop saws."""
    places = Blocks().draw(40, HALF, rng=rng(3))
    poses = tool_poses_at(plate, places)
    for pose in poses:
        target = Target(pose[:3, 3], se3.matrix_to_rpy(pose[:3, :3]))
        block = fixture_of(replace(plate, targets=(target,))).blocks[0]
        foot = se3.apply(
            plate.pose @ block.pose,
            0.5 * SIDE * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float),
        )
        mine = block_corners(plate.pose, pose[None])[0]
        assert np.allclose(mine[:4], foot, atol=1e-9)
        heights = se3.apply(se3.inverse(plate.pose), mine[4:])[:, 2]
        assert sorted({heights.min(), heights.max()}) == pytest.approx(sorted(block.heights), abs=1e-9)


@pytest.mark.slow
def test_a_plate_that_the_search_found_can_be_made(aria, plate):
    design = optimise_plate(aria, plate, number=8, places=40, starts=1)
    assert len(fixture_of(design.plate).blocks) == 8
