"""The works done again once for all tests that look at what came out."""

import json

import pytest

from studies.finding import GOOD

KATANA = {"arms": 8, "weighed": 12, "seed": 0}
"""Of eight arms: nine in ten of only three is an interval that any change of a pose moves by a tenth."""


@pytest.fixture(scope="session")
def katana():
    from studies.katana import reproduce_katana

    return reproduce_katana(**KATANA)


def finding(found, where, text):
    return next(f for f in found.findings if f.where == where and text in f.what)


def agree(found, *which):
    """These printed numbers and statements do; whatever doesn't has a reason."""
    assert not [(where, text) for where, text in which if finding(found, where, text).verdict not in GOOD]
    assert all(f.reason for f in found.findings if f.verdict not in GOOD)


@pytest.fixture
def check_command(run, monkeypatch, tmp_path):
    """The command's table and files hold what was found."""

    def check(work, found, shown):
        monkeypatch.setattr(f"studies.{work}.reproduce_{work}", lambda **_: found)
        status, out, _ = run("reproduce", work, "--out", work, "--json", f"{work}.json")
        assert status == 0
        assert shown in out
        folder = tmp_path / work
        assert shown in (folder / "tables.md").read_text(encoding="utf-8")
        content = json.loads((folder / "result.json").read_text())
        assert (content["schema"], content["work"]) == ("workbench.reproduction/1", work)
        assert sum(content["verdicts"].values()) == len(content["findings"]) == len(found.findings)
        assert content == json.loads((tmp_path / f"{work}.json").read_text())

    return check
