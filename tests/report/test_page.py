"""Pages of results: one file that shows what the terminal does, with its numbers beside it."""

import json
import re

import pytest

from workbench import Wanted, diagnose, load_robot, measure_poses
from workbench.diagnosis.report.results_json import diagnosis_json, write_diagnosis
from workbench.identification.identify import identify
from workbench.identification.report.results_json import write_identification
from workbench.report.json import plain


@pytest.fixture(scope="module")
def rows():
    robot = load_robot("aria")
    return robot, measure_poses(robot, 60, effects=("joint-compliance:2",), seed=1)[1]


def stands_alone(text: str) -> bool:
    """Whether a page loads nothing and runs nothing."""
    return not re.search(r"<script|<link|@import|src=|url\((?!#)", text)


def test_the_page_of_an_identification(rows, tmp_path):
    robot, data = rows
    found = identify(robot, data)
    page = write_identification(found, tmp_path / "new", wanted=Wanted(position=1e-3))
    text = page.read_text("utf-8")
    assert stands_alone(text)
    assert text.count("<svg") == 2
    assert "Meets" in text or "miss" in text
    for constant in ("joint", "nominal", f"{found.error.after.position_mm.mean:.3f}"):
        assert constant in text
    numbers = json.loads((tmp_path / "new" / "result.json").read_text("utf-8"))
    assert numbers["schema"] == "workbench.identification/1"


def test_the_page_of_a_diagnosis(rows, tmp_path):
    robot, data = rows
    found = diagnose(robot, data)
    text = write_diagnosis(found, tmp_path).read_text("utf-8")
    assert stands_alone(text)
    assert text.count("<svg") == 2
    assert found.causes[0].sentence[:20] in text.replace("&#39;", "'") or "joint 2" in text
    assert json.loads((tmp_path / "diagnosis.json").read_text("utf-8")) == plain(diagnosis_json(found))
