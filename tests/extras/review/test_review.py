"""Recordings in the viewer, replayed, and compared."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest
from refusals import mentions

from workbench.arm.built_in_arms import load_robot
from workbench.base.progress import running
from workbench.diagnosis.diagnose import diagnose
from workbench.extras.review.compare_sessions import compare as compare_recordings
from workbench.extras.review.compare_sessions import compare_sessions
from workbench.extras.review.session_report import write_page
from workbench.extras.review.viewer import pictures_of, write_comparison
from workbench.plate.simulated_measurement import measure_poses
from workbench.session.journal.reader import JOURNAL, read_recording


@pytest.fixture
def copy(sample, tmp_path):
    return shutil.copytree(sample.folder, tmp_path / "copy")


@pytest.mark.parametrize("cut", [500, 20_000, 400_000, 10**9])
def test_pictures_without_an_end_are_shown_as_far_as_they_go(copy, reader, cut):
    path = copy / "session.rrd"
    content = path.read_bytes()
    path.write_bytes(content[: max(0, len(content) - cut)])
    message = []
    (copy.parent / "room").mkdir()
    files = pictures_of(read_recording(copy), copy.parent / "room", say=message.append)
    assert message
    assert path.read_bytes() == content[: max(0, len(content) - cut)]
    shown = reader(files[-1])
    assert shown.values("/log", "TextLog:text")[-1][0] >= len(read_recording(copy).lines) - 5


def test_replay_and_its_report(run, copy):
    status, out, _ = run("replay", copy, "--report", "r.html", "--json", "r.json")
    assert status == 0
    assert "all the same" in out
    assert json.loads((copy.parent / "r.json").read_text())["schema"] == "workbench.replay/1"
    page = (copy.parent / "r.html").read_text()
    assert "before-after" in page
    assert "joint2.alpha" in page
    assert "http://" not in page.replace("http://www.w3.org", "")
    assert "<script" not in page


def test_replay_names_a_difference(run, copy):
    path = copy / JOURNAL
    path.write_text(path.read_text().replace('"rank": 24', '"rank": 23', 1))
    status, out, _ = run("replay", copy)
    assert status == 2
    assert "score.rank" in out


def test_two_sessions_side_by_side(run, copy, reader):
    lines = (copy / JOURNAL).read_text().splitlines(keepends=True)
    (copy / JOURNAL).write_text("".join(lines[:6]))
    status, out, _ = run("review", copy, "--with", copy, "--out", "ab.rrd", "--json", "ab.json")
    assert status == 0
    assert "predicted error [mm]" in out
    pictures = reader(copy.parent / "ab.rrd")
    for side in ("A", "B"):
        assert f"/{side}/world/arm/nominal/body3" in pictures.paths
    assert "/differences" in pictures.static
    values = json.loads((copy.parent / "ab.json").read_text())["figures"]["index O1"]
    assert values[0] == values[1] > 0.0


def test_what_has_moved_is_named(replayed):
    """One joint's offset is moved by hand in the result; nothing else is called moved."""
    session = replayed.session
    run = session.results.identification.runs["opt2"]
    name = compare_sessions(["then", "now"], [session, session]).moves[3].name
    k = [p.name for p in run.fit.parameters].index(name)
    x = run.fit.x.copy()
    x[k] += 10.0 * run.fit.std[k]
    found = replace(
        session.results.identification,
        runs={**session.results.identification.runs, "opt2": replace(run, fit=replace(run.fit, x=x))},
    )
    compared = compare_sessions(
        ["then", "now"], [session, replace(session, results=replace(session.results, identification=found))]
    )
    assert [move.name for move in compared.moved] == [name]
    expected = 10.0 * run.fit.std[k] / np.hypot(*compared.moved[0].stds)
    assert compared.moved[0].ratios[1] == pytest.approx(expected, rel=1e-6)
    assert "1 of" in compared.sentence


def test_parameters_of_different_arms_are_not_compared(replayed):
    """joint4.alpha of a Panda had "moved 30372 σ" against ARIA's."""
    session = replayed.session
    panda = replace(session, robot=load_robot("panda"))
    compared = compare_sessions(["then", "now"], [session, panda])
    assert compared.moves == ()
    assert len(compared.figures) > 5
    assert "now" in compared.sentence
    assert mentions(compared.sentence, "7")
    assert compared.json()["other_arms"]
    assert compare_sessions(["then", "now"], [session, session]).others == ()
    robot = session.results.calibrated  # opened again as it was calibrated
    assert compare_sessions(["then", "now"], [session, replace(session, robot=robot)]).others == ()


def test_a_comparison_says_how_far_it_is(copy, tmp_path):
    lines = (copy / JOURNAL).read_text().splitlines(keepends=True)
    (copy / JOURNAL).write_text("".join(lines[:6]))
    recording, messages = read_recording(copy), []
    with running(lambda part, text: messages.append(part)):
        compared = compare_recordings([recording] * 2)
        write_comparison(recording, recording, tmp_path / "ab.rrd", compared=compared)
    assert len(messages) > 4
    assert 0.5 < max(messages) <= 1.0


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


def test_the_report_tells_a_diagnosis(sample, replayed, tmp_path):
    _, rows = measure_poses(sample.robot, 25, effects=["joint-compliance:2"], seed=1)
    diagnosed = diagnose(sample.robot, rows)
    last = replace(
        replayed,
        session=replace(replayed.session, results=replace(replayed.session.results, diagnosis=diagnosed)),
    )
    page = write_page(sample, last, tmp_path / "page.html").read_text()
    assert f"What the model lacks: {diagnosed.verdict}" in page
    assert mentions(page, "joint-compliance, joint 2")
    assert "ranking" in page
    assert mentions(page, "target 1", "506.0, 384.0, 285.0 mm")
    assert "Grab target" not in page
