"""Verdicts, and which of them are counted."""

import numpy as np
from refusals import mentions

from studies.finding import Verdict, checked, judged
from studies.page import plural


def test_what_is_not_printed_is_not_counted():
    """Hidden values, arithmetic and empty cells leave the headline; the rest is one rule."""
    found = (
        judged("Table 1", "a", "1.0", "1.0", np.bool_(True)),
        judged("Table 1", "b", "–", "1.0", np.bool_(True)),
        judged("Table 1", "c", "(implied)", "no", np.bool_(False), "why"),
        checked("Table 1", "d", "2.0", "2.0", np.bool_(True)),
        judged("Table 1", "e", "up to 5", "1.0", np.bool_(True)),
    )
    assert [f.verdict for f in found] == [
        Verdict.AGREES, Verdict.HOLDS, Verdict.FAILS, Verdict.HOLDS, Verdict.HOLDS
    ]  # fmt: skip
    text = plural(found)
    assert text.startswith("1 printed numbers and statements: 1 agree, 0 differ")
    assert mentions(text, "4 checks")
