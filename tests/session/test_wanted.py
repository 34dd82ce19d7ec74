"""What is wanted is the user's; the region is where the rows are; a solved refusal does not return."""

import numpy as np
import pytest

from workbench.arm.built_in_arms import load_robot
from workbench.data.accuracy_requirement import Wanted
from workbench.data.prediction import RowComponents
from workbench.data.writer import write_measurements
from workbench.plate.virtual_measuring import measure_poses
from workbench.session import Worker, start
from workbench.session.commands.data import LoadData
from workbench.session.commands.drag import MoveTarget
from workbench.session.commands.edit import LockTarget
from workbench.session.commands.identify import SetWanted
from workbench.session.start import suited_plate
from workbench.session.state import Severity


def test_only_aria_begins_with_what_its_paper_asks(first, do):
    assert first.wanted.words == "1 mm per axis and 0.66°"
    ur5 = load_robot("ur5")
    assert start(ur5, suited_plate(ur5)).wanted is None
    assert do(SetWanted(3e-4)).wanted == Wanted(position=3e-4)
    assert do(SetWanted(None)).wanted is None
    assert do(SetWanted(-1.0)).messages[-1].severity is Severity.ERROR


@pytest.mark.parametrize(("per_axis", "kept"), [(True, [True, False, True]), (False, [False, False, True])])
def test_rows_are_judged_by_length_or_axis_by_axis(per_axis, kept):
    rows = RowComponents(
        position=np.array([[9e-4, 9e-4, 0.0], [2e-3, 0.0, 0.0], [1e-4, 0.0, 0.0]]),
        rotation=np.full((3, 3), np.nan),
    )
    assert Wanted(position=1e-3, rotation=0.1, per_axis=per_axis).within(rows).tolist() == kept


def test_the_region_of_a_file_is_where_its_rows_are(first, tmp_path):
    aria = load_robot("aria")
    rows = measure_poses(aria, 40, actual=aria, seed=1)[1]
    content = write_measurements(rows, tmp_path / "rows.csv").read_bytes()
    worker = Worker(first)
    worker.submit(LoadData("rows.csv", content))
    assert worker.wait(60.0)
    session = worker.session
    worker.close()
    assert session.plate.region.contains(session.comparison.measured).all()
    assert session.plate is session.first_plate


def test_a_refusal_goes_once_something_else_was_done(do):
    place = ((0.5, 0.3, 0.25), (-2.6, 0.0, 0.0))
    refused = do(LockTarget(0, True), MoveTarget(0, *place))
    assert refused.messages[-1].severity is Severity.ERROR
    solved = do(LockTarget(0, False), MoveTarget(0, *place))
    assert all(m.severity is not Severity.ERROR for m in solved.messages)
