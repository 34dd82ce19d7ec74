"""What extras keep in the session: how long it stays."""

from dataclasses import dataclass

from workbench.session.commands.data import with_data
from workbench.session.part import AbstractPart, GoesWith


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
