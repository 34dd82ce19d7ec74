"""Fields of a record: JSON and tables from one statement."""

from dataclasses import dataclass
from datetime import date
from enum import Enum
from math import nan

import numpy as np
import pytest

from workbench.report.json import document
from workbench.report.result_fields import DEG, JOINT, MM, POSE, ResultField, ResultFields


class Kind(Enum):
    STEP = 1

    def __str__(self) -> str:
        return "at once"


@dataclass(frozen=True)
class Reading:
    joint: int
    position: float
    rotation: float | None
    parts: tuple["Reading", ...] = ()


READING = ResultFields(
    JOINT,
    ResultField("off", MM, of="position", title="off"),
    ResultField("turned", DEG, of="rotation", title="turned", text="{:.1f}".format),
    ResultField("", of=lambda reading: len(reading.parts), title="parts"),
    ResultField("parts", each=POSE),
)


def test_numbers_are_in_the_unit_of_their_key():
    reading = Reading(2, 0.0125, np.pi / 2, (Reading(0, 0.001, None),))
    assert READING.json(reading) == {
        "joint": 3,
        "off_mm": pytest.approx(12.5),
        "turned_deg": pytest.approx(90.0),
        "parts": [{"position_mm": pytest.approx(1.0), "orientation_deg": None}],
    }


def test_a_unit_applies_to_every_number_of_a_record_within():
    sizes = ResultFields(
        ResultField(
            "error",
            MM,
            of=lambda r: r,
            each=ResultFields("position", ResultField("twice", of=lambda r: [r.position] * 2)),
        )
    )
    found = sizes.json(Reading(0, 0.002, None))["error_mm"]
    assert found["position"] == pytest.approx(2.0)
    assert found["twice"] == pytest.approx([2.0, 2.0])


def test_a_document_is_plain_data():
    found = document(
        "workbench.test/1",
        kind=Kind.STEP,
        day=date(2026, 1, 31),
        sizes=(np.float64(1.0), nan),
        of=np.arange(2),
    )
    assert found == {
        "schema": "workbench.test/1",
        "kind": "at once",
        "day": "2026-01-31",
        "sizes": [1.0, None],
        "of": [0, 1],
    }
