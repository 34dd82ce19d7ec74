"""The page and the JSON of the ARIA paper done again."""

from pathlib import Path

import numpy as np

from studies.aria import AriaReproduction
from studies.aria_arms import TITLES, Comparison
from studies.aria_figures import all_pictures
from studies.page import SCHEMA, Json, Page, Sheet, findings_json, plural, write_page
from workbench.base.files import check_folder
from workbench.extras.poses.clustering.report import cluster_json

TITLE = "Kinematic calibration of a lightweight manipulator, done again"
SOURCE = (
    "K. Arent, A. Kurnicki, P. Portasiak, B. Stańczyk: Kinematic calibration of a lightweight manipulator. "
    "Bull. Pol. Acad. Sci. Tech. Sci. 72(6), e151381, 2024"
)


def aria_json(found: AriaReproduction) -> Json:
    """Every finding, the poses of the clustering, and the spread of errors over the arms."""
    return {
        "schema": SCHEMA,
        "work": "aria",
        "source": SOURCE,
        "arms": found.arms,
        "seed": found.seed,
        **findings_json(found.findings),
        "clustering": cluster_json(found.clustering),
        "comparison": [_comparison_json(c) for c in (*found.exact, *found.noisy)],
    }


def write_aria(found: AriaReproduction, folder: Path | str) -> Path:
    """Write the page with its pictures and `result.json`; whatever else the folder holds stays.

    Returns:
        The page.

    Raises:
        FileError: the folder is a file.
    """
    check_folder(folder)
    page = Page(
        title=TITLE,
        source=SOURCE,
        facts=(
            plural(found.findings),
            f"{found.arms} virtual arms with hidden errors up to 5 mm and 5° in every constant, seed "
            f"{found.seed}; base and tool known, as in the paper.",
        ),
        findings=found.findings,
        summary=(_spreads((*found.exact, *found.noisy)),),
        pictures=all_pictures(found),
        sheets=found.sheets,
        omitted="Figs. 1 to 4 and 8 to 10 are photographs and drawings.",
    )
    return write_page(page, aria_json(found), folder)


def _spreads(comparisons: tuple[Comparison, ...]) -> Sheet:
    """Medians over the arms: measured poses, region, anywhere."""
    size = len(TITLES)
    return Sheet(
        "Fig. 7 in numbers: position errors, medians over the arms [mm]",
        ("poses", "noise", "arms", *(3 * TITLES)),
        tuple(_spread_row(c) for c in comparisons),
        groups=(
            ("", 3),
            ("measured poses, greatest entry", size),
            ("other poses of the region, mean", size),
            ("anywhere, mean", size),
        ),
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
