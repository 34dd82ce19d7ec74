"""The notebooks: every cell runs as it is written, and shows what the executed ones have kept."""

import ast
import json
import urllib.request
import webbrowser
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow
NOTEBOOKS = sorted((Path(__file__).parent / "notebooks").glob("*.ipynb"))
LARGEST = 5000
"""Characters of an answer in a terminal; a table fits a screen."""


def answer(source: str, names: dict) -> object:
    """Run a cell; the value of its last line, as a notebook shows it."""
    tree = ast.parse(source)
    last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, "cell", "exec"), names)
    return None if last is None else eval(compile(ast.Expression(last.value), "cell", "eval"), names)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebooks_show_what_they_say(path, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(webbrowser, "open", lambda url: True)
    names: dict = {}
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    is_executed = any(cell.get("outputs") for cell in cells)
    for cell in (cell for cell in cells if cell["cell_type"] == "code"):
        source, kept = "".join(cell["source"]), cell["outputs"]
        if "stop()" in source:
            with urllib.request.urlopen(names["page"].url) as page:
                assert b"<html" in page.read()
        value = answer(source, names)
        assert not [out for out in kept if out["output_type"] == "error"]
        kinds = {kind for out in kept for kind in out.get("data", {})}
        is_shown = hasattr(value, "_repr_html_")
        if is_shown:
            assert len(repr(value)) < LARGEST
            assert ("<a href" if value is names.get("page") else "<table") in value._repr_html_()
        if is_executed:
            assert ("text/html" in kinds) == is_shown
