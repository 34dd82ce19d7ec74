"""Error budget of an arm: what each step of the model explains, and what remains."""

import numpy as np

from workbench.base.wording import capital
from workbench.diagnosis.result import Diagnosis, judged
from workbench.report.chart import Bar, bars
from workbench.report.colours import CALIBRATED, GEOMETRY, NOMINAL


def budget(found: Diagnosis) -> dict[str, float]:
    """Reduction of the mean held-out position error by each step, and the remaining error [mm]."""
    nominal, before, after = (judged(v).position_mm.mean for v in (found.nominal, found.before, found.after))
    named = after if found.residual_map is None else found.residual_map.before.position_mm.mean
    return {"geometry": nominal - before, "causes": before - named, "map": named - after, "left": after}


def budget_bars(found: Diagnosis) -> str:
    """Size at the tool of each cause, of the unnamed part, and of the remaining error after the geometry."""
    parts = budget(found)
    rows = [
        Bar(capital(cause.plain), cause.contribution_mm, CALIBRATED, str(cause.confidence))
        for cause in found.causes
        if np.isfinite(cause.contribution_mm)
    ]
    if found.residual_map is not None and parts["map"] > 0.0:
        rows.append(Bar("Predicted, unnamed", parts["map"], GEOMETRY))
    if np.isfinite(parts["left"]):
        turned = judged(found.after).orientation_deg
        rows.append(Bar("Remaining", parts["left"], NOMINAL, "" if turned is None else f"{turned.mean:.3g}°"))
    return bars(rows, testid="budget")
