"""What the error of an arm is made of: what each step of the model takes off it, and what it leaves."""

import numpy as np

from workbench.base.wording import capital
from workbench.diagnosis.result import Diagnosis, judged
from workbench.report.chart import Bar, bars
from workbench.report.colours import CALIBRATED, GEOMETRY, NOMINAL


def budget(found: Diagnosis) -> dict[str, float]:
    """What each step takes off the mean held-out position error, and what it leaves [mm]."""
    nominal, before, after = (judged(v).position_mm.mean for v in (found.nominal, found.before, found.after))
    named = after if found.residual_map is None else found.residual_map.before.position_mm.mean
    return {"geometry": nominal - before, "causes": before - named, "map": named - after, "left": after}


def budget_bars(found: Diagnosis) -> str:
    """The size of each cause at the tool, of what has no name, and of what is left behind the geometry."""
    parts = budget(found)
    rows = [
        Bar(capital(cause.plain), cause.contribution_mm, CALIBRATED, str(cause.confidence))
        for cause in found.causes
        if np.isfinite(cause.contribution_mm)
    ]
    if found.residual_map is not None and parts["map"] > 0.0:
        rows.append(Bar("Predicted, without a name", parts["map"], GEOMETRY))
    if np.isfinite(parts["left"]):
        turned = judged(found.after).orientation_deg
        rows.append(
            Bar("Left after all", parts["left"], NOMINAL, "" if turned is None else f"{turned.mean:.3g}°")
        )
    return bars(rows, testid="budget")
