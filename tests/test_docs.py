"""README and documentation: what they show is run, everything public is in the reference, and it builds."""

import json
import os
import re
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import typer
from documented_commands import commands, run_lines, unbroken

import workbench
from workbench.cli import app
from workbench.cli.exit_status import SECTIONS

DOCS = Path(__file__).resolve().parents[1] / "assets" / "docs"
ROOT = DOCS.parents[1]
README = (ROOT / "README.md").read_text("utf-8")
TESTS = Path(__file__).parent
PATHS = sorted(DOCS.rglob("*.md"))
PAGES = {p.relative_to(DOCS).with_suffix("").as_posix(): p.read_text(encoding="utf-8") for p in PATHS}
SHOWN = {name: found for name, text in PAGES.items() if (found := commands(text))}
QUICK = {"mocap", "robots"}
"""Pages whose commands together take a second or two."""


@pytest.mark.parametrize(
    "page", [pytest.param(p, marks=[] if p in QUICK else [pytest.mark.slow]) for p in SHOWN if "/" not in p]
)
def test_commands_run_as_shown(page, run, tmp_path):
    (tmp_path / "recordings").symlink_to(ROOT / "recordings")
    run_lines(run, SHOWN[page])


def block(mark):
    """The code block after a mark, in the README or else in a page of the documentation."""
    pattern = re.compile(rf"<!-- {mark} -->\n```\w+\n(.*?)```", re.DOTALL)
    return unbroken(next(found[1] for text in (README, *PAGES.values()) if (found := pattern.search(text))))


def test_commands_of_the_readme(run, tmp_path):
    lines = [line for line in block("try").splitlines() if line.startswith("workbench ")]
    assert len(lines) == 6
    run_lines(run, lines)
    page = (tmp_path / "report" / "report.html").read_text()
    assert "<html" in page
    assert not re.search(r"(src|href)=\"https?://", page)
    assert (tmp_path / "calibrated.urdf").is_file()


def test_commands_of_the_diagnosis(run, tmp_path):
    lines = block("diagnose").splitlines()
    assert len(lines) == 3
    run_lines(run, lines)
    assert 'name = "joint-compliance"' in (tmp_path / "soft.toml").read_text()
    assert (tmp_path / "diagnosis" / "diagnosis.html").is_file()


@pytest.mark.extra("review")
def test_commands_of_recordings(run, tmp_path):
    (tmp_path / "recordings").symlink_to(ROOT / "recordings")
    run_lines(run, block("recordings").splitlines())
    assert (tmp_path / "sample.rrd").is_file()


def test_python_of_the_readme(tmp_path, monkeypatch, capsys):
    """With what the install above it brings: neither pandas nor polars."""
    for name in ("pandas", "polars"):
        monkeypatch.setitem(sys.modules, name, None)
    monkeypatch.chdir(tmp_path)
    exec(compile(block("python"), "README", "exec"), {})
    lines = capsys.readouterr().out.splitlines()
    held_out = [line.split() for line in lines if line.strip().startswith("held out")]
    nominal, calibrated = [float(parts[2]) for parts in held_out]
    assert calibrated < 0.2 < 2.0 < nominal
    assert (tmp_path / "calibrated.urdf").is_file()


def test_python_runs_as_shown(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    blocks = [code for text in PAGES.values() for code in re.findall(r"```python\n(.*?)```", text, re.DOTALL)]
    assert blocks
    for code in blocks:
        exec(compile(code, "page", "exec"), {})


def test_names_of_the_root_are_no_modules():
    """A name that is also a folder would turn from a function into a module at the first import."""
    modules = {path.stem for path in (ROOT / "workbench").iterdir() if path.suffix in ("", ".py")}
    assert not modules & set(workbench.__all__)


def test_everything_public_is_in_the_reference():
    text = "".join(PAGES[name] for name in ("reference", "design", "types"))
    listed = re.findall(r"autofunction:: (\w+)|autoclass:: (\w+)", text)
    assert sorted(a or b for a, b in listed) == workbench.__all__


def test_every_command_is_in_the_table():
    groups = [entry.typer_instance for entry in app.registered_groups]
    names = [command.name or command.callback.__name__ for command in app.registered_commands]
    for group in groups:
        assert f"{group.info.name} " in PAGES["commands"]
    for name in names:
        assert re.search(rf"`(workbench )?{name}\b", PAGES["commands"]), name


def test_every_section_of_the_help_has_a_page(built):
    shown = [name for text in PAGES.values() for name in re.findall(r"\.\. commands:: (\w+)", text)]
    assert sorted(shown) == sorted(SECTIONS)
    assert {command.rich_help_panel for command in built(app).whole.commands.values()} <= set(SECTIONS)


def quoted(text: str) -> list[str]:
    """Commands that sentences and tables name, and lines of shell blocks."""
    sentences = re.sub(r"```.*?```", "", text, flags=re.DOTALL)
    found = re.findall(r"`((?:\.venv/bin/)?workbench [^`]+|(?<=· `)[a-z]+ [^`]+)`", sentences)
    return [line.replace("\\|", "|") for line in [*found, *commands(text)] if "workbench " in line]


def unknown(line: str, known: typer.core.TyperGroup | Any) -> str:
    """What of a command line no command has; empty if it could be run."""
    text = [w for w in line.partition("workbench ")[2].partition("  #")[0].split() if w not in "…·|&&"]
    while text and hasattr(known, "commands"):
        if re.search(r"\.(urdf|csv|toml|xacro)$", text[0]):  # a file in the place of a command
            return ""
        if text[0].startswith("-"):
            break
        if text[0] not in known.whole.commands:
            return text[0]
        context = known.make_context("workbench", [], resilient_parsing=True)
        _, known, text = known.resolve_command(context, text)
    options = {name for parameter in known.params for name in (*parameter.opts, *parameter.secondary_opts)}
    named = re.findall(r"(?<![\w-])--[a-z][\w-]*", " ".join(text))
    return next((name for name in named if name not in {*options, "--help"}), "")


def test_every_command_that_a_text_names_exists_with_its_options(built):
    whole = built(app)
    texts = PAGES | {"README": README, "wings": (ROOT / "workbench" / "README.md").read_text("utf-8")}
    lines = [(name, line) for name, text in texts.items() for line in quoted(text)]
    assert len(lines) > 80
    assert not [(name, line, word) for name, line in lines if (word := unknown(line, whole))]
    assert unknown("workbench identify D --robat R", whole) == "--robat"
    assert unknown("workbench identity D", whole) == "identity"


def test_errors_of_measured_arms_are_the_golden_numbers():
    """Means over the folds, as many digits as the README shows."""
    arms = {"UR10": ("ur10",), "UR5": ("ur5",), "WAM": ("wam",), "Panda 1": ("panda_1", "panda_3"),
            "iiwa 14": ("iiwa14",)}  # fmt: skip
    table = README.partition("## Results on measured arms")[2]

    def means(name: str) -> tuple[list[float], list[float]]:
        """Of geometry: nominal and fitted, position and orientation; of effects: position and orientation."""
        parts = (golden(f"{verb}/{name}") for verb in ("identify", "diagnose"))
        alone, found = ({k: v for k, v in part.items() if k.startswith("fold")} for part in parts)
        geometry = [
            np.mean([v[i] for k, v in alone.items() if stage in k])
            for i in ((0, 1) if name == "ur10" else (0,))
            for stage in ("nominal", "geometry")
        ]
        names = ("position", "turned") if name == "ur10" else ("position",)
        return geometry, [np.mean([v[part][2] for v in found.values()]) for part in names]

    for title, names in arms.items():
        *_, geometry, effects, _ = next(x for x in table.splitlines() if x.startswith(f"| {title}")).split(
            "|"
        )
        for cell, which in ((geometry, 0), (effects, 1)):
            shown, values = re.findall(r"\d+\.\d+", cell), [v for name in names for v in means(name)[which]]
            for text, value in zip(shown, values, strict=True):
                digits = len(text.partition(".")[2])
                assert abs(float(text) - value) <= 0.5001 * 10**-digits, (title, text, value)


def test_what_the_error_of_real_arms_is_made_of_are_the_golden_numbers():
    """Of the first fold: nominal, what geometry, causes and map take, what is left."""
    rows = re.findall(r"^\| ([\w ]+) \| ([\d. |–]+) \|$", PAGES["diagnose"], re.M)
    assert len(rows) == 6
    for title, cells in rows:
        fold = golden(f"diagnose/{title.lower().replace('panda ', 'panda_').replace(' ', '')}")["fold 0"]
        nominal, geometry, left = fold["position"]
        by_map = 0.0 if fold["map_mm"] == "nan" else fold["map_mm"]
        values = (nominal, nominal - geometry, geometry - left - by_map, by_map, left)
        for text, value in zip(cells.replace("–", "0.00").split(" | "), values, strict=True):
            assert float(text) == pytest.approx(value, abs=0.00501), (title, text, value)


def golden(part: str) -> dict[str, Any]:
    return json.loads((TESTS / "benchmarks" / "golden.json").read_text("utf-8"))[part]["numbers"]


def test_figures_of_the_peers_task_are_the_golden_numbers():
    """Ours, on the page; those of the page, in the README."""
    page, ours = PAGES["other-tools"], golden("peers")
    for title, way in (("search alone (OPT2)", "OPT2"), ("`identify` with all checks", "identify")):
        errors = (ours[f"{way}, {arm}"]["mm, deg"] for arm in ("plain", "tilted"))
        cells = " | ".join(f"{mm:.3f} mm, {deg:.4f}°" for mm, deg in errors)
        assert f"| workbench | {title} | {cells} |" in page
    figures = re.findall(r"(\d\.\d{3}) mm", README.partition("## Which tool")[2])
    assert len(figures) > 3
    assert not [figure for figure in figures if f"{figure} mm" not in page]


def test_what_is_linked_exists():
    texts = PAGES | {"../../README": README}
    for name, text in texts.items():
        for target in re.findall(r"\]\(([^)#:]+)[^)]*\)", text):
            assert ((DOCS / name).parent / target).exists(), f"{name}: {target}"


@pytest.mark.slow
def test_it_builds_and_needs_no_network(tmp_path):
    if find_spec("sphinx") is None:
        reason = "the documentation's tools are not installed (extra 'docs')"
        pytest.fail(reason) if os.environ.get("CI", "").lower() == "true" else pytest.skip(reason)
    command = [sys.executable, "-m", "sphinx", "-W", "-q", "-b", "html", "-d", tmp_path / "trees"]
    done = subprocess.run(
        [*command, DOCS, tmp_path / "html"], capture_output=True, text=True, cwd=ROOT, check=False
    )
    assert done.returncode == 0, done.stderr
    pages = list((tmp_path / "html").rglob("*.html"))
    assert len(pages) > len(PAGES) + 10
    for page in pages:
        fetched = re.findall(r'(?:src|<link[^>]* href)="(https?:)?//[^"]+', page.read_text(encoding="utf-8"))
        assert not fetched, page
