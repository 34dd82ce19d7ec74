"""What the commands that do the works again refuse; what they give is tested beside the studies."""


def test_bad_input(refused, tmp_path):
    (tmp_path / "file").touch()
    for work in ("aria", "katana"):
        refused(["at least"], "reproduce", work, "--arms", "0", status=64)
        refused(["file"], "reproduce", work, "--out", "file", status=1)


def test_outside_a_checkout_one_sentence_says_what_to_do(refused, tmp_path, monkeypatch):
    monkeypatch.setattr("workbench.extras.reproduce.commands.TESTS", tmp_path / "tests")
    refused(["checkout"], "reproduce", "aria", "--arms", "1", status=1)
