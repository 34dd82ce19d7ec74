"""The documentation: what its pages show is run, everything public is in its reference, and it builds."""

import os
import re
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest
from shown import commands, run_lines

import workbench
from workbench.cli import app

DOCS = Path(__file__).resolve().parents[1] / "assets" / "docs"
PAGES = {path.stem: path.read_text(encoding="utf-8") for path in sorted(DOCS.glob("*.md"))}
SHOWN = {name: found for name, text in PAGES.items() if (found := commands(text))}
QUICK = {"mocap", "robots"}
"""Pages whose commands together take a second or two."""


@pytest.mark.parametrize(
    "page", [pytest.param(p, marks=[] if p in QUICK else [pytest.mark.slow]) for p in SHOWN]
)
def test_commands_run_as_shown(page, run, tmp_path):
    (tmp_path / "recordings").symlink_to(DOCS.parents[1] / "recordings")
    run_lines(run, SHOWN[page])


def test_python_runs_as_shown(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    blocks = [code for text in PAGES.values() for code in re.findall(r"```python\n(.*?)```", text, re.DOTALL)]
    assert blocks
    for code in blocks:
        exec(compile(code, "page", "exec"), {})


def test_everything_public_is_in_the_reference():
    listed = re.findall(r"autofunction:: (\w+)|autoclass:: (\w+)", PAGES["reference"])
    assert sorted(a or b for a, b in listed) == workbench.__all__


def test_every_command_is_in_the_table():
    groups = [entry.typer_instance for entry in app.registered_groups]
    names = [command.name or command.callback.__name__ for command in app.registered_commands]
    for group in groups:
        assert f"{group.info.name} " in PAGES["commands"]
    for name in names:
        assert re.search(rf"`(workbench )?{name}\b", PAGES["commands"]), name


def test_pictures_and_pages_that_are_linked_exist():
    for name, text in PAGES.items():
        for target in re.findall(r"\]\(([^)#]+)[^)]*\)", text):
            assert (DOCS / target).is_file(), f"{name}: {target}"


@pytest.mark.slow
def test_it_builds_and_needs_no_network(tmp_path):
    if find_spec("sphinx") is None:
        reason = "the documentation's tools are not installed (extra 'docs')"
        pytest.fail(reason) if os.environ.get("CI", "").lower() == "true" else pytest.skip(reason)
    command = [sys.executable, "-m", "sphinx", "-W", "-q", "-b", "html", "-d", tmp_path / "trees"]
    done = subprocess.run(
        [*command, DOCS, tmp_path / "html"], capture_output=True, text=True, cwd=DOCS.parents[1], check=False
    )
    assert done.returncode == 0, done.stderr
    pages = list((tmp_path / "html").rglob("*.html"))
    assert len(pages) > len(PAGES) + 10
    for page in pages:
        fetched = re.findall(r'(?:src|<link[^>]* href)="(https?:)?//[^"]+', page.read_text(encoding="utf-8"))
        assert not fetched, page
