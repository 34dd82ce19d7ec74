"""The terminal's view of a guided measurement fits and says what matters."""

from io import StringIO

import numpy as np
import pytest
from refusals import mentions
from rich.console import Console

from workbench.arm.built_in_arms import load_robot
from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.extras.live.acquisition import Acquisition, plate_targets
from workbench.extras.live.display import live_view, render
from workbench.extras.live.sample import Sample
from workbench.plate.plate_toml import load_plate

ARM, PLATE = load_robot("aria"), load_plate("table2")


def acquired():
    return Acquisition(plate_targets(ARM, PLATE), robot=ARM)


def shown(acquisition) -> str:
    console = Console(file=StringIO(), width=80)
    console.print(render(acquisition.status()))
    return console.file.getvalue()


@pytest.mark.parametrize("sees", ["nothing", "points", "poses"])
def test_it_fits_into_80_columns(sees):
    acquisition = acquired()
    text = shown(acquisition)
    assert "waiting for the first sample" in text
    pose = tool_poses(ARM, Motion(np.full((1, 6), -3.1)))[0]
    position = None if sees == "nothing" else 10.0 * pose[:3, 3]
    rotation = pose[:3, :3] if sees == "poses" else None
    acquisition.update(Sample(time=0.0, q=np.full(6, -3.1), position=position, rotation=rotation))
    assert not acquisition.store().changed  # it is at no target
    assert acquisition.store(anywhere=True).changed
    text = shown(acquisition)
    assert mentions(text, "target 2 of 10")
    assert ("measured" in text) == (sees != "nothing")
    assert ("°" in text) == (sees != "points")
    lines = text.splitlines()
    assert max(len(line) for line in lines) <= 80
    assert len(lines) <= 10


def test_a_silent_source_is_said():
    acquisition = acquired()
    acquisition.silence = 3.2
    assert mentions(shown(acquisition), "3 s")


def test_the_live_view_draws():
    console = Console(file=StringIO(), width=80, force_terminal=True)
    with live_view(console) as show:
        show(acquired().status())
    assert "target 1 of 10" in console.file.getvalue()
