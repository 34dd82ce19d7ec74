"""Plates weighed against each other: each opens in place of the present one, and Undo brings it back."""

from dataclasses import replace

import numpy as np
import pytest
from refusals import mentions, refuses

import workbench as wb
from workbench.base.errors import OptionError
from workbench.extras.production.panel import row_text
from workbench.extras.production.session import OpenChoice, TryPlate, Weighed, choices_of
from workbench.extras.production.tradeoff import Choice, Tradeoff
from workbench.identification.problem_blocks import Noise
from workbench.plate.optimiser.result import PlateDesign
from workbench.plate.plate import Kind
from workbench.plate.tolerances import Production
from workbench.session.commands.undo import Redo, Undo
from workbench.session.live_score import score
from workbench.session.next_step import _trial
from workbench.session.start import start


@pytest.fixture(scope="module")
def weighed(first):
    choices = []
    for number, cost in ((6, 3e-4), (8, 1e-4)):
        plate = replace(first.plate, targets=first.plate.targets[:number])
        design = PlateDesign(plate=plate, cost=cost, rotation=0.0, start_cost=cost)
        choices.append(Choice(method="printed", design=design))
    return first.with_part(Weighed(Tradeoff(choices=tuple(choices))))


def test_a_weighed_plate_opens_and_undo_brings_the_old_one_back(first, weighed):
    opened = OpenChoice(0).apply(weighed)
    assert len(opened.plate) == len(opened.states) == 6
    assert opened.plate.name.startswith("printed, 6 targets")
    assert opened.plate.region is first.plate.region
    assert opened.score.position > first.score.position
    assert Undo().apply(opened).plate is first.plate


def test_an_opened_plate_is_read_as_its_targets_are_unless_an_instrument_was_chosen(first, weighed):
    """A plate of sockets or for a ball-bar was scored with the noise of seats, unlike in `plate score`."""
    choice = choices_of(weighed)[0]
    sockets = tuple(replace(target, kind=Kind.SOCKET) for target in choice.design.plate.targets)
    read = replace(choice, design=replace(choice.design, plate=replace(choice.design.plate, targets=sockets)))
    session = weighed.with_part(Weighed(Tradeoff(choices=(read,))))
    opened = OpenChoice(0).apply(session)
    assert opened.noise == Noise(5e-5, first.noise.rotation)
    q = np.stack([state.q for state in opened.states])
    found = wb.score(
        first.robot, opened.plate.with_joints(q, opened.plate.branches), evaluation_poses=first.region.q
    )
    assert opened.score.position == pytest.approx(found.measured.error.position_rms)
    assert start(first.robot, opened.plate, states=opened.states).noise == opened.noise
    assert opened.history.first_score.position == pytest.approx(first.score.position)
    back = Undo().apply(opened)  # the seats kept the sockets' instrument
    assert (back.noise, back.score.position) == (first.noise, pytest.approx(first.score.position))
    assert Redo().apply(back).noise == opened.noise
    chosen = Noise(2e-4, 1e-3)
    assert OpenChoice(0).apply(replace(session, noise=chosen)).noise == chosen


def test_an_opened_plate_is_scored_as_it_is_made_and_read(first):
    """The page left out making, play and anchors: a printed plate seemed as good as a machined one."""
    production = Production(position=2.5e-4, angle=float(np.deg2rad(0.3)))
    loose = score(first.robot, replace(first.plate, production=production), first.states, **options(first))
    assert loose.position > 1.5 * first.score.position
    sockets = tuple(replace(target, kind=Kind.SOCKET) for target in first.plate.targets[:5])
    mixed = replace(first.plate, targets=(*sockets, *first.plate.targets[5:]))
    found = score(first.robot, mixed, first.states, **options(first))
    assert len(found.linearisation.jacobian) == 5 * 3 + 5 * 6
    again = score(first.robot, first.plate, first.states, **options(first))
    assert again.position == pytest.approx(first.score.position)


def test_another_instrument_than_the_plate_was_weighed_with_is_said(weighed):
    """A ball-bar of 5 µm opened under the page's 0.1 mm: five times the error of its row, without a word."""
    choice = choices_of(weighed)[0]
    assert OpenChoice(0).apply(weighed).page.messages == weighed.page.messages
    anchors = np.array([[-0.2, -0.2, 0.05], [0.2, -0.2, 0.05], [0.0, 0.2, 0.05]])
    bar = replace(choice.design, plate=replace(choice.design.plate, anchors=anchors))
    other = weighed.with_part(Weighed(Tradeoff(choices=(replace(choice, design=bar),))))
    opened = OpenChoice(0).apply(other)  # nobody chose the 0.1 mm
    assert (opened.page.messages, opened.noise.position) == (weighed.page.messages, 5e-6)
    message = OpenChoice(0).apply(replace(other, noise=Noise(2e-4, 1e-3))).page.messages[-1].text
    assert mentions(message, "0.005 mm")
    assert mentions(message, "0.2 mm")


def options(session):
    return {"noise": session.noise, "region_q": session.region.q}


def test_what_can_not_be_opened(first, weighed):
    with refuses(OptionError, option="number", found=2):
        OpenChoice(2).check(weighed)
    with refuses(OptionError, option="number", found=0):
        OpenChoice(0).check(first)


def test_rows_are_numbered_by_the_work_that_plates_take(weighed):
    assert row_text(1, weighed) == "2: printed, 8 targets, 2 shapes: 0.100 mm"
    made = [Choice(method=name, design=choices_of(weighed)[0].design) for name in ("ball-bar", "printed")]
    assert sorted(made, key=lambda choice: choice.work)[0].method == "printed"


def test_the_guide_offers_to_try_a_plate():
    assert _trial().command == TryPlate()
