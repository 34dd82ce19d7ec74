"""A verdict is worked out, never written down."""

import ast
from pathlib import Path

import pytest

STUDIES = sorted(p for p in Path(__file__).parent.glob("*.py") if not p.name.startswith("test_"))


@pytest.mark.parametrize("path", STUDIES, ids=lambda path: path.stem)
def test_whether_a_number_agrees_is_computed(path):
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Call) and ast.unparse(node.func) == "judged":
            arguments = dict(enumerate(node.args)) | {k.arg: k.value for k in node.keywords}
            agrees = arguments.get(4, arguments.get("agrees"))
            assert not isinstance(agrees, ast.Constant), f"{path.name}, line {node.lineno}"
