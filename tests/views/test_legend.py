"""The legend over the scene: every colour that is seen there, with the unit of what it stands for."""

import re
from dataclasses import replace

import pytest

from workbench.arm.built_in_arms import load_robot
from workbench.plate.plate_toml import load_plate
from workbench.session import Session, start
from workbench.session.commands.region import MapCubes
from workbench.session.cube_values import values
from workbench.views.appearance.colours import BLOCKED, OUT_OF_REACH, REACHED, SCALE, SELECTED, css
from workbench.views.page.panels.legend import cubes_scale, things


@pytest.fixture(scope="module")
def session() -> Session:
    first = start(load_robot("aria"), load_plate("table2"))
    found = MapCubes.needed(first).compute(first)
    return first.with_region(cubes=found)


def colours(text: str) -> set[str]:
    return set(re.findall("#[0-9a-f]{6}", text))


def test_the_scale_of_the_cubes_has_its_colours_ends_and_unit(session):
    text, numbers = cubes_scale(session), values(session)
    low, high = re.findall(r"[≤≥] ([0-9.]+)", text)
    assert (float(low), float(high)) == pytest.approx((1e3 * numbers.low, 1e3 * numbers.high))
    assert text.index(low) < text.index(high) < text.rindex("mm")
    assert colours(text) == {css(tuple(colour)) for colour in SCALE.astype(int).tolist()}


def test_targets_in_trouble_are_in_the_legend_only_where_there_are_any(session):
    assert colours(things(session)) == {css(REACHED), css(SELECTED)}
    for trouble, colour in (({"reached": False}, OUT_OF_REACH), ({"hit": "the plate"}, BLOCKED)):
        states = (replace(session.states[0], **trouble), *session.states[1:])
        assert colours(things(replace(session, states=states))) == {css(REACHED), css(SELECTED), css(colour)}
