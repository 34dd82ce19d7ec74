"""What is checked on the parts, and what is bought for them."""

import csv
import io

import pytest

from tests.extras.workshop.test_drawing import SLANTED
from workbench.extras.workshop.csv_lists import holes_csv, parts_csv
from workbench.extras.workshop.fixture import fixture_of
from workbench.extras.workshop.inspection import inspection_csv
from workbench.plate.stock import Stock


@pytest.fixture(scope="module")
def slanted(plate_of):
    return fixture_of(plate_of(*SLANTED))


def test_what_is_checked_and_what_is_bought(slanted, plate_of):
    checks = list(csv.DictReader(io.StringIO(inspection_csv(plate_of(*SLANTED), slanted))))
    assert {
        *("height over B", "mitre", "index hole from downhill"),
        *("distance of the dowel holes", "level lines of the face against C"),
    } <= {c["feature"] for c in checks}
    assert all(float(c["minimum"]) < float(c["nominal"]) < float(c["maximum"]) for c in checks)
    assert all(c["measured"] == "" for c in checks)
    holes = {h["hole"]: h for h in csv.DictReader(io.StringIO(holes_csv(slanted)))}
    assert len(holes) == len(slanted.slab.bores)  # every hole has a name of its own, by which it is checked
    for check in (c for c in checks if c["part"] == "plate"):
        *_, name, axis = check["feature"].split()
        assert check["nominal"] == holes[name][f"{axis}[mm]"]
    parts = list(csv.DictReader(io.StringIO(parts_csv(slanted))))
    assert [p["part"] for p in parts[:4]] == ["plate", "block A", "block B", "probe"]
    assert next(p for p in parts if "dowel" in p["part"])["quantity"] == "4"


def test_a_magnet_places_nothing(plate_of):
    plate = plate_of((-0.08, 0.0, 0.09, 0.0, 0.0, 0.0), (0.05, 0.0, 0.09, 0.0, 0.0, 0.0), kinds=("socket",))
    assert "magnet" not in inspection_csv(plate, fixture_of(plate, stock=Stock.named("breadboard")))
