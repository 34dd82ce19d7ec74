"""The page and the JSON of the Katana thesis done again."""

from pathlib import Path

import numpy as np

from studies.influence_study import METHODS, TROUBLES
from studies.katana import KatanaReproduction
from studies.katana_figures import katana_pictures
from studies.katana_pencil import pencil_picture
from studies.katana_study import AS_BAD, REMAINDER, TITLES, KatanaStudy, spread
from studies.katana_tracking import PATHS, STEPS
from studies.katana_tracking_claims import tracking_pictures
from studies.page import SCHEMA, Json, Page, Sheet, findings_json, plural, write_page
from workbench.base.files import check_folder
from workbench.base.progress import part_of

TITLE = "Joint tilting and influence-based calibration of the Katana 450, done again"
SOURCE = (
    "Thesis on the calibration of the Katana 450 serial robot: influence-based identification (chapter 3), "
    "joint tilting (chapter 4), trajectory tracking (chapter 5)"
)


def katana_json(found: KatanaReproduction) -> Json:
    """Every finding, and the spread of errors over the arms."""
    return {
        "schema": SCHEMA,
        "work": "katana",
        "source": SOURCE,
        "arms": found.arms,
        "seed": found.seed,
        "remainder_deg": np.rad2deg(REMAINDER),
        **findings_json(found.findings),
        "studies": [_study_json(study) for study in (found.once, found.twice, found.as_bad)],
        "diagnosed": {"held_out_mm": found.diagnosed.held_out, "plays_named": found.diagnosed.named},
        "inclinometer_relative_errors": found.experiments.errors,
        "influence_mean_mm": dict(
            zip(found.influences.names, (1e3 * found.influences.mean).tolist(), strict=True)
        ),
        "influence_study": [
            {
                "trouble": trouble.name,
                "poses": number,
                "method": method,
                "ratio": found.weights.ratio(t, n, m)._asdict(),
            }
            for t, trouble in enumerate(TROUBLES)
            for n, number in enumerate(found.weights.numbers)
            for m, method in list(enumerate(METHODS))[1:]
        ],
        "tracking_mm": {
            path: {step: found.tracking.spread(s, p)._asdict() for s, step in enumerate(STEPS)}
            for p, path in enumerate(PATHS)
        },
    }


def write_katana(found: KatanaReproduction, folder: Path | str) -> Path:
    """Write the page with its pictures and `result.json`; whatever else the folder holds stays.

    Returns:
        The page.

    Raises:
        FileError: the folder is a file.
    """
    check_folder(folder)
    with part_of(0.0, 0.6):
        pictures = katana_pictures(found)
    with part_of(0.6, 0.4):
        tracking = tracking_pictures(found.tracking)
    page = Page(
        title=TITLE,
        source=SOURCE,
        facts=_facts(found),
        findings=found.findings,
        summary=(_held_out(found),),
        pictures=(*pictures, *tracking, pencil_picture(found.pencil)),
        sheets=found.sheets,
        omitted="Figs. 3.1 to 3.7, 4.1 to 4.7 and 4.9 are photographs and drawings.",
    )
    return write_page(page, katana_json(found), folder)


def _facts(found: KatanaReproduction) -> tuple[str, ...]:
    return (
        plural(found.findings),
        f"{found.arms} virtual arms from a generator that shares nothing with the model: errors of the size "
        "of Table 3.2, tilting of Tables 4.3 and 4.4, 118 points measured with 0.01 mm noise; seed "
        f"{found.seed}.",
        f"Each joint carries waves of {np.rad2deg(REMAINDER):g}° (standard deviation) that neither "
        "constants nor tilting can hold. This is the only size that was chosen, so that calibration without "
        f"tilting ends where the thesis's does; rows that say so have {AS_BAD:g} times the errors of Table "
        "3.2 besides, so that arms begin where the thesis's did.",
    )


def _held_out(found: KatanaReproduction) -> Sheet:
    """Errors where nothing was measured, for both readings of the printed play."""
    rows = tuple(
        (title, *(spread(study.held_out[:, column]).text(3) for study in (found.once, found.twice)),
         spread(found.once.turned[:, column]).text(3))
        for column, title in enumerate(TITLES)
    )  # fmt: skip
    diagnosed = spread(found.diagnosed.held_out).text(3)
    rows = (*rows, (f"diagnosed ({len(found.diagnosed.held_out)} arms)", diagnosed, "–", "–"))
    return Sheet(
        "Mean errors at 118 poses that took no part",
        ("", "play from side to side [mm]", "play to either side [mm]", "orientation, side to side [°]"),
        rows,
        "Median over the arms, and the range of nine in ten.",
    )


def _study_json(study: KatanaStudy) -> Json:
    return {
        "share_of_printed_play": study.play,
        "multiple_of_table_3_2": study.share,
        "columns": list(TITLES),
        **{
            name: [spread(table[:, column])._asdict() for column in range(len(TITLES))]
            for name, table in (
                ("measured_mm", study.measured[:, :, 2, 3]),
                ("held_out_mm", study.held_out),
                ("ten_points_mm", study.ten.mean(axis=2)),
                ("held_out_deg", study.turned),
            )
        },
    }
