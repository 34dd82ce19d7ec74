"""What the core calls: the page and the figures of each kind of result."""

from pathlib import Path
from typing import Any, final

from matplotlib.figure import Figure

from workbench.data.accuracy_requirement import Wanted
from workbench.extras.reports import diagnosis_figures, identification_figures
from workbench.extras.reports.diagnosis_page import write_diagnosis
from workbench.extras.reports.identification_page import write_report
from workbench.report.result_page import AbstractResultPage


@final
class IdentificationPage(AbstractResultPage):
    """`report.html`, its pictures as SVG files and `result.json`."""

    name = "Identification"

    def write(self, result: Any, folder: Path | str, *, wanted: Wanted | None = None) -> Path:
        return write_report(result, folder, wanted=wanted)

    def figure(self, result: Any, name: str = "") -> Figure:
        return identification_figures.figure(result, *((name,) if name else ()))


@final
class DiagnosisPage(AbstractResultPage):
    """`diagnosis.html`, its pictures as PNG files and `diagnosis.json`."""

    name = "Diagnosis"

    def write(self, result: Any, folder: Path | str, *, wanted: Wanted | None = None) -> Path:
        return write_diagnosis(result, folder)

    def figure(self, result: Any, name: str = "") -> Figure:
        return diagnosis_figures.figure(result, name)
