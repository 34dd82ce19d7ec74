"""Held-out errors of saved files, for display, and why a file should not be used."""

import numpy as np

from workbench.arm.calibration_record import MAX_POSITION, MAX_ROTATION
from workbench.arm.usable_arm import unobserved_text
from workbench.base.advice import beside
from workbench.base.wording import in_mm
from workbench.identification.errors.row_errors import Errors
from workbench.identification.result import Run


@beside("errors of the files after the final fit", {})
def refitted_errors(run: Run) -> dict[str, Errors]:
    """Errors of the files after the final fit to all rows, on these rows; empty if there was none."""
    return {} if run.before_refit is None else run.saved.format_errors(run.fit.problem.data, run.places)


def file_text(run: Run) -> str:
    """Which rows these are, the errors, and notes, in one line."""
    errors = " · ".join(sizes(run.file_errors).values())
    return "; ".join((f"{judging_text(run)}: {errors or 'not known'}", *file_notes(run)))


def judging_text(run: Run) -> str:
    """The rows on which `Run.file_errors` are: `24 held-out rows`."""
    kind = "held-out row" if run.judging is run.held_out_data else "fitted row"
    return run.saved.rows_text(run.judging, kind)


@beside("notes on the files", ())
def file_notes(run: Run) -> list[str]:
    """Notes on the files, as clauses: the final fit, sessions, the flange apart from the measured point."""
    notes = []
    if again := " · ".join(sizes(refitted_errors(run)).values()):
        where = run.saved.rows_text(run.fit.problem.data, "fitted row")
        notes.append(f"after the final fit to all rows: {again} on {where}")
    arm = run.saved.robot
    if arm.sessions:
        first = next(iter(arm.sessions))
        notes.append(f"each session with its own base; a URDF holds only that of '{first}'")
    seen = arm.calibration
    if seen is not None:
        at = seen.observed
        known = f"flange uncertain by {in_mm(at.flange.position)} and {np.rad2deg(at.flange.rotation):.2g}°"
        if at.flange.position > MAX_POSITION or at.flange.rotation > MAX_ROTATION:
            known = "the flange could not be observed separately from the tool"
        notes += unobserved_text(arm, run.saved.formats) or [known]
    return notes


def sizes(formats: dict[str, Errors]) -> dict[str, str]:
    """Mean errors of each format, such as `URDF 0.512 mm 0.1916°`: a file can be checked against them."""
    parts = {}
    for name, errors in reversed(formats.items()):
        some = [f"{errors.position_mm.mean:.3f} mm"] if np.isfinite(errors.position_mm.mean) else []
        some += [] if errors.orientation_deg is None else [f"{errors.orientation_deg.mean:.4f}°"]
        if some:
            parts[name] = " ".join((name, *some))
    return parts
