"""Poses to measure next."""

from dataclasses import replace

import numpy as np
import pytest
from arms import TUNING, make
from generator import move, turn

from workbench.diagnosis.diagnose import diagnose
from workbench.identification.frames import Sessions

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
