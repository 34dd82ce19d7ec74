"""One folder about a work done again: the page, its pictures, and everything as JSON."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from studies.finding import Finding, Verdict
from workbench.base.files import write_folder
from workbench.base.progress import progress
from workbench.report.figures import png
from workbench.report.html import page_template
from workbench.report.json import json_text

PAGE, RESULT = "index.html", "result.json"
SCHEMA = "workbench.reproduction/1"

Json = dict[str, Any]


@dataclass(frozen=True)
class Picture:
    """A finished picture.

    Args:
        name: File name with ending.
        title: For its heading.
        caption: What it shows and how to read it.
        content: The PNG file.
    """

    name: str
    title: str
    caption: str
    content: bytes


def drawn(wanted: Sequence[tuple[str, str, str, Callable[[], Figure]]]) -> tuple[Picture, ...]:
    """Pictures one after the other.

    Args:
        wanted: File name without ending, heading, caption, and what draws it.
    """
    pictures = []
    for number, (name, title, caption, draw) in enumerate(wanted):
        pictures.append(Picture(f"{name}.png", title, caption, png(draw())))
        progress((number + 1) / len(wanted), "drawing")
    return tuple(pictures)


@dataclass(frozen=True)
class Sheet:
    """A table for the page: the work's numbers and ours.

    Args:
        title: Which table.
        headings: Of the columns.
        rows: Cells as text.
        note: What must be known to read it.
        groups: Headings over the columns, and how many each spans; none if empty.
    """

    title: str
    headings: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    note: str = ""
    groups: tuple[tuple[str, int], ...] = ()


@dataclass(frozen=True, kw_only=True)
class Page:
    """What a page shows, in its order.

    Args:
        title: The work.
        source: Where it was printed.
        facts: What was done here, one paragraph each.
        findings: Printed numbers beside ours.
        summary: Tables before the pictures.
        pictures: Finished pictures.
        sheets: Tables after them.
        omitted: Which of the work's figures have no counterpart.
    """

    title: str
    source: str
    facts: tuple[str, ...]
    findings: tuple[Finding, ...]
    summary: tuple[Sheet, ...]
    pictures: tuple[Picture, ...]
    sheets: tuple[Sheet, ...]
    omitted: str


def write_page(page: Page, result: Json, folder: Path | str) -> Path:
    """Write the page with its pictures and `result.json`; whatever else the folder holds stays.

    Returns:
        The page.

    Raises:
        FileError: the folder is a file.
    """
    files = {picture.name: picture.content for picture in page.pictures}
    files |= {PAGE: _html(page).encode(), RESULT: json_text(result).encode()}
    return write_folder(folder, files) / PAGE


def verdicts(findings: tuple[Finding, ...]) -> dict[str, int]:
    """How many findings have each verdict."""
    counts = Counter(finding.verdict for finding in findings)
    return {str(verdict): counts[verdict] for verdict in Verdict}


def plural(findings: tuple[Finding, ...]) -> str:
    """The same in a sentence."""
    counts = verdicts(findings)
    ours = counts["holds (not counted)"] + counts["fails (not counted)"]
    return (
        f"{len(findings) - ours} printed numbers and statements: {counts['agrees']} agree, "
        f"{counts['differs']} differ, for {counts['none can be given']} none can be given. Numbers over "
        "several arms agree if the interval of nine arms in ten encloses the printed one, single numbers if "
        "they round to it, statements if the numbers beside them bear them out. Another "
        f"{ours} checks are not counted, as nothing independent stands on both sides: values that were "
        "hidden or copied here, arithmetic on the work's own numbers, bounds."
    )


def findings_json(findings: tuple[Finding, ...]) -> Json:
    """The findings and their verdicts."""
    return {"verdicts": verdicts(findings), "findings": [_finding(finding) for finding in findings]}


def _finding(finding: Finding) -> Json:
    """One printed number beside ours."""
    return {
        "where": finding.where,
        "what": finding.what,
        "printed": finding.printed,
        "here": finding.here,
        "verdict": str(finding.verdict),
        "reason": finding.reason,
    }


def _html(page: Page) -> str:
    return page_template("reproduction.html", package="studies").render(page=page, result=RESULT)
