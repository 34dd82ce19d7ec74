"""The loop is closed: a surprise is found, added, the numbers fall; poses of equal index are searched."""

import numpy as np

from workbench.design.indices.o import of_poses
from workbench.model.forward import sensitivity
from workbench.session.commands import (
    AddEffects,
    ClusterTargets,
    Diagnose,
    Identify,
    MeasureVirtualArm,
    TakeNextPoses,
)
from workbench.session.state import Severity


def test_a_surprise_is_found_added_and_the_error_falls(do, worker):
    refused = do(MeasureVirtualArm(5), Diagnose())
    assert refused.diagnosis is None
    assert refused.messages[-1].severity is Severity.ERROR
    session = do(MeasureVirtualArm(5, surprise=True, more=70), Identify(("opt2",)))
    before = session.identification.runs["opt2"].held_out.position_mm.mean
    hidden = session.loaded.actual.effects[0]
    session = do(Diagnose())
    found = session.diagnosis.effects
    assert [e.effect.name for e in found] == [hidden.name]
    assert found[0].effect.joints == hidden.joints
    session = do(AddEffects())
    after = session.identification.runs["opt2"]
    assert after.held_out.position_mm.mean < 0.7 * before
    assert [e.name for e in after.fit.calibrated.effects] == [hidden.name]
    number = len(session.plate)
    session = do(TakeNextPoses())
    assert len(session.plate) == number + len(session.diagnosis.measure_next)
    assert all(s.reached for s in session.states[number:])
    assert do(MeasureVirtualArm(6)).accepted == ()


def test_clustering_gives_equal_indices_in_different_cubes(do):
    session = do(ClusterTargets(6))
    q = np.stack([s.q for s in session.states])
    assert len(q) == 6
    index = of_poses(sensitivity(session.robot, q, session.robot.default_free)[1])
    assert np.ptp(index) < 1e-3
    cells = session.plate.region.cells(session.plate.poses[:, :3, 3])
    assert len(set(cells.tolist())) == 6
    assert do(ClusterTargets(1)).messages[-1].severity is Severity.ERROR
