"""Small results that the report's tests share."""

import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.identification.report.conftest import points, result
from workbench.base.progress import running
from workbench.data.accuracy_requirement import Requirement
from workbench.extras.reports.identification_page import write_report

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "diagnosis"))

__all__ = ["points", "result"]


@pytest.fixture(scope="session")
def report(result, tmp_path_factory):
    """The report of that arm, its pictures drawn once."""
    return write_report(result, tmp_path_factory.mktemp("report") / "new", wanted=Requirement().wanted)


@dataclass(frozen=True)
class Replaced:
    """A report of points, written over an older one.

    Args:
        path: The page.
        parts: What was told while it was written.
    """

    path: Path
    parts: list[float]


@pytest.fixture(scope="session")
def replaced(points, tmp_path_factory):
    """None of whose rows keeps what is wanted, in a folder that has another file."""
    folder, parts = tmp_path_factory.mktemp("points"), []
    for name in ("errors-orientation.svg", "report.html", "mine.txt"):
        (folder / name).write_text("old")
    wanted = Requirement(per_axis=1e-7).wanted
    with running(lambda part, text: parts.append(part)):
        path = write_report(points, folder, wanted=wanted)
    return Replaced(path, parts)
