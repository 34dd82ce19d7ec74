"""Plates on what people own: what can be bought, what it costs and brings, and the choice between them."""

import json

import numpy as np
import pytest

from workbench.base.errors import OptionError
from workbench.plate.optimiser.makings import MANNERS
from workbench.plate.optimiser.target_blocks import Blocks, places_of
from workbench.plate.parts.fixture import fixture_of
from workbench.plate.parts.parts import Purpose
from workbench.plate.parts.solids import block_mesh
from workbench.plate.parts.stock import Stock
from workbench.plate.plate_toml import read_plate
from workbench.plate.tradeoff import weigh_choices


def test_blocks_on_a_breadboard_stand_on_its_holes():
    blocks = MANNERS["breadboard"].blocks(Blocks())
    places = blocks.draw(400, np.array([0.27, 0.17]), rng=np.random.default_rng(0))
    steps = places[:, :2] / 0.025
    assert np.allclose(steps, steps.round())
    assert (np.abs(places[:, :2]) <= [0.27, 0.17]).all()
    assert set(places[:, 2].round(6)) <= {0.05, 0.075, 0.1}
    assert set(np.rad2deg(places[:, 3]).round(6)) <= {0.0, 30.0, 45.0}
    assert np.allclose(places[:, 4:] / (0.5 * np.pi), (places[:, 4:] / (0.5 * np.pi)).round())
    assert blocks.fit(places, np.array([0.27, 0.17])).all()
    steep = places[:, 3] > 0.7
    assert (places[steep, 2] >= 0.023 + 0.012 - 1e-9).all()
    with pytest.raises(OptionError, match="grid"):
        Blocks(grid=-0.1)


def test_a_printed_cone_holds_ball_and_magnet(plate_of):
    """A ball of 12 mm, a magnet of 5 mm below it that it does not touch, in a watertight solid."""
    plate = plate_of((0.0, 0.0, 0.05, 0.4, 0.3, 0.0), kinds=("socket",))
    (block,) = fixture_of(plate, stock=Stock.printed()).blocks
    cone, pocket = (b for b in block.bores if b.direction[2] < 0.0)
    assert (cone.purpose, pocket.purpose) == (Purpose.SOCKET, Purpose.MAGNET)
    lowest_of_ball = 0.006 - 0.25 * 0.012  # below the face: the radius less the centre's height over it
    assert pocket.depth - 0.004 > lowest_of_ball  # a magnet 4 mm thick at the bottom stays clear of the ball
    assert block_mesh(block).is_watertight


def test_choices_and_their_front(aria, plate):
    found = weigh_choices(aria, plate, numbers=(8,), manners=("machined", "printed"), places=60)
    assert found.choices[0].manner == "printed"
    assert {c.shapes for c in found.choices if c.manner == "machined"} >= {3}
    costs = [c.design.cost for c in found.front]
    assert costs == sorted(costs, reverse=True)
    assert found.front[0] is found.choices[0]
    assert len(found.plot().axes) == 1
    with pytest.raises(OptionError, match="no way to make a plate 'cast'"):
        weigh_choices(aria, plate, manners=("cast",))


def test_a_plate_for_each_choice_is_written(run, tmp_path):
    words = ("plate", "tradeoff", "table2", "--robot", "aria", "--out", "t", "--json", "t.json")
    status, _, _ = run(*words, "--targets", "8", "--made", "breadboard", "--places", "60")
    assert status == 0
    (choice,) = json.loads((tmp_path / "t.json").read_text())["choices"]
    assert choice["front"]
    assert "socket read once" in choice["holds"]
    (path,) = (tmp_path / "t").glob("*.toml")
    made = read_plate(path)
    steps = places_of(made, made.poses)[:, :2] / 0.025
    assert np.allclose(steps, steps.round(), atol=1e-6)
    assert (tmp_path / "t" / "tradeoff.png").is_file()
