"""The result that a diagnosis saves: its model refitted on all rows except those that no arm explains.

Held-out errors are those before this refit, which takes place after all decisions.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool

from workbench.diagnosis.refit import LAST_STEPS, refit
from workbench.diagnosis.rounds import Searched
from workbench.identification.fit import Fit
from workbench.identification.preparation import Prepared


def fitted_on_all(
    ready: Prepared, last: Searched, left_out: Bool[np.ndarray, " rows"]
) -> tuple[Fit, str | None]:
    """The last arm refitted to training and held-out rows, and a note.

    Held-out rows of another file are not used: then, and if the fit does not converge, it is the last arm
    itself.

    Args:
        ready: The rows.
        last: The last search, at the fit to be repeated.
        left_out: Held-out rows that are not fitted.
    """
    stage = last.stage
    before = stage.fitted.fit
    if not len(ready.held_out_rows) or left_out.all():
        return before, None
    own = np.concatenate([before.problem.data.row, ready.held.row[~left_out]])
    rows = ready.data.take(np.isin(ready.data.row, own))
    found = refit(
        replace(stage.geometric, robot=ready.with_new_session_bases(stage.geometric.robot, ready.held)),
        last.grams,
        last.found.model,
        data=rows,
        begin=before.problem.named(before.x),
        steps=LAST_STEPS,
        holds=True,
    ).fit
    if before.outcome.ok and not found.outcome.ok:
        return (
            before,
            f"the refit to all rows did not converge ({found.outcome}); the arm without it is saved",
        )
    out = ", except suspects" if left_out.any() else ""
    return found, (
        f"the saved arm was refitted to all {len(rows)} rows, held-out ones included{out}; held-out errors "
        "are those before this refit"
    )
