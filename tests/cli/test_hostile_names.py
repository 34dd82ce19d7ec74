"""Names with markup, escapes of terminals, turned writing and formulas: nothing obeys them."""

import csv
import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from refusals import refuses

from workbench import load_robot, measure_poses, read_measurements, write_toml
from workbench.arm.robot_toml import read_toml
from workbench.base.errors import FileError, RobotError
from workbench.base.wording import as_cell, of_cell, readable
from workbench.cli import options
from workbench.data.writer import measurements_csv
from workbench.report.blocks import ResultTable, Sentence
from workbench.report.chart import Bar, Bars
from workbench.report.result_display import as_html, as_markdown
from workbench.views.page import html

MARKUP = "<script>alert(1)</script>[red]x[/red]&amp"
OBEYED = "\x1b[31m\x07\r\x9b2J\u202e\u2066\u200f"
FORMULAS = ("=cmd|' /C calc'!A0", "+1+1", "-2+3", "@SUM(A1)", "'=1", "\t=1")


def obeyed(text: str) -> list[str]:
    return [c for c in text if (c in OBEYED and not c.isascii()) or c in "\x1b\x07\r\x9b"]


def test_a_terminal_obeys_no_name(capfd):
    options.show([ResultTable(MARKUP, ("name",), [(OBEYED + "a",)]), Sentence(OBEYED, MARKUP)])
    options.say(OBEYED + "b")
    options.say_notes([OBEYED + "c"])
    out = capfd.readouterr().out
    assert obeyed(out) == []
    assert [line for line in out.splitlines() if "note: " in line]
    assert readable("ü → 3 mm\tx\ny — „z“") == "ü → 3 mm\tx\ny — „z“"


def test_a_page_obeys_no_name():
    text = html.text(MARKUP + OBEYED)
    assert obeyed(text) == []
    assert "<" not in text
    hostile = MARKUP + OBEYED
    charts = Bars([Bar(hostile, 1.0, "red")], hostile)
    blocks = [Sentence(hostile, hostile), ResultTable(hostile, (hostile,), [(hostile,)]), charts]
    for made in (as_html(blocks), as_markdown(blocks)):
        assert obeyed(made) == []
    assert "<script" not in as_html(blocks)
    assert ("<b>" + as_html(blocks)).startswith("<b>")  # put together with other markup, that stays


@pytest.mark.parametrize("name", ["a\nimport os", "a\x1b[2J", "a\u202eb", "a\x00"])
def test_an_arm_s_name_is_one_line_of_text(tmp_path, name):
    """It stands in comments of the programs that are exported."""
    arm = load_robot("aria")
    with refuses(RobotError, found=name):
        replace(arm, name=name)
    path = write_toml(arm, tmp_path / "arm.toml")
    quoted = "".join(f"\\u{ord(c):04x}" for c in name)
    path.write_text(path.read_text().replace('"ARIA"', f'"{quoted}"'))
    with refuses(FileError, ascii(name), path=str(path)):
        read_toml(path)


@given(st.text())
def test_a_cell_comes_back_as_it_was(text):
    cell = as_cell(text)
    assert of_cell(cell) == text
    assert cell in (text, f"'{text}")


def test_a_spreadsheet_computes_nothing_of_ours(tmp_path):
    _, rows = measure_poses(load_robot("aria"), 12, seed=1)
    labels = np.array([*FORMULAS, "-3.5", "1e3", "plain", "a, b", 'c "d"', MARKUP])
    text = measurements_csv(replace(rows, session=labels, group=labels))
    cells = [cell for row in csv.reader(io.StringIO(text)) for cell in row]
    for cell in cells:
        try:
            float(cell)
        except ValueError:
            assert not cell.startswith(("=", "+", "-", "@", "\t", "\r")), cell
    assert [float(row[0]) for row in list(csv.reader(io.StringIO(text)))[1:]] == rows.q[:, 0].tolist()
    (tmp_path / "rows.csv").write_text(text)
    again = read_measurements(tmp_path / "rows.csv", joints=6)
    assert again.q.tolist() == rows.q.tolist()
    assert again.session.tolist() == labels.tolist()


def test_from_the_file_to_the_report(run, tmp_path):
    """A session, a file and a target of such names, at the command line."""
    _, rows = measure_poses(load_robot("aria"), 40, seed=1)
    label = FORMULAS[1] + MARKUP + "\u202e\u2066$\\frac{"
    text = measurements_csv(replace(rows, session=np.full(40, label)))
    name = "=1+1\u202e<script>alert.csv"
    Path(name).write_text(text)
    arguments = ("--robot", "aria", "--report", "report", "--json", "r.json")
    for command in (("preview", name), ("identify", name, *arguments), ("diagnose", name, *arguments)):
        status, out, err = run(*command)
        assert status in (0, 2), err
        assert obeyed(out + err) == []
    pages = [p for p in Path("report").iterdir() if p.suffix in (".html", ".svg")]
    assert len(pages) == 2
    for page in pages:
        content = page.read_text()
        assert "<script>alert" not in content
        assert obeyed(content) == []
