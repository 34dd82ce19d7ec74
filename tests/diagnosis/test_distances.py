"""Distances from anchors alone, judged on held-out rows too; poses to measure next."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from arms import TUNING, make
from generator import move, turn

from workbench import diagnose, identify, measure_poses
from workbench.diagnosis.report.results_json import diagnosis_json
from workbench.identification.fit_choices import Sessions

ANCHORS, EACH = 6, 16


def test_held_out_anchors_are_judged_by_identify_and_diagnose(aria):
    """A wire's length from six anchors to an arm that gives way, one group of rows for each anchor.

    Every held-out row was left out, since no fitted row has its anchor.
    """
    errors = (5e-3, np.deg2rad(5.0))
    _, rows = measure_poses(aria, ANCHORS * EACH, effects=("joint-compliance:2:2e-4",), errors=errors, seed=3)
    place = np.random.default_rng(0).uniform(-1.0, 1.0, (ANCHORS, 3)).repeat(EACH, axis=0)
    names = np.array([f"wire {i}" for i in range(ANCHORS)]).repeat(EACH)
    length = np.linalg.norm(rows.position - place, axis=1)
    seen = {"distance": length, "anchor": names, "group": names}
    distances = replace(rows, position=None, rotation=None, sigma=None, **seen)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        plain = identify(aria, distances, algorithms=("opt2",))
        found = diagnosis_json(diagnose(aria, distances))
    assert plain.runs["opt2"].held_out.position_mm.rms < 0.5 * plain.nominal.held_out.position_mm.rms
    assert found["measurements"]["held_out"] == EACH
    assert found["before"]["held_out"]["position_mm"]["mean"] > 0.0
    assert found["suspects"] == []
    assert sum(f"{EACH} held-out rows" in note and "anchors" in note for note in found["notes"]) == 1


ELSEWHERE = move("x", 0.2) @ turn("z", 0.5)


@pytest.mark.slow
def test_sessions_with_frames_of_their_own():
    """Poses asked for belong to one session, and say nothing of the frames of the others."""
    case = make("compliance", TUNING[2], "aria", free_frames=True)
    data = case.data
    late = np.arange(len(data)) >= len(data) // 2
    position, rotation = data.position.copy(), data.rotation.copy()
    position[late] = position[late] @ ELSEWHERE[:3, :3].T + ELSEWHERE[:3, 3]
    rotation[late] = ELSEWHERE[:3, :3] @ rotation[late]
    session = np.where(late, "noon", "morning")
    moved = replace(data, position=position, rotation=rotation, session=session)
    found = diagnose(case.robot, moved, frames=Sessions.PER_SESSION)
    assert [(e.effect.name, e.effect.joints) for e in found.effects] == [
        ("joint-compliance", case.truth[0].joints)
    ]
    assert any("noon" in name for name in found.after_fit.problem.names)
    assert found.measure_next.shape == (5, 6)
    assert (found.measure_next >= data.q.min(0)).all()
    assert (found.measure_next <= data.q.max(0)).all()
