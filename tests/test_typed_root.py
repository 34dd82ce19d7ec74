"""What a type checker sees of the root is what there is."""

import ast
import re
import subprocess
import sys
from dataclasses import is_dataclass
from importlib import import_module
from importlib.metadata import version
from inspect import isfunction, signature, unwrap
from pathlib import Path
from typing import get_args

import pytest

import workbench as wb

ROOT = Path(__file__).parent.parent
READ = {"Naming", "TableReading"}
GIVEN_BY_NAME = READ | {"Production", "Task", "Displayed", "Rig", "AbstractEffect"}
"""Records that have a word, or that only what returned them takes."""


@pytest.mark.slow
def test_calls_of_the_documentation_are_typed(tmp_path):
    pytest.importorskip("mypy")
    pages = [ROOT / "README.md", *sorted((ROOT / "assets" / "docs").rglob("*.md"))]
    blocks = [block for page in pages for block in re.findall(r"```python\n(.*?)```", page.read_text(), re.S)]
    assert blocks
    for number, block in enumerate(blocks):
        (tmp_path / f"block{number}.py").write_text(block)
    command = [sys.executable, "-m", "mypy", *tmp_path.glob("*.py")]
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, check=False)
    assert done.returncode == 0, done.stdout


def stub():
    """Modules and names that the stub imports; of extras those that are installed."""
    body = ast.parse((ROOT / "workbench" / "__init__.pyi").read_text(encoding="utf-8")).body
    imports = [node for node in body if isinstance(node, ast.ImportFrom)]
    homes = {node: ROOT / str(node.module).replace(".", "/") for node in imports}
    here = [node for node, home in homes.items() if home.is_dir() or home.with_suffix(".py").is_file()]
    return [(str(node.module), alias.name) for node in here for alias in node.names if alias.asname]


def test_the_stub_names_what_there_is():
    """Every name, by the name that it has where it is defined, with its parameters there."""
    assert sorted(name for _, name in stub()) == dir(wb) == wb.__all__
    assert wb.__version__ == version("arm-calibration-workbench")
    for home, name in stub():
        here, there = getattr(wb, name), getattr(import_module(home), name)
        assert getattr(here, "__qualname__", name) == name
        assert unwrap(here) is unwrap(there)
        assert signature(here) == signature(there)


def test_records_that_verbs_take_stand_at_the_root():
    verbs = [verb for name in dir(wb) if isfunction(verb := getattr(wb, name))]
    hints = (p.annotation for verb in verbs for p in signature(verb).parameters.values())
    ours = (part for part in leaves(*hints) if isinstance(part, type) and is_dataclass(part))
    assert {part.__name__ for part in ours} - set(dir(wb)) <= GIVEN_BY_NAME


def leaves(*hints):
    for hint in hints:
        yield from leaves(*get_args(hint)) if get_args(hint) else (hint,)
