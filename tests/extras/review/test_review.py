"""Recordings in the viewer, and replayed."""

import pytest
from recorded import SAMPLE

from tests.session.recordings import rewrite
from workbench.extras.review.viewer import pictures_of
from workbench.session.journal.reader import read_recording


@pytest.mark.parametrize("cut", [400_000, 10**9])
def test_pictures_without_an_end_are_drawn_again(copy, reader, cut):
    path = copy / "session.rrd"
    content = path.read_bytes()
    path.write_bytes(content[: max(0, len(content) - cut)])
    message = []
    (copy.parent / "room").mkdir()
    files = pictures_of(read_recording(copy), copy.parent / "room", say=message.append)
    assert message
    assert path.read_bytes() == content[: max(0, len(content) - cut)]
    log = reader(files[-1]).values("/log", "TextLog:text")
    assert log[-1][0] == reader(SAMPLE / "session.rrd").values("/log", "TextLog:text")[-1][0]


def test_replay_gives_the_same_numbers(told, copy):
    found, out = told("replay", copy)
    assert "all the same" in out
    assert found["schema"] == "workbench.replay/1"


def test_replay_names_a_difference(run, copy):
    rewrite(copy, 0, lambda header: header["numbers"]["score"].update(rank=23))
    status, out, _ = run("replay", copy)
    assert status == 2
    assert "score.rank" in out


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (("review", "nothing"), "has no journal.jsonl"),
        (("replay", "nothing"), "has no journal.jsonl"),
        (("serve", "--step", "3"), "--step needs --session"),
        (("serve", "--rerun", "127.0.0.1:1"), "no rerun viewer listens"),
        (("serve", "--rerun", "what:ever"), "no rerun viewer listens"),
    ],
)
def test_mistakes_are_one_sentence(run, options, sentence):
    status, _, err = run(*options)
    assert status == (64 if options[0] == "serve" else 1)
    assert sentence in err
    assert err.count("\n") == 1
