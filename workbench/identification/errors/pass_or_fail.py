"""Pass or fail of the calibrated arm against the required error, on held-out rows if there are any."""

from dataclasses import dataclass

import numpy as np

from workbench.data.accuracy_requirement import Wanted
from workbench.data.prediction import row_components
from workbench.identification.result import Identification, Run


@dataclass(frozen=True, kw_only=True)
class Judged:
    """Rows of an identification, judged.

    Args:
        verdict: In words.
        is_kept: Whether all with a measured point keep the requirement; None where none has one.
        held_out: Whether they were held out; else they are the fitted ones.
    """

    verdict: str
    is_kept: bool | None
    held_out: bool


def judge(result: Identification, wanted: Wanted, *, run: Run | None = None) -> Judged:
    """Compare a run, the best one if none is given, with the required error.

    Held-out rows are judged by an arm that was not fitted to them.
    """
    run = result.best if run is None else run
    held_out = len(result.held_out_data) > 0
    rows = result.held_out_data if held_out else result.data.take(result.train_rows)
    errors = row_components(run.as_measured, rows)
    count = int(errors.has_position.sum())
    failed = int((errors.has_position & ~wanted.within(errors)).sum())
    text = wanted.text if np.isfinite(errors.rotation).any() else wanted.position_text
    where = f"{count} {'held-out rows' if held_out else 'fitted rows (none were held out)'}"
    verdict = f"✗ {failed} of {where} {'misses' if failed == 1 else 'miss'} {text}"
    verdict = verdict if failed else f"✓ Meets {text} on all {where}"
    if not count:
        verdict = "No verdict: no positions were measured"
    return Judged(verdict=verdict, is_kept=not failed if count else None, held_out=held_out)
