"""Held-out errors of saved files: a TOML holds the whole model, a URDF the best purely geometric one."""

import numpy as np

from workbench.arm.calibration_record import MAX_POSITION, MAX_ROTATION
from workbench.arm.robot import Robot
from workbench.arm.usable import unobserved_text, usable_arm
from workbench.base.wording import in_mm, plural
from workbench.data.dataset import Dataset
from workbench.identification.result import Identification, Run, judged
from workbench.identification.row_errors import Errors, row_errors


def file_errors(found: Identification, run: Run) -> dict[str, Errors]:
    """Errors of each format's arm on held-out rows, or on the fitted ones if none were held out.

    A format is omitted where its error is unknown: held-out sessions without any fitted row.
    """
    rows = found.held_out_data if len(found.held_out_data) else found.data.take(found.train_rows)
    return _errors(found, run, run.as_measured, rows)


def refitted_errors(found: Identification, run: Run) -> dict[str, Errors]:
    """Errors of the files after the final fit to all rows, on these rows; empty if there was none."""
    return {} if run.judged is None else _errors(found, run, run.fit.calibrated, run.fit.problem.data)


def _errors(found: Identification, run: Run, arm: Robot, rows: Dataset) -> dict[str, Errors]:
    """Errors of each format's arm on some rows."""
    problem = run.fit.problem
    if found.frames.base_per_session and set(rows.sessions) - set(problem.data.sessions):
        return {"TOML": judged(run)}
    places = {**problem.known, **problem.instrument(run.fit.x)}
    whole = Errors.of(row_errors(arm, rows, known=places))
    carried = _files(arm)["URDF"]
    if carried.elements == arm.elements and not arm.effects:
        return {"TOML": whole, "URDF": whole}
    return {"TOML": whole, "URDF": Errors.of(row_errors(carried, rows, known=places))}


def _files(arm: Robot) -> dict[str, Robot]:
    return {"TOML": arm, "URDF": usable_arm(arm, effects=False).robot}


def judging_rows(found: Identification) -> str:
    """Name of the rows on which the files' errors are computed."""
    return "held-out rows" if len(found.held_out_data) else "fitted rows"


def file_text(found: Identification, run: Run) -> str:
    """These errors in one line, with notes."""
    return "; ".join(
        filter(None, (" · ".join(sizes(file_errors(found, run)).values()), *file_notes(found, run)))
    )


def file_notes(found: Identification, run: Run) -> list[str]:
    """Notes on the files, as clauses: the final fit, sessions, the flange apart from the measured point."""
    notes = []
    if again := " · ".join(sizes(refitted_errors(found, run)).values()):
        rows = plural(len(run.fit.problem.data), "row")
        notes.append(f"after the final fit to all {rows}: {again}")
    arm = run.fit.calibrated
    if arm.sessions:
        first = next(iter(arm.sessions))
        notes.append(f"each session with its own base; a URDF holds only that of '{first}'")
    seen = arm.calibration
    if seen is not None and (at := seen.observed) is not None:
        known = f"flange uncertain by {in_mm(at.flange.position)} and {np.rad2deg(at.flange.rotation):.2g}°"
        if at.flange.position > MAX_POSITION or at.flange.rotation > MAX_ROTATION:
            known = "the flange could not be observed separately from the tool"
        notes += unobserved_text(arm, _files(arm)) or [known]
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
