"""Plates weighed against each other: each a plate to make, the least work first."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from refusals import mentions, refuses

from tests.extras.production.test_yield import yield_of
from tests.plate.test_like_with_like import PINS, searched
from workbench.base.errors import DataError, OptionError
from workbench.extras.production import tradeoff
from workbench.extras.production.tradeoff import Choice, Tradeoff, weigh_choices
from workbench.plate.optimiser.manufacturing import METHODS
from workbench.plate.optimiser.result import PlateDesign
from workbench.plate.optimiser.target_blocks import places_of
from workbench.plate.plate_toml import read_plate

assert searched  # a fixture


def test_choices_and_their_front(aria, plate):
    found = weigh_choices(aria, plate, numbers=(6,), methods=("machined", "printed"), places=40)
    assert found.choices[0].method == "printed"
    assert {c.shapes for c in found.choices if c.method == "machined"} >= {3}
    costs = [c.design.cost for c in found.front]
    assert costs == sorted(costs, reverse=True)
    assert found.front[0] is found.choices[0]
    assert [c.work for c in found.choices] == sorted(c.work for c in found.choices)
    (axes,) = found.plot().axes
    assert [t.get_text() for t in axes.texts] == [str(i + 1) for i in range(len(found.choices))]
    out = " ".join(repr(found).split())
    assert re.search(r"printed: .*? made within ±0\.25 mm, ±0\.3°", out)
    assert "afterwards: every ball's centre" in out
    with refuses(OptionError, option="methods", found="cast"):
        weigh_choices(aria, plate, methods=("cast",))


def test_a_choice_that_can_not_be_had_leaves_the_others(aria, plate, monkeypatch):
    found, search = [], tradeoff._choice

    def one(robot, plate, name, request, seed):
        if request.number == 90:
            raise DataError("spacing and clearance conflict")
        return found[0] if found else found.append(search(robot, plate, name, request, seed)) or found[0]

    monkeypatch.setattr(tradeoff, "_choice", one)
    some = weigh_choices(aria, plate, numbers=(90, 8), methods=("printed",), places=40)
    assert len(some.choices) == 1
    assert mentions(" ".join(repr(some).split()), "printed, 90 targets")
    with refuses(DataError, "printed", "90 targets"):
        weigh_choices(aria, plate, numbers=(90,), methods=("printed",))


def test_a_plate_for_each_choice_is_written(run, tmp_path):
    options = ("plate", "tradeoff", "table2", "--robot", "aria", "--out", "t", "--json", "t.json")
    status, _, _ = run(*options, "--targets", "8", "--made", "breadboard", "--places", "60")
    assert status == 0
    (choice,) = json.loads((tmp_path / "t.json").read_text())["choices"]
    assert choice["front"]
    assert "socket read once" in choice["holds"]
    (path,) = (tmp_path / "t").glob("*.toml")
    made = read_plate(path)
    steps = places_of(made, made.poses)[:, :2] / 0.025
    assert np.allclose(steps, steps.round(), atol=1e-6)
    assert (tmp_path / "t" / "tradeoff.png").is_file()


def test_the_yield_of_a_choice_is_told_with_its_interval(plate):
    made = PlateDesign(plate=plate, cost=1e-4, rotation=1e-4, start_cost=2e-4)
    choice = Choice(method="machined", design=made, tried=yield_of(45, 50))
    found = Tradeoff(choices=(choice,))
    assert choice.share == pytest.approx(0.9)
    assert mentions(repr(found), "90 (78–97)")
    low, high = found.json()["choices"][0]["share_95"]
    assert (low, high) == pytest.approx((0.782, 0.967), abs=1e-3)  # Clopper and Pearson, 45 of 50


def test_searches_assume_how_each_plate_is_made(searched, aria, plate):
    weigh_choices(aria, plate, numbers=(8,), methods=("machined",))
    assert set(searched) == {(replace(METHODS["machined"].production, play=PINS), "seat")}
