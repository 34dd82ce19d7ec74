"""Informative poses: within limits, never worse, the same for a seed; the commands that choose them."""

import re

import numpy as np
import pytest
from numpy.random import default_rng as rng
from refusals import mentions

from workbench.arm.linearisation import linearise
from workbench.data.readers import read_trajectory
from workbench.extras.poses.climb import PoseClimb
from workbench.extras.poses.informative_poses import informative_poses
from workbench.plate.observability import INDICES


@pytest.mark.parametrize("index", INDICES)
def test_informative_poses_are_better_and_within_limits(aria, index):
    found = informative_poses(aria, 5, index=index, rng=rng(1))
    low, high = aria.search_limits.T
    assert found.q.shape == (5, 6)
    assert ((found.q >= low) & (found.q <= high)).all()
    assert found.after == pytest.approx(INDICES[index].value(linearise(aria, found.q)))
    assert found.after > 1.05 * found.before
    again = informative_poses(aria, 5, index=index, rng=rng(1))
    assert np.array_equal(again.q, found.q)


def test_gradient_of_an_index_by_the_joint_positions(aria):
    q = rng(6).uniform(-0.9, 0.9, (5, 6))
    for index in INDICES.values():
        search = PoseClimb(aria, index)
        value, slope = search.value_and_gradient(q)
        direction = rng(7).normal(size=q.shape)
        step = 1e-5
        difference = (search.value(q + step * direction) - search.value(q - step * direction)) / (2 * step)
        assert value == pytest.approx(search.value(q))
        assert difference == pytest.approx((slope * direction).sum(), rel=1e-4)


def test_poses_with_limits(run, told, tmp_path):
    options = ("--region", "table2", "--margin", "5deg")
    more = ("--unknown", "base", "--out", "q.csv")
    found, _ = told("poses", "--robot", "aria", "--number", "8", *options, *more)
    assert found["index"]["after"] >= found["index"]["before"]
    assert np.allclose(read_trajectory(tmp_path / "q.csv", joints=6).q, found["poses"])
    assert run("poses", "--robot", "aria", "--number", "5", "--from", "q.csv", "--out", "5.csv")[0] == 0
    fewer = read_trajectory(tmp_path / "5.csv", joints=6).q
    assert {tuple(row) for row in fewer} < {tuple(row) for row in found["poses"]}
    made = ("--poses", "9", "--instrument", "laser-tracker", "--out", "d.csv")  # its sigma_rx … are blank
    assert run("simulate", "--robot", "aria", *made)[0] == 0
    head, _, rows = (tmp_path / "d.csv").read_text().partition("\n")
    (tmp_path / "bare.csv").write_text("\n".join([re.sub(r"(q\d)\[rad\]", r"\1", head), rows]))
    for name in ("d.csv", "bare.csv"):  # whose rows tell units
        assert run("poses", "--robot", "aria", "--number", "5", "--from", name)[0] == 0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--index", "I"), "give a region"),
        (("--index", "O7"), "O1"),
        (("--number", "0"), "0"),
        (("--out", "/proc/nowhere/q.csv"), "/proc/nowhere/q.csv"),
    ],
)
def test_bad_input(refused, options, message):
    status = 1 if message.startswith("/") else 64
    refused([message], "poses", "--robot", "aria", "--number", "8", *options, status=status)


def test_clusters_as_a_plate(told):
    options = ("--robot", "aria", "--side", "100mm", "--index", "O1", "--out", "c.toml")
    found, out = told("plate", "cluster", *options)
    assert mentions(out, "joint 1")
    assert (found["best"]["rank"], found["turned"]["rank"]) == (24, 6)
    assert len(set(found["best"]["cubes"])) == 10
    scored, _ = told("plate", "score", "c.toml", "--robot", "aria")
    assert scored["set"]["stacked_ratio"] == pytest.approx(found["best"]["stacked_ratio"], rel=1e-5)
