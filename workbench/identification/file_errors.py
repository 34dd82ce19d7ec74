"""Held-out errors of what is saved: a TOML holds the whole model, a URDF the geometry that is best alone."""

import numpy as np

from workbench.arm.calibration_record import MAX_POSITION, MAX_ROTATION
from workbench.arm.robot import Robot
from workbench.arm.usable import unobserved_text, usable_arm
from workbench.base.wording import in_mm, plural
from workbench.data.dataset import Dataset
from workbench.identification.result import Identification, Run, judged
from workbench.identification.row_errors import Errors, row_errors


def file_errors(found: Identification, run: Run) -> dict[str, Errors]:
    """Errors of each format's arm on held-out rows, fitted ones where none were held out.

    A format is left out where its error is not known: held-out sessions that no fitted row has.
    """
    rows = found.held_out_data if len(found.held_out_data) else found.data.take(found.train_rows)
    return _errors(found, run, run.as_measured, rows)


def refitted_errors(found: Identification, run: Run) -> dict[str, Errors]:
    """Errors of the files themselves where they were fitted once more to all rows, on those; else empty."""
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


def file_text(found: Identification, run: Run) -> str:
    """The same in one line, and how far the flange is known beside the measured point."""
    return "; ".join(
        filter(None, (" · ".join(sizes(file_errors(found, run)).values()), *file_notes(found, run)))
    )


def file_notes(found: Identification, run: Run) -> list[str]:
    """What else must be known of the files: as clauses."""
    notes = []
    if again := " · ".join(sizes(refitted_errors(found, run)).values()):
        rows = plural(len(run.fit.problem.data), "row")
        notes.append(f"fitted again to all {rows}, the files leave {again} on those")
    arm = run.fit.calibrated
    if arm.sessions:
        first = next(iter(arm.sessions))
        notes.append(f"every session on its own base, of which a URDF holds that of '{first}'")
    seen = arm.calibration
    if seen is not None and (at := seen.observed) is not None:
        known = f"flange known to {in_mm(at.flange.position)} and {np.rad2deg(at.flange.rotation):.2g}°"
        if at.flange.position > MAX_POSITION or at.flange.rotation > MAX_ROTATION:
            known = "the flange was not observed apart from the tool"
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
