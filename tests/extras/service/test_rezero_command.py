"""Joint zeros after a knock, as a command: found, kept in the journal, saved; refused with a reason."""

import numpy as np
import pytest
from driven_effects import tracked_file

from workbench.arm.robot_toml import read_toml
from workbench.extras.service.rezero.result import RezeroVerdict
from workbench.extras.service.rezero.session import FindZeros, FoundZeros, rezeroed_toml, zeros_of
from workbench.session import replay
from workbench.session.commands.data import LoadData
from workbench.session.page_state import Severity

SHIFT = np.deg2rad(0.5)


@pytest.fixture(scope="module")
def file(first, tmp_path_factory) -> bytes:
    robot, rng = first.robot, np.random.default_rng(8)
    actual = robot.with_values({"joint3.theta": robot.values(("joint3.theta",))[0] + SHIFT})
    path = tmp_path_factory.mktemp("data") / "a.csv"
    return tracked_file(actual, path, rng, rows=8, reach=2.0).read_bytes()


def test_the_joint_that_moved_is_found_and_saved(worker, do, first, file, tmp_path):
    session = do(FindZeros())
    assert session.page.messages[-1].severity is Severity.ERROR
    session = do(LoadData("knock.csv", file), FindZeros())
    assert zeros_of(session).verdict is RezeroVerdict.MOVED
    assert [s.joint for s in zeros_of(session).moved] == [2]
    assert "joint 3 by 0.49" in session.page.messages[-1].text
    name, content = rezeroed_toml(session)
    (tmp_path / name).write_bytes(content)
    saved = read_toml(tmp_path / name).values(("joint3.theta",))
    assert saved - first.robot.values(("joint3.theta",)) == pytest.approx([SHIFT], abs=5e-4)
    assert zeros_of(replay(first, worker.journal)).json() == zeros_of(session).json()
    assert zeros_of(do(LoadData("knock.csv", file))) is None
    assert zeros_of(session.without_part(FoundZeros)) is None
