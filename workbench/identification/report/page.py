"""The page of an identification."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from rich.console import Group
from rich.text import Text

from workbench.base.advice import ask
from workbench.data.accuracy_requirement import Wanted
from workbench.identification.errors.pass_or_fail import Judged, judge
from workbench.identification.report.constants import corrections
from workbench.identification.report.error_plots import before_after
from workbench.identification.report.how_to_apply import Use, controller_use
from workbench.identification.report.results_json import identification_json
from workbench.identification.report.table import identification_tables
from workbench.identification.result import Identification, order_of_measuring
from workbench.report.figures import svg
from workbench.report.page import PageBlock, write_page


def write_identification(result: Identification, folder: Path | str, *, wanted: Wanted | None = None) -> Path:
    """Write `report.html` and `result.json`: both or nothing.

    Args:
        folder: Made if it is not there.
        wanted: Required error of every pose; no verdict if None.
    """
    judged, use = None if wanted is None else judge(result, wanted), controller_use(result)
    content = identification_json(result)
    content |= {"requirement": judged and _requirement_json(judged), "controller": use.json()}
    blocks = _blocks(result, judged, use)
    title = f"{result.robot.name}: {result.data.source}"
    return write_page(
        folder, ("report.html", "result.json"), blocks, content, title=title, kind="Identification"
    )


def _blocks(result: Identification, judged: Judged | None, use: Use) -> Iterator[PageBlock]:
    verdict = [Text(judged.verdict, style="bold")] if judged is not None else []
    yield PageBlock(shown=Group(*verdict, identification_tables(result, every=True)))
    place = order_of_measuring(result)
    rows = ask("the errors row by row", lambda: svg(before_after(result, place), "rows"), "")
    yield PageBlock(
        "Before and after, row by row", picture=rows, caption="Nominal arm with the best base and tool, grey."
    )
    if drawn := ask("the corrections", lambda: corrections(result.best), None):
        yield PageBlock(
            "Corrections of the constants", picture=svg(drawn, "corrections"), caption="With standard errors."
        )
    yield PageBlock("What a controller can take", shown=use.summary())


def _requirement_json(judged: Judged) -> dict[str, Any]:
    check = judged.check
    return {
        **check.wanted.json(),
        "rows": "held_out" if judged.held_out else "train",
        "share_passed": check.share,
        "passed": judged.rows[check.passed].tolist(),
        "failed": judged.failed,
        "with_orientation": not check.unmeasured,
    }
