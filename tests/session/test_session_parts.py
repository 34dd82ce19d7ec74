"""What extras keep in the session: how long it stays."""

from dataclasses import dataclass, replace

from workbench.plate.plate_toml import plate_text
from workbench.session.commands.arm import LoadModel
from workbench.session.commands.data import MeasureVirtualArm, with_data
from workbench.session.commands.identify import HoldParameter, Identify
from workbench.session.part import AbstractPart, GoesWith
from workbench.session.state import Measurements, Results


@dataclass(frozen=True)
class OfRows(AbstractPart):
    goes_with = GoesWith.MEASUREMENTS
    value: int = 0


@dataclass(frozen=True)
class OfPlate(AbstractPart):
    value: int = 0


def test_parts_are_kept_by_type_and_leave_earlier_sessions_alone(first):
    session = first.with_part(OfRows(1)).with_part(OfPlate(2))
    assert session.with_part(OfRows(3)).part(OfRows) == OfRows(3)
    assert (session.part(OfRows), session.part(OfPlate)) == (OfRows(1), OfPlate(2))
    assert first.part(OfRows) is None
    assert session.without_part(OfRows).part(OfRows) is None
    assert session.without_part(OfRows).part(OfPlate) == OfPlate(2)


def test_what_goes_with_the_measurements_leaves_with_them(first):
    session = with_data(first.with_part(OfRows(1)).with_part(OfPlate(2)), None)
    assert session.part(OfRows) is None
    assert session.part(OfPlate) == OfPlate(2)


def test_other_measurements_drop_what_was_found_and_keep_the_page(first):
    changed = replace(
        first,
        measurements=Measurements(levelled=True, left_out=frozenset({1})),
        results=Results(fit="opt2", row=3),
        page=replace(first.page, is_dark=True),
        choices=replace(first.choices, fixed=frozenset({"a"})),
    )
    fresh = with_data(changed, None)
    assert (fresh.measurements.levelled, fresh.measurements.left_out) == (False, frozenset())
    assert (fresh.results.fit, fresh.results.row) == ("", 0)
    assert fresh.page is changed.page
    assert fresh.choices is changed.choices


def test_another_plate_keeps_what_was_measured_and_found(first, do):
    measured = do(MeasureVirtualArm(5, more=20), HoldParameter("joint2.alpha", True), Identify(("opt2",)))
    session = do(LoadModel("plate.toml", plate_text(first.plate).encode()))
    for record in ("measurements", "results", "choices"):
        assert getattr(session, record) is getattr(measured, record)
    assert session.history.past[-1].plate is session.plate
    assert session.page.message_count > measured.page.message_count
