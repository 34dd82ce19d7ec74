"""A verdict is worked out, never written down."""

import ast
from pathlib import Path

import numpy as np
import pytest

from studies.finding import Verdict, checked, judged
from studies.page import plural

STUDIES = sorted(p for p in Path(__file__).parent.glob("*.py") if not p.name.startswith("test_"))


@pytest.mark.parametrize("path", STUDIES, ids=lambda path: path.stem)
def test_whether_a_number_agrees_is_computed(path):
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Call) and ast.unparse(node.func) == "judged":
            arguments = dict(enumerate(node.args)) | {k.arg: k.value for k in node.keywords}
            agrees = arguments.get(4, arguments.get("agrees"))
            assert not isinstance(agrees, ast.Constant), f"{path.name}, line {node.lineno}"


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
    assert "Another 4 checks" in text
