"""A mistake in what only describes a result costs one warning: the calibrated arm and its numbers are there.

Every function that a command calls in the describing modules is broken in turn (`broken.py`).
"""

import json
from inspect import unwrap
from pathlib import Path
from pkgutil import resolve_name

import pytest
from broken import broken, called

from workbench import load_robot, measure_poses, write_measurements
from workbench.base import advice
from workbench.diagnosis import diagnose
from workbench.session.commands.data import LoadData
from workbench.session.commands.diagnose import Diagnose
from workbench.session.commands.identify import Identify

DESCRIBING = (
    *("diagnosis/claims/", "diagnosis/coverage.py", "diagnosis/notes.py"),
    *("diagnosis/gravity_tilt.py", "diagnosis/next_poses.py"),
    *("diagnosis/remaining_error.py", "diagnosis/report/", "diagnosis/result.py"),
    *("diagnosis/verdict.py", "identification/checks/arm_match.py", "identification/errors/"),
    *("identification/prior.py", "identification/report/", "identification/result.py"),
    *("identification/run.py", "report/", "session/comparison.py", "session/commands/compare.py"),
)
"""Files and folders whose functions describe …"""
NUMBERS = (
    *("diagnosis.claims.standard_errors.", "identification.errors.row_errors.", "report.json."),
    *("identification.run.SavedArm.", "identification.errors.expected_deviation."),
    *("identification.result.Identification.best", "identification.result.Identification.identifiability"),
    *("identification.result.Identification.robot", "identification.run.Run."),
    *("diagnosis.result.Diagnosis.identification", "diagnosis.result.Diagnosis.calibrated"),
    "diagnosis.result.Diagnosis.robot",
    "diagnosis.report.results_json.diagnosis_json",
    *("identification.report.results_json.identification_json", "session.commands.compare.with_"),
)
"""… but for these: the numbers of the result itself, and what writes them."""
FEW = {
    "diagnose": (
        *("diagnosis.claims.claimed_causes.find_causes", "diagnosis.coverage.coverage"),
        *("diagnosis.report.document.effects", "diagnosis.verdict.conclude"),
    ),
    "identify": ("identification.report.document.heading", "identification.result.Identification._warnings"),
}
"""Broken at every run of the tests."""


@pytest.fixture(scope="module")
def measured(tmp_path_factory) -> Path:
    """Forty rows of a virtual arm that gives way in joint 2."""
    _, rows = measure_poses(load_robot("aria"), 40, effects=("joint-compliance:2:5e-5",), seed=3)
    path = tmp_path_factory.mktemp("measured") / "soft.csv"
    write_measurements(rows, path)
    return path


@pytest.fixture
def careless(monkeypatch):
    """Mistakes cost warnings, as for users; the search of the first diagnosis serves all of them."""
    searched, search_causes = [], diagnose.search_causes

    def search(*given):
        searched[:] = searched or [search_causes(*given)]
        return searched[0]

    monkeypatch.setattr(advice, "is_strict", False)
    monkeypatch.setattr(diagnose, "search_causes", search)


@pytest.fixture
def command(run, measured, careless):
    """Run a command; returns what it says. Its status is 0, and its files are whole."""

    def call(name: str) -> str:
        saved, numbers = Path("saved.toml"), Path("numbers.json")
        for path in (saved, numbers):
            path.unlink(missing_ok=True)
        status, out, err = run(name, measured, "--robot", "aria", "--save", saved, "--json", numbers)
        assert status == 0, err
        assert load_robot(saved).calibration is not None
        assert json.loads(numbers.read_text())["schema"].startswith("workbench.")
        return out + err + numbers.read_text()

    return call


@pytest.mark.parametrize("name", FEW)
def test_a_few_broken_functions_cost_a_warning_each(name, command):
    for each in FEW[name]:
        found = resolve_name(f"workbench.{each}")
        with broken(unwrap(getattr(found, "fget", None) or getattr(found, "func", found))):
            assert "ZeroDivisionError" in command(name), each


@pytest.mark.slow
@pytest.mark.parametrize("name", FEW)
def test_no_describing_function_loses_the_result_of_a_command(name, command):
    lost = {}
    for each, function in called(lambda: command(name), *DESCRIBING).items():
        if not each.startswith(NUMBERS):
            try:
                with broken(function):
                    command(name)
            except Exception as error:
                lost[each] = error
    assert not lost


@pytest.mark.slow
def test_no_describing_function_loses_the_result_in_the_page(measured, careless, do):
    """A task that ends with a broken description keeps its result, and says what is missing."""

    content, lost = measured.read_bytes(), []

    def work() -> bool:
        results = do(LoadData("soft.csv", content), Identify(), Diagnose()).results
        return results.identification is not None and results.diagnosis is not None

    assert work()
    for each, function in called(work, *DESCRIBING).items():
        if not each.startswith(NUMBERS):
            with broken(function):
                lost += [] if work() else [each]
    assert not lost
