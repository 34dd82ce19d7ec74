"""The command that chooses poses, with limits."""

import json

import numpy as np
import pytest

from workbench.data.readers import read_trajectory


def test_poses_with_limits(run, tmp_path):
    options = ("--region", "table2", "--towards", "-150,0,0", "--cone", "80deg", "--spread", "40mm")
    more = ("--travel", "120deg", "--unknown", "base", "--out", "q.csv", "--json", "q.json")
    status, out, _ = run("poses", "--robot", "aria", "--number", "8", *options, *more)
    assert status == 0
    assert "travel between poses" in out
    found = json.loads((tmp_path / "q.json").read_text())
    assert found["travel"]["max"] <= np.deg2rad(120) + 1e-9
    assert found["index"]["after"] >= found["index"]["before"]
    assert np.allclose(read_trajectory(tmp_path / "q.csv", joints=6).q, found["poses"])
    status, out, _ = run("poses", "--robot", "aria", "--number", "5", "--from", "q.csv", "--json", "5.json")
    assert status == 0
    assert "convex bound" in out
    fewer = json.loads((tmp_path / "5.json").read_text())
    assert fewer["index"]["after"] <= fewer["bound"]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--spread", "500mm", "--region", "table2"), "conflict"),
        (("--towards", "1,2"), "roll,pitch,yaw"),
        (("--method", "magic"), "'exchange' or 'greedy'"),
        (("--index", "I"), "give a region"),
        (("--index", "O7"), "O1"),
        (("--number", "0"), "0"),
        (("--out", "/proc/nowhere/q.csv"), "/proc/nowhere/q.csv"),
        (("--region", "5,5,5:6,6,6"), "rarely reaches"),
    ],
)
def test_bad_input(refused, options, message):
    status = 1 if message in ("conflict", "rarely reaches") or message.startswith("/") else 64
    refused([message], "poses", "--robot", "aria", "--number", "8", *options, status=status)
