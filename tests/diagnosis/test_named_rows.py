"""What is named: rows that stand out."""

import numpy as np
from refusals import mentions

from workbench.identification.rows.excluded_outliers import stand_out_note


def test_held_out_rows_that_stand_out_are_named_with_the_mean_without_them():
    errors = np.array([0.1, 0.12, 0.09, 1.2, 0.11, np.nan]) * 1e-3
    result = stand_out_note(np.array([3, 8, 20, 125, 130, 140]), errors)
    assert "125" in result
    assert mentions(result, "1.2 mm")
    assert mentions(result, "0.105 mm")
    assert stand_out_note(np.arange(5), errors[[0, 1, 2, 4, 5]]) == ""
    assert stand_out_note(np.arange(0), errors[:0]) == ""
    assert stand_out_note(np.arange(2), np.full(2, np.nan)) == ""
