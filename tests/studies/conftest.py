"""The works done again once for all tests that look at what came out."""

import json

import pytest

from studies.finding import GOOD
from workbench.report.json import json_text

KATANA = {"arms": 8, "weighed": 12, "diagnosed": 1, "seed": 0}
"""Of eight arms: nine in ten of only three is an interval that any change of a pose moves by a tenth."""
ARIA = {"arms": 1, "seed": 0}


@pytest.fixture(scope="session")
def katana():
    from studies.katana import reproduce_katana

    return reproduce_katana(**KATANA)


@pytest.fixture(scope="session")
def reproduced_aria():
    from studies.aria import reproduce_aria

    return reproduce_aria(**ARIA)


def finding(found, where, text):
    return next(f for f in found.findings if f.where == where and text in f.what)


def agree(found, *which):
    """These printed numbers and statements do; whatever doesn't has a reason."""
    assert not [(where, text) for where, text in which if finding(found, where, text).verdict not in GOOD]
    assert all(f.reason for f in found.findings if f.verdict not in GOOD)


@pytest.fixture
def check_page(reproduce, tmp_path):
    """The command's table, page and result hold every picture and finding; names of the pictures."""

    def check(work, options, found, result, shown):
        assert shown in reproduce(work, options, found, "--out", work, "--json", f"{work}.json")
        page = tmp_path / work / "index.html"
        text = page.read_text(encoding="utf-8")
        pictures = {path.name for path in page.parent.glob("*.png")}
        assert all(f'src="{name}"' in text for name in pictures)
        assert all((page.parent / name).read_bytes().startswith(b"\x89PNG") for name in pictures)
        assert text.count('<td class="where">') == len(found.findings)
        content = json.loads((page.parent / "result.json").read_text())
        assert (content["schema"], content["work"]) == ("workbench.reproduction/1", work)
        assert sum(content["verdicts"].values()) == len(content["findings"]) == len(found.findings)
        assert content == json.loads(json_text(result)) == json.loads((tmp_path / f"{work}.json").read_text())
        return pictures

    return check


@pytest.fixture
def reproduce(run, monkeypatch):
    """Run `workbench reproduce` with options whose study has been done: its output is of what was found."""

    def call(work, options, found, *arguments):
        def known(**requested):
            assert requested == options
            return found

        monkeypatch.setattr(f"studies.{work}.reproduce_{work}", known)
        given = (word for name, value in options.items() for word in (f"--{name}", str(value)))
        status, out, _ = run("reproduce", work, *given, *arguments)
        assert status == 0
        return out

    return call
