"""The command that does the paper again."""

import json


def test_reproduce_aria(run, tmp_path):
    status, out, _ = run("reproduce", "aria", "--arms", "1", "--json", "aria.json")
    assert status == 0
    assert "Eq. (3)" in out
    assert json.loads((tmp_path / "aria.json").read_text())["work"] == "aria"


def test_bad_input(run, tmp_path):
    (tmp_path / "file").touch()
    for words, said in ((("--arms", "0"), "at least 1"), (("--out", "file"), "file")):
        status, out, err = run("reproduce", "aria", *words)
        assert status == 1
        assert said in err
        assert not out
