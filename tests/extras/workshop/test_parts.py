"""From targets to parts: the tool that sits in a made block stands where the plate's target is."""

import numpy as np
import pytest

from workbench.arm.built_in_arms import load_robot
from workbench.base import se3
from workbench.base.errors import OptionError
from workbench.extras.workshop.fixture import fixture_of
from workbench.extras.workshop.parts import Purpose
from workbench.plate.plate import Kind
from workbench.plate.plate_toml import load_plate
from workbench.plate.stock import Stock
from workbench.session.start import default_circle


def bores(part, purpose):
    return [bore for bore in part.bores if bore.purpose is purpose]


def test_table_2_is_two_shapes():
    fixture = fixture_of(load_plate("table2"))
    assert [(s.letter, s.numbers) for s in fixture.shapes] == [
        ("A", (1, 3, 5, 7, 9)),
        ("B", (2, 4, 6, 8, 10)),
    ]
    assert np.allclose(np.rad2deg([s.block.tilt for s in fixture.shapes]), [30.0, 20.0])
    assert np.allclose([b.height for b in fixture.blocks], 0.05)


def test_what_the_blocks_hold_is_the_target(made_plate, fixture):
    """Seat and index pin, the ball's centre, and the probe's tip, rebuilt from the bores alone."""
    for block, target in zip(fixture.blocks, made_plate.targets, strict=True):
        frame = fixture.pose @ block.pose
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


def test_a_plate_without_size_is_large_enough(plate_of):
    plate = plate_of((0.1, 0.0, 0.05, 0.2, 0.3, 0.0), (-0.1, 0.06, 0.05, 0.2, 2.0, 0.0), size=None)
    fixture = fixture_of(plate)
    for block in fixture.blocks:
        assert (np.abs(block.footprint) <= 0.5 * fixture.slab.size[:2] - Stock().margin + 1e-9).all()
    assert "no size" in fixture.notes[0]


def test_mounting_holes_keep_clear_of_blocks(plate_of):
    fixture = fixture_of(plate_of((0.12, 0.07, 0.05, 0.0, 0.0, 0.0)))
    kept = bores(fixture.slab, Purpose.MOUNTING)
    assert len(kept) == 4  # the one under the block stands beside it, on the same edge
    (moved,) = (b.mouth[:2] for b in kept if (b.mouth[:2] > 0.0).all())
    assert np.isclose(moved, [0.13, 0.08]).sum() == 1
    assert np.abs(moved - [0.12, 0.07]).max() >= 0.5 * Stock().side
    assert "left out" not in " ".join(fixture.notes)


@pytest.mark.parametrize("name", ["ar4", "katana450", "panda", "so101"])
def test_the_plate_that_an_arm_begins_on_can_be_made(name):
    """A Katana's targets were moved nearer until their blocks overlapped, or beyond the plate."""
    fixture = fixture_of(default_circle(load_robot(name)))
    assert len(fixture.blocks) == 10
    assert len(bores(fixture.slab, Purpose.MOUNTING)) == 4


def test_stand_offs_reach_down_to_the_foot_of_an_arm_whose_base_is_above_it():
    """A Katana's plate lies below its base's origin: it was said to be under the robot's foot."""
    katana = load_robot("katana450")
    plate = default_circle(katana)
    assert fixture_of(plate).standoff is None
    post = fixture_of(plate, robot=katana).standoff
    height = plate.xyz[2] - plate.size[2] + katana.base.xyz[2]
    assert sum(length for _, length in post.steps) == pytest.approx(height)


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
def test_what_cannot_be_made_is_named(places, text, plate_of):
    plate = plate_of(*places)
    if text is None:
        assert len(fixture_of(plate).blocks) == len(places)
        return
    with pytest.raises(OptionError) as error:
        fixture_of(plate)
    assert all(word in str(error.value) for word in text)


def test_the_least_height_is_enough(plate_of):
    """The height that the message asks for can be made, and 0.1 mm less can't."""
    with pytest.raises(OptionError) as error:
        fixture_of(plate_of((0.0, 0.0, 0.02, 0.4, 0.0, 0.3)))
    minimum = float(str(error.value).split("needs ")[1].split(" mm")[0]) * 1e-3
    fixture_of(plate_of((0.0, 0.0, minimum + 5e-5, 0.4, 0.0, 0.3)))
    with pytest.raises(OptionError):
        fixture_of(plate_of((0.0, 0.0, minimum - 1e-4, 0.4, 0.0, 0.3)))
