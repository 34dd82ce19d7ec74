"""Diagnoses that can't be made are refused in words; poses of equal index are searched."""

import numpy as np

from workbench.design.indices.o import of_poses
from workbench.model.forward import sensitivity
from workbench.session.commands import (
    AddEffects,
    ClusterTargets,
    Diagnose,
    MeasureVirtualArm,
    TakeNextPoses,
)
from workbench.session.state import Severity


def test_what_can_not_be_diagnosed_is_said(do):
    for commands in ((Diagnose(),), (MeasureVirtualArm(5), Diagnose()), (AddEffects(),), (TakeNextPoses(),)):
        session = do(*commands)
        assert session.diagnosis is None
        assert session.messages[-1].severity is Severity.ERROR


def test_clustering_gives_equal_indices_in_different_cubes(do):
    session = do(ClusterTargets(6))
    q = np.stack([s.q for s in session.states])
    assert len(q) == 6
    index = of_poses(sensitivity(session.robot, q, session.robot.default_free)[1])
    assert np.ptp(index) < 1e-3
    cells = session.plate.region.cells(session.plate.poses[:, :3, 3])
    assert len(set(cells.tolist())) == 6
    assert do(ClusterTargets(1)).messages[-1].severity is Severity.ERROR
