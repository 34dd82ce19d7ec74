"""What a diagnosis leaves in a recording."""

from dataclasses import replace

import pytest
from refusals import mentions

from tests.session.direct_commands import done
from workbench import diagnose, measure_poses
from workbench.session.commands.arm import ChooseRobot
from workbench.session.commands.diagnose import Diagnose
from workbench.session.commands.drag import SelectTarget
from workbench.session.commands.undo import Undo
from workbench.session.view import Ending, Entry
from workbench.views.recording.recorder import recorder


@pytest.fixture
def draw(tmp_path, reader):
    """Record sessions one after the other; what can be read back."""

    def run(*steps):
        (tmp_path / "r").mkdir()
        keeper = recorder(tmp_path / "r")
        keeper.begin(steps[0][1], step=0, at=0.0, notify=print)
        for step, (command, session) in enumerate(steps[1:], start=1):
            keeper.note(step, Entry(command, Ending.DONE, 0, 0.0, 0.0, at=float(step)), session)
        keeper.close()
        return reader(tmp_path / "r" / "session.rrd")

    return run


@pytest.fixture(scope="module")
def diagnosed(sample):
    """A diagnosis of an arm whose second joint gives way."""
    _, rows = measure_poses(sample.robot, 25, effects=["joint-compliance:2"], seed=1)
    return diagnose(sample.robot, rows)


def test_a_diagnosis_is_told_in_pictures_and_numbers(draw, sample, diagnosed):
    found = replace(sample.first, results=replace(sample.first.results, diagnosis=diagnosed))
    pictures = draw(
        (None, sample.first), (Diagnose(), found), (SelectTarget(1), found), (SelectTarget(2), sample.first)
    )
    _, (_, (text,)), *_ = pictures.values("/result", "TextDocument:text")
    assert diagnosed.message in text
    assert mentions(text, "joint-compliance, joint 2")


def test_title_and_eye_are_those_of_the_step(draw, sample):
    first, other = sample.first, done(sample.first, ChooseRobot("ur5e"))
    pictures = draw((None, first), (ChooseRobot("ur5e"), other), (SelectTarget(1), other), (Undo(), first))
    shown = [text.split()[0] for _, (text,) in pictures.values("/title", "TextDocument:text")]
    assert shown == ["**ARIA", "**UR5e", "**ARIA"]
    eyes = pictures.values("/world/eye", "Transform3D:translation")
    assert [step for step, _ in eyes] == [0, 1, 3]
    assert eyes[0][1] == eyes[2][1] != eyes[1][1]
