"""The commands that choose poses, and clusters of them."""

import json

import numpy as np
import pytest
from refusals import mentions

from workbench.data.readers import read_trajectory


def test_poses_with_limits(run, tmp_path):
    options = ("--region", "table2", "--towards", "-150,0,0", "--cone", "80deg", "--spread", "40mm")
    more = ("--unknown", "base", "--out", "q.csv", "--json", "q.json")
    status, out, _ = run("poses", "--robot", "aria", "--number", "8", *options, *more)
    assert status == 0
    assert "travel between poses" in out
    found = json.loads((tmp_path / "q.json").read_text())
    assert found["travel"]["max"] == pytest.approx(np.abs(np.diff(found["poses"], axis=0)).max())
    assert found["index"]["after"] >= found["index"]["before"]
    assert np.allclose(read_trajectory(tmp_path / "q.csv", joints=6).q, found["poses"])
    assert run("poses", "--robot", "aria", "--number", "5", "--from", "q.csv", "--out", "5.csv")[0] == 0
    fewer = read_trajectory(tmp_path / "5.csv", joints=6).q
    assert {tuple(row) for row in fewer} < {tuple(row) for row in found["poses"]}


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--spread", "500mm", "--region", "table2"), "conflict"),
        (("--towards", "1,2"), "roll,pitch,yaw"),
        (("--index", "I"), "give a region"),
        (("--index", "O7"), "O1"),
        (("--number", "0"), "0"),
        (("--out", "/proc/nowhere/q.csv"), "/proc/nowhere/q.csv"),
        (("--region", "5,5,5:6,6,6"), "keep each limit alone: the region"),
    ],
)
def test_bad_input(refused, options, message):
    status = 1 if message == "conflict" or message.startswith(("keep", "/")) else 64
    refused([message], "poses", "--robot", "aria", "--number", "8", *options, status=status)


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
