"""The page of an identification."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from workbench.data.accuracy_requirement import Wanted
from workbench.identification.errors.pass_or_fail import Judged, judge
from workbench.identification.report.document import identification_blocks
from workbench.identification.report.results_json import identification_json
from workbench.identification.result import Identification
from workbench.report.blocks import Block
from workbench.report.page import write_page


def write_identification(
    result: Identification, folder: Path | str, *, wanted: Wanted | None = None, first: Sequence[Block] = ()
) -> Path:
    """Write `report.html` and `result.json`: both or nothing.

    Args:
        folder: Made if it is not there.
        wanted: Required error of every pose; no verdict if None.
        first: What the page begins with.
    """
    requirement = None if wanted is None else _requirement_json(judge(result, wanted))
    content = identification_json(result) | {"requirement": requirement}
    blocks = [*first, *identification_blocks(result, wanted=wanted)]
    title = f"{result.robot.name}: {result.data.source}"
    return write_page(
        folder, ("report.html", "result.json"), blocks, content, title=title, kind="Identification"
    )


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
