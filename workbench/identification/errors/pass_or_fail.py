"""Pass or fail of the calibrated arm against the required error, on held-out rows if there are any."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Int

from workbench.data.accuracy_requirement import Wanted, WantedCheck
from workbench.data.prediction import row_components
from workbench.identification.result import Identification, Run


@dataclass(frozen=True, eq=False, kw_only=True)
class Judged:
    """Rows of an identification, judged.

    Args:
        check: Which of them meet the requirement.
        rows: Their numbers in the file.
        held_out: Whether they were held out; else they are the fitted ones.
    """

    check: WantedCheck
    rows: Int[np.ndarray, " rows"]
    held_out: bool

    @property
    def failed(self) -> list[int]:
        """Numbers of the rows that exceed it."""
        return self.rows[self.check.judged & ~self.check.passed].tolist()

    @property
    def where(self) -> str:
        return "held-out rows" if self.held_out else "fitted rows (none were held out)"

    @property
    def verdict(self) -> str:
        count = int(self.check.judged.sum())
        if not count:
            return "No verdict: no positions were measured"
        if not self.failed:
            return f"✓ Meets {self.check.text} on all {count} {self.where}"
        text = "misses" if len(self.failed) == 1 else "miss"
        return f"✗ {len(self.failed)} of {count} {self.where} {text} {self.check.text}"


def judge(result: Identification, wanted: Wanted, *, run: Run | None = None) -> Judged:
    """Compare a run, the best one if none is given, with the required error.

    Held-out rows are judged by an arm that was not fitted to them.
    """
    run = result.best if run is None else run
    held_out = len(result.held_out_data) > 0
    rows = result.held_out_data if held_out else result.data.take(result.train_rows)
    check = wanted.check(row_components(run.as_measured, rows))
    return Judged(check=check, rows=rows.row, held_out=held_out)
