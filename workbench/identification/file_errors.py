"""Held-out errors of what is saved: a TOML holds the whole model, a URDF the geometry that is best alone."""

import numpy as np

from workbench.arm.observed import MOST_POSITION, MOST_ROTATION
from workbench.arm.usable import usable_arm
from workbench.base.wording import in_mm
from workbench.identification.result import Identification, Run, judged
from workbench.identification.row_errors import Errors, row_errors


def file_errors(found: Identification, run: Run) -> dict[str, Errors]:
    """Errors of each format's arm on held-out rows, fitted ones where none were held out.

    A format is left out where its error is not known: held-out sessions that no fitted row has.
    """
    arm = run.judged or run.fit.calibrated
    out = {"TOML": judged(run)}
    carried = usable_arm(arm, effects=False).robot
    if carried.elements == arm.elements and not arm.effects:
        return out | {"URDF": out["TOML"]}
    rows = found.held_out_data if len(found.held_out_data) else found.data.take(found.train_rows)
    problem = run.fit.problem
    if found.frames.base_per_session and set(rows.sessions) - set(problem.data.sessions):
        return out
    places = {**problem.known, **problem.instrument(run.fit.x)}
    return out | {"URDF": Errors.of(row_errors(carried, rows, known=places))}


def file_words(found: Identification, run: Run) -> str:
    """The same in one line, and how far the flange is known beside the measured point."""
    parts = [
        f"{name} {in_mm(1e-3 * errors.position_mm.mean)}"
        for name, errors in reversed(file_errors(found, run).items())
        if np.isfinite(errors.position_mm.mean)
    ]
    words = [" · ".join(parts)] if parts else []
    seen = run.fit.calibrated.calibration
    if seen is not None and (at := seen.observed) is not None:
        known = f"flange known to {in_mm(at.flange.position)} and {np.rad2deg(at.flange.rotation):.2g}°"
        if at.flange.position > MOST_POSITION or at.flange.rotation > MOST_ROTATION:
            known = "the flange was not observed apart from the tool"
        words.append(f"{at.missing}: left as the nominal arm has them" if at.missing else known)
    return "; ".join(words)
