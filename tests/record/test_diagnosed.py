"""What a diagnosis and the searches of plates leave in a recording."""

import pytest

from workbench.record.start import recorder
from workbench.session.commands import ClusterTargets, SelectTarget
from workbench.session.journal.entry import Ending, Entry


@pytest.fixture
def draw(tmp_path, reader):
    """Record sessions one after the other; what can be read back."""

    def run(*steps):
        (tmp_path / "r").mkdir()
        keeper = recorder(tmp_path / "r")
        keeper.begin(steps[0][1], step=0, at=0.0, tell=print)
        for step, (command, session) in enumerate(steps[1:], start=1):
            keeper.note(step, Entry(command, Ending.DONE, 0, 0.0, 0.0, at=float(step)), session)
        keeper.close()
        return reader(tmp_path / "r" / "session.rrd")

    return run


def test_a_search_is_one_row_against_the_plate_before(draw, sample, replayed):
    before, after = sample.first, replayed.session
    pictures = draw(
        (None, before), (ClusterTargets(4), after), (SelectTarget(1), after), (ClusterTargets(4), before)
    )
    (first_step, (first,)), (last_step, (last,)) = pictures.values("/searches", "TextDocument:text")
    assert (first_step, last_step) == (1, 3)
    rows = last.splitlines()[2:]
    assert [row.split(" | ")[0] for row in rows] == ["| 1", "| 3"]
    assert first.splitlines()[2:] == rows[:1]
    errors = [f"{1e3 * s.score.position:.3f}"[:4] for s in (before, after)]
    cells = rows[0].strip("| ").split(" | ")[-1].split(" → ")
    assert [cell[:4] for cell in cells] == errors
