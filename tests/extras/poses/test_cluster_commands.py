"""Clusters from the shell and in the app."""

import json

import numpy as np
import pytest
from refusals import mentions

from workbench.arm.kinematics.forward import identification_jacobian
from workbench.arm.motion import Motion
from workbench.extras.poses.clustering.session import ClusterTargets
from workbench.plate.collision import solid_clear
from workbench.plate.observability import inverse_condition
from workbench.session.page_state import Severity


def test_clustering_gives_equal_indices_in_different_cubes(do):
    session = do(ClusterTargets(10))
    q = np.stack([s.q for s in session.states])
    assert len(q) == 10
    index = inverse_condition(
        identification_jacobian(session.robot, Motion(q), session.robot.default_free)[1]
    )
    assert np.ptp(index) < 1e-3
    cells = session.plate.region.cells(session.plate.poses[:, :3, 3])
    assert len(set(cells.tolist())) == 10
    assert solid_clear(session.robot, session.plate, q).all()
    assert [state.obstacle for state in session.states] == [""] * 10
    assert do(ClusterTargets(1)).page.messages[-1].severity is Severity.ERROR


def test_clusters_as_a_plate(run, tmp_path):
    options = ("--robot", "aria", "--side", "100mm", "--index", "O1", "--out", "c.toml", "--json", "c.json")
    status, out, _ = run("plate", "cluster", *options)
    assert status == 0
    assert mentions(out, "joint 1")
    found = json.loads((tmp_path / "c.json").read_text())
    assert (found["best"]["rank"], found["turned"]["rank"]) == (24, 6)
    assert len(set(found["best"]["cubes"])) == 10
    status, _, _ = run("plate", "score", "c.toml", "--robot", "aria", "--json", "s.json")
    assert status == 0
    scored = json.loads((tmp_path / "s.json").read_text())
    assert scored["set"]["stacked_ratio"] == pytest.approx(found["best"]["stacked_ratio"], rel=1e-5)


def test_regions_that_make_no_sense(refused):
    for region, message in (("0,0:1,1,1", "two corners"), ("nowhere", "nowhere"), ("1,1,1:0,0,0", "empty")):
        command = ("plate", "cluster", "--robot", "aria", "--region", region)
        refused([message], *command, status=1 if region == "nowhere" else 64)
