"""The session in the repository: it opens, it can be done again, and its pictures show what it was."""

import numpy as np
import pytest

from workbench.views.recording.rerun_output import STEP, TIME


@pytest.fixture(scope="module")
def pictures(sample, reader):
    return reader(sample.folder / "session.rrd")


def test_it_is_small_and_comes_to_the_same_numbers(sample, replayed):
    assert sum(p.stat().st_size for p in sample.folder.rglob("*") if p.is_file()) <= 2 * 2**20
    assert len(sample.lines) == 20
    assert replayed.compared > 300
    assert replayed.differences == (), replayed.text


def test_every_kind_of_thing_is_there(pictures, replayed):
    bodies = {f"/world/arm/{arm}/body{i}" for arm in ("nominal", "calibrated") for i in range(7)}
    targets = {f"/world/plate/targets/{i}" for i in range(1, 11)}
    scene = {"/world/plate/solid", "/world/region/outline", "/world/region/cubes", "/world/measured"}
    errors = {"/world/errors/nominal", "/world/errors/calibrated"}
    text = {"/log", "/title", "/about", "/result", "/bars/O", "/bars/geometry_mm"}
    assert bodies | targets | scene | errors | text <= pictures.paths
    assert pictures.timelines == {STEP, TIME}


def test_the_numbers_are_the_session_s(pictures, sample, replayed):
    session, found = replayed.session, replayed.session.results.identification
    wanted = {"/index/O": session.score.indices["O"]}
    for path, value in (wanted | {"/predicted/position_mm": 1e3 * session.score.position}).items():
        assert pictures.values(path, "Scalars:scalars")[-1][1][0] == pytest.approx(value, rel=1e-12)
    seen = np.ravel([v for _, v in pictures.values("/error/geometry_mm", "Scalars:scalars")])
    assert np.isclose(seen, found.runs["opt2"].held_out.position_mm.mean, rtol=1e-12).any()


def test_at_every_decision_the_prediction_is_the_journal_s(pictures, sample):
    """What the line shows at a step is what the journal wrote at that step or last before."""
    drawn = pictures.values("/predicted/position_mm", "Scalars:scalars")
    written = sample.header["numbers"]["score"]["position_rms"]
    for step, line in enumerate(sample.lines, start=1):
        written = line.numbers.get("score", {}).get("position_rms", written)
        if line.entry.command.key is None:
            shown = [value[0] for at, value in drawn if at <= step][-1]
            assert shown == pytest.approx(1e3 * written, rel=1e-12), step
