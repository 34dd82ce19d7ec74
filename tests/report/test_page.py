"""Pages of results: one file that shows what the terminal does, with its numbers beside it."""

import json
import re

import pytest

from workbench import Wanted, diagnose, identify, load_robot, measure_poses
from workbench.diagnosis.report.results_json import diagnosis_json, write_diagnosis
from workbench.identification.report.results_json import identification_json, write_identification
from workbench.report.json import plain


@pytest.fixture(scope="module")
def rows():
    robot = load_robot("aria")
    return robot, measure_poses(robot, 60, effects=("joint-compliance:2",), seed=1)[1]


PAGES = {
    "result": (identify, write_identification, {"wanted": Wanted(position=1e-3)}, identification_json),
    "diagnosis": (diagnose, write_diagnosis, {}, diagnosis_json),
}


@pytest.mark.parametrize("name", PAGES)
def test_a_page_stands_alone_with_its_numbers_beside_it(name, rows, tmp_path):
    verb, write, options, numbers = PAGES[name]
    found = verb(*rows)
    text = write(found, tmp_path / "new", **options).read_text("utf-8")
    assert not re.search(r"<script|<link|@import|src=|url\((?!#)", text)  # nothing is loaded or run
    assert text.count("<svg") == 2
    shown = [f"{found.error.after.position_mm.mean:.3f}", "joint", "nominal", "Meets"]
    assert all(word in text for word in (shown if verb is identify else ("joint 2",)))
    assert json.loads((tmp_path / "new" / f"{name}.json").read_text("utf-8")) == plain(numbers(found))
