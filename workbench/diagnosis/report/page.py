"""The page of a diagnosis."""

from pathlib import Path

from workbench.diagnosis.report.document import diagnosis_blocks
from workbench.diagnosis.report.results_json import diagnosis_json
from workbench.diagnosis.result import Diagnosis
from workbench.report.page import write_page


def write_diagnosis(result: Diagnosis, folder: Path | str) -> Path:
    """Write `diagnosis.html` and `diagnosis.json`: both or nothing; the folder is made if it is not there."""
    return write_page(
        folder,
        ("diagnosis.html", "diagnosis.json"),
        diagnosis_blocks(result),
        diagnosis_json(result),
        title=f"{result.robot.name}: {result.data.source}",
        kind="Diagnosis",
    )
