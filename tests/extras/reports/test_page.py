import errno
import json
import re

import pytest
from html_page import Page
from refusals import mentions, refuses

from workbench.base import files
from workbench.base.errors import FileError
from workbench.base.files import write_folder
from workbench.data.accuracy_requirement import Requirement, Wanted, default_requirement
from workbench.extras.reports import identification_page as html_report
from workbench.extras.reports.identification_figures import NAMES
from workbench.extras.reports.identification_page import write_report
from workbench.identification.errors.pass_or_fail import judge


@pytest.fixture(scope="module")
def page(report):
    parsed = Page()
    parsed.feed(report.read_text(encoding="utf-8"))
    return report, parsed


def test_the_folder_has_everything(page, result):
    path, _ = page
    assert {p.name for p in path.parent.iterdir()} == {
        "report.html",
        "result.json",
        *(f"{name}.svg" for name in NAMES),
    }
    found = json.loads((path.parent / "result.json").read_text())
    assert found["schema"] == "workbench.identification/1"
    judged = found["requirement"]
    assert sorted(judged["passed"] + judged["failed"]) == sorted(result.held_out_data.row.tolist())
    assert [c["takes"] for c in found["controller"]] == [
        ["offsets"],
        ["offsets", "tool"],
        ["offsets", "tool", "base"],
    ]


def test_it_needs_nothing_from_elsewhere(page):
    path, parsed = page
    assert not {"script", "link", "img", "iframe", "object"} & set(parsed.tags)
    addresses = [v for k, v in parsed.attributes if k in ("href", "src", "xlink:href", "action", "data")]
    assert all(v.startswith("#") for v in addresses)
    text = path.read_text()
    assert set(re.findall(r"https?://[\w.]+", text)) <= {"http://www.w3.org"}  # names of XML, not addresses
    assert all(v.startswith("#") for v in re.findall(r"url\(([^)]*)\)", text))
    assert "@import" not in text


def test_tags_close_and_hostile_words_are_only_words(page, result):
    path, parsed = page
    assert parsed.stack == []
    assert "script" not in parsed.tags
    assert "b" in parsed.tags  # of our own
    text = path.read_text()
    assert "<b>probe" not in text
    assert "a<i>b.csv" not in text
    message = "".join(parsed.text)
    assert "<script>" in result.robot.name
    assert result.robot.name in message
    assert "<b>probe</b>" in message


def test_it_says_what_matters(page, result):
    message = " ".join("".join(page[1].text).split())
    for sentence in (*result.notes, *result.warnings, *result.unidentifiable):
        assert " ".join(sentence.split()) in message
    for value in result.best.held_out.position_mm[:3]:
        assert f"{value:.3f}" in message
    assert mentions(message, "1 mm", "0.66°")
    assert "joint offsets only" in message


def test_points_without_held_out_rows(points, replaced):
    text = replaced.path.read_text()
    assert "none were held out" in text
    assert "✗" in text
    for message in points.unidentifiable:
        assert message in text


def test_an_arm_is_judged_by_what_its_user_wants_and_else_not_at_all(result, points, tmp_path, monkeypatch):
    """The report used eq. (3) of ARIA for every arm, whatever was wanted of it."""
    monkeypatch.setattr(html_report, "all_figures", lambda *args, **options: ())
    assert "--wanted" in write_report(points, tmp_path).read_text()
    norms = judge(result, Wanted(position=1e-2))
    assert norms.verdict == f"✓ Meets 10 mm on all {len(result.held_out_data)} held-out rows"
    strict = judge(result, Wanted(position=1e-2, rotation=1e-7))
    assert strict.failed == result.held_out_data.row.tolist()
    assert strict.check.limits.tolist() == [1e-2, 1e-7]
    assert judge(points, Wanted(position=1e-2, rotation=1e-7)).check.text == "10 mm"
    assert default_requirement("ARIA") == Requirement().wanted
    assert default_requirement("UR5") is None


def test_an_older_report_is_replaced_and_other_files_stay(replaced):
    folder = replaced.path.parent
    assert not (folder / "errors-orientation.svg").exists()
    assert replaced.path.read_text() != "old"
    assert (folder / "mine.txt").read_text() == "old"
    assert replaced.parts == sorted(replaced.parts)
    assert replaced.parts[-1] == 1.0


def test_a_file_in_the_way(points, tmp_path):
    (tmp_path / "taken").write_text("")
    with pytest.raises(FileError):
        write_report(points, tmp_path / "taken")


@pytest.mark.parametrize("moves", range(6))
def test_all_or_nothing(tmp_path, monkeypatch, moves):
    home = tmp_path / "home"
    write_folder(home, {"a": b"1", "b": b"2", "old": b"3"})
    (home / "mine").write_bytes(b"m")
    before = {p.name: p.read_bytes() for p in home.iterdir()}
    real, count = files.os.replace, [0]

    def failing(source, target):
        if count[0] == moves:
            count[0] += 1
            raise OSError(errno.ENOSPC, "full")
        count[0] += 1
        real(source, target)

    monkeypatch.setattr(files.os, "replace", failing)
    with refuses(FileError, "full", path=str(home)):
        write_folder(home, {"a": b"x", "b": b"y", "c": b"z"}, replaces=("old",))
    assert {p.name: p.read_bytes() for p in home.iterdir()} == before
    assert [p.name for p in tmp_path.iterdir()] == ["home"]


def test_nothing_is_left_when_a_folder_cannot_be_made(tmp_path, monkeypatch):
    def failing(source, target):
        raise OSError(errno.ENOSPC, "full")

    monkeypatch.setattr(files.os, "replace", failing)
    with refuses(FileError, "full", path=str(tmp_path / "new")):
        write_folder(tmp_path / "new", {"a": b"1"})
    assert list(tmp_path.iterdir()) == []
