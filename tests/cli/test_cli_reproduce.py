"""What the commands that do the works again refuse; what they give is tested beside the studies."""


def test_bad_input(run, tmp_path):
    (tmp_path / "file").touch()
    for words, said in ((("--arms", "0"), "ask for at least"), (("--out", "file"), "file")):
        for work in ("aria", "katana"):
            status, out, err = run("reproduce", work, *words)
            assert status == (64 if words[0] == "--arms" else 1)
            assert said in err
            assert not out


def test_outside_a_checkout_one_sentence_says_what_to_do(run, tmp_path, monkeypatch):
    monkeypatch.setattr("workbench.cli.studies.TESTS", tmp_path / "tests")
    status, out, err = run("reproduce", "aria", "--arms", "1")
    assert (status, out) == (1, "")
    assert "pip install -e ." in err
    assert len(" ".join(err.split()).split(". ")) == 1
    assert "Traceback" not in err
