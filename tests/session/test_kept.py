"""How long what extras keep in the session stays."""

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


def test_parts_are_kept_by_type_and_as_long_as_what_they_go_with(first):
    session = first.with_part(OfRows(1)).with_part(OfPlate(2))
    assert session.with_part(OfRows(3)).part(OfRows) == OfRows(3)
    kept = (session.part(OfRows), session.part(OfPlate), first.part(OfRows))
    assert kept == (OfRows(1), OfPlate(2), None)
    for without in (session.without_part(OfRows), with_data(session, None)):
        assert (without.part(OfRows), without.part(OfPlate)) == (None, OfPlate(2))
