"""One folder about a work done again: the page, its pictures, and everything as JSON."""

from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined

from workbench.report import json as json_report
from workbench.report.folder import check_folder, write_folder
from workbench.report.plates import cluster_json
from workbench.reproduce.aria import AriaReproduction
from workbench.reproduce.aria_arms import TITLES, Comparison
from workbench.reproduce.aria_figures import Picture, all_pictures
from workbench.reproduce.finding import Finding, Verdict

PAGE, RESULT = "index.html", "result.json"
SCHEMA = "workbench.reproduction/1"
ARIA_TITLE = "Kinematic calibration of a lightweight manipulator, done again"
ARIA_SOURCE = (
    "K. Arent, A. Kurnicki, P. Portasiak, B. Stańczyk: Kinematic calibration of a lightweight manipulator. "
    "Bull. Pol. Acad. Sci. Tech. Sci. 72(6), e151381, 2024"
)

Json = dict[str, Any]


def aria_json(found: AriaReproduction) -> Json:
    """Every finding, the poses of the clustering, and the spread of errors over the arms."""
    return {
        "schema": SCHEMA,
        "work": "aria",
        "source": ARIA_SOURCE,
        "arms": found.arms,
        "seed": found.seed,
        "verdicts": verdicts(found.findings),
        "findings": [finding_json(finding) for finding in found.findings],
        "clustering": cluster_json(found.clustering),
        "comparison": [_comparison_json(c) for c in (*found.exact, *found.noisy)],
    }


def verdicts(findings: tuple[Finding, ...]) -> dict[str, int]:
    """How many findings have each verdict."""
    counts = Counter(finding.verdict for finding in findings)
    return {str(verdict): counts[verdict] for verdict in Verdict}


def finding_json(finding: Finding) -> Json:
    """One printed number beside ours."""
    return {
        "where": finding.where,
        "what": finding.what,
        "printed": finding.printed,
        "here": finding.here,
        "verdict": str(finding.verdict),
        "reason": finding.reason,
    }


def write_aria(
    found: AriaReproduction, folder: Path | str, *, progress: Callable[[float, str], None] | None = None
) -> Path:
    """Write the page with its pictures and `result.json`; whatever else the folder holds stays.

    Returns:
        The page.

    Raises:
        FileError: the folder is a file.
    """
    check_folder(folder)
    report = progress or (lambda part, words: None)
    pictures = all_pictures(found, lambda part: report(part, "drawing"))
    files = {picture.name: picture.content for picture in pictures}
    files |= {
        PAGE: _page(found, pictures).encode(),
        RESULT: json_report.text(aria_json(found)).encode(),
    }
    return write_folder(folder, files) / PAGE


def _page(found: AriaReproduction, pictures: tuple[Picture, ...]) -> str:
    environment = Environment(
        loader=PackageLoader("workbench.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template("reproduction.html").render(
        title=ARIA_TITLE,
        source=ARIA_SOURCE,
        facts=_facts(found),
        findings=found.findings,
        sheets=found.sheets,
        pictures=pictures,
        spreads=[_spread_row(c) for c in (*found.exact, *found.noisy)],
        titles=TITLES,
        result=RESULT,
    )


def _facts(found: AriaReproduction) -> tuple[str, ...]:
    counts = verdicts(found.findings)
    return (
        f"{len(found.findings)} printed numbers and statements: {counts['agrees']} agree, "
        f"{counts['differs']} differ, for {counts['none can be given']} none can be given.",
        f"{found.arms} virtual arms with hidden errors up to 5 mm and 5° in every constant, seed "
        f"{found.seed}; base and tool known, as in the paper.",
    )


def _spread_row(comparison: Comparison) -> tuple[str, ...]:
    """A way of measuring, and medians over the arms: measured poses, region, anywhere [mm]."""
    noise = "none" if comparison.instrument.sigma_position == 0 else "0.1 mm, 0.02°"
    tables = (comparison.own_position, comparison.region, comparison.anywhere)
    cells = [_size(1e3 * np.nanmedian(table[:, column])) for table in tables for column in range(len(TITLES))]
    return comparison.acquisition.title, noise, str(comparison.reached), *cells


def _size(value: float) -> str:
    return f"{value:.3g}" if value >= 1e-6 else f"{value:.0e}"


def _comparison_json(comparison: Comparison) -> Json:
    tables = {
        "measured_position_mm": 1e3 * comparison.own_position,
        "measured_orientation_deg": np.rad2deg(comparison.own_rotation),
        "region_position_mm": 1e3 * comparison.region,
        "region_orientation_deg": np.rad2deg(comparison.region_rotation),
        "anywhere_position_mm": 1e3 * comparison.anywhere,
    }
    return {
        "way": comparison.acquisition.name,
        "instrument": comparison.instrument.name,
        "reached": comparison.reached,
        "q": comparison.acquisition.q,
        "errors": {
            name: {
                title: {"median": np.nanmedian(t[:, k]), "max": np.nanmax(t[:, k])}
                for k, title in enumerate(TITLES)
            }
            for name, t in tables.items()
        },
    }
