"""The page of a diagnosis."""

from collections.abc import Iterator
from pathlib import Path

from workbench.base.advice import ask
from workbench.diagnosis.report.budget import budget_bars
from workbench.diagnosis.report.ranking import ranking
from workbench.diagnosis.report.results_json import diagnosis_json
from workbench.diagnosis.report.table import diagnosis_tables
from workbench.diagnosis.result import Diagnosis
from workbench.identification.report.error_plots import before_after
from workbench.identification.result import order_of_measuring
from workbench.report.figures import svg
from workbench.report.page import PageBlock, write_page


def write_diagnosis(result: Diagnosis, folder: Path | str) -> Path:
    """Write `diagnosis.html` and `diagnosis.json`: both or nothing; the folder is made if it is not there."""
    title = f"{result.robot.name}: {result.data.source}"
    return write_page(
        folder,
        ("diagnosis.html", "diagnosis.json"),
        _blocks(result),
        diagnosis_json(result),
        title=title,
        kind="Diagnosis",
    )


def _blocks(result: Diagnosis) -> Iterator[PageBlock]:
    yield PageBlock(shown=diagnosis_tables(result))
    whole = result.identification()
    budget = ask("the error budget", lambda: budget_bars(result), "")
    yield PageBlock(
        "What the error is made of", picture=budget, caption="Sizes at the tool, on held-out rows."
    )
    rows = ask(
        "the errors row by row", lambda: svg(before_after(whole, order_of_measuring(whole)), "rows"), ""
    )
    yield PageBlock(
        "Before and after, row by row", picture=rows, caption="Nominal arm with the best base and tool, grey."
    )
    if drawn := ask("the candidates", lambda: ranking(result), None):
        yield PageBlock(
            "What was tried",
            picture=svg(drawn, "ranking"),
            caption="Each candidate added to the geometry alone.",
        )
