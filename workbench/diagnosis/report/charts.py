"""Error budget of an arm: what each step of the model explains, and what remains."""

import numpy as np

from workbench.base.wording import capital
from workbench.diagnosis.result import Diagnosis, judged
from workbench.report.chart import Bar, Bars
from workbench.report.colours import CALIBRATED, GEOMETRY, NOMINAL


def budget_bars(found: Diagnosis) -> Bars:
    """Size at the tool of each cause, of the unnamed part, and of the remaining error after the geometry."""
    after = judged(found.after)
    rows = [
        Bar(capital(cause.plain), cause.contribution_mm, CALIBRATED, str(cause.confidence))
        for cause in found.causes
        if np.isfinite(cause.contribution_mm)
    ]
    if (mapped := found.residual_map) is not None:
        unnamed = mapped.before.position_mm.mean**2 - after.position_mm.mean**2
        rows += [Bar("Predicted, unnamed", float(np.sqrt(unnamed)), GEOMETRY)] if unnamed > 0.0 else []
    if np.isfinite(after.position_mm.mean):
        turned = "" if after.orientation_deg is None else f"{after.orientation_deg.mean:.3g}°"
        rows.append(Bar("Remaining", after.position_mm.mean, NOMINAL, turned))
    return Bars(rows, "Sizes at the tool [mm], which add in squares", testid="budget")
