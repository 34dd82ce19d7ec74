"""All figures of a diagnosis, with captions that explain how to read them."""

from functools import partial

from matplotlib.figure import Figure

from workbench.diagnosis.report.ranking import ranking
from workbench.diagnosis.result import Diagnosis
from workbench.extras.reports.apparent_errors import FinalRows
from workbench.extras.reports.diagnosis_errors import arrows, errors
from workbench.extras.reports.effect_plots import against_drivers, shapes
from workbench.extras.reports.structure_plot import along_axis, row_by_row
from workbench.report.figures import Picture, draw

DRAWN = 12
"""Maximum number of effects drawn over their drivers, largest contribution first."""
OF_AN_EFFECT = (
    "Every measured row as the error that it shows, all other parts of the model subtracted (partial "
    "residuals). Left: without this effect; the line is the identified law. Right: what remains with it. "
    "Squares: means of neighbouring rows."
)


def pictures(result: Diagnosis) -> tuple[Picture, ...]:
    """Every figure that the result can fill, in the order of the page."""
    return (
        Picture(
            "errors",
            "Errors before and after",
            "Nominal arm (base and tool fitted where free), identified geometry alone, and geometry with the "
            "effects that were added. Right: the errors of single rows.",
            partial(errors, result),
        ),
        *_of_events(result),
        Picture(
            "ranking",
            "What each candidate would add",
            "Log evidence of each effect when it is added to the geometry alone, and the probability p that "
            "chance alone adds as much. Similar effects rank high together; only those supported beside the "
            "others were added.",
            partial(ranking, result),
        ),
        *_of_effects(result),
        Picture(
            "shapes",
            "Errors of joints over their position",
            "Sum of the effects of each joint, less its mean over the rows, which is the joint's zero. Band: "
            "two standard errors either way. Ticks: measured positions.",
            partial(shapes, result),
        ),
        *_of_structure(result),
        Picture(
            "arrows",
            "Residuals in space",
            "Measured minus predicted position at the measured points, much exaggerated, in the measuring "
            "frame; both sides have the same scale. Neighbours that agree point to a missing effect.",
            partial(arrows, result),
        ),
    )


def _of_events(result: Diagnosis) -> tuple[Picture, ...]:
    """Events during the measurements."""
    if not result.events:
        return ()
    text = "Fitted rows. Dashed lines: what happened, and the first row after it."
    return (Picture("events", "Errors row by row", text, partial(row_by_row, result)),)


def _of_structure(result: Diagnosis) -> tuple[Picture, ...]:
    """Residuals along the axis with structure, or in the order of the rows."""
    found = result.structure
    if found.shown is None:
        return ()
    text = f"it {found.sentence}" if found.found else f"no structure along any of {len(found.axes)} axes"
    return (
        Picture(
            "structure",
            f"Residuals along {found.shown.name}",
            f"Fitted rows at the final model: {text}. Lines: means of neighbouring rows. Noise scatters "
            "about zero everywhere; dashed lines: events.",
            partial(along_axis, result),
        ),
    )


def _of_effects(result: Diagnosis) -> tuple[Picture, ...]:
    """Every accepted effect against what drives it."""
    if not result.effects:
        return ()
    rows = FinalRows.of(result)
    return tuple(
        Picture(f"effect-{k + 1}", found.text, OF_AN_EFFECT, partial(against_drivers, found, rows))
        for k, found in enumerate(result.effects[:DRAWN])
    )


def figure(result: Diagnosis, name: str = "") -> Figure:
    """One of the report's figures: `ranking`, `errors`, `effect-1`, `shapes`, `arrows`.

    Without a name: the ranking; the errors where nothing was ranked.
    """
    return draw(pictures(result), name or ("ranking" if result.ranking else "errors"))
