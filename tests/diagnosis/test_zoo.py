"""The benchmark of the diagnosis, run with the geometric fit alone: it names nothing, and is told so."""

import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
from arms import make

from workbench.identification.identify import identify

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "benchmarks"))
import zoo

ALONE = ["--jobs", "0", "--on", "classic", "--diagnose", f"{__name__}:geometry"]


def geometry(robot, data, held_out):
    """The diagnosis of somebody who believes in geometry."""
    run = identify(robot, data, algorithms=("ols",), held_out=held_out)
    arm = run.runs["ols"].calibrated
    return SimpleNamespace(
        effects=(),
        outliers=(),
        calibrated=arm,
        verdict="no effect found",
        before_fit=SimpleNamespace(calibrated=arm),
    )


def test_geometry_alone_is_judged(capsys):
    arguments = [*ALONE, "--cases", "none,scale,dent,misseated", "--arms", "3", "--alarms", "ideal,masses10"]
    assert zoo.main([*arguments, "--wrong", "--check"]) == 1
    printed = capsys.readouterr().out
    for line in (
        "✗ scale: right ≥ 95%: 0 % (0–56)",
        "✗ dent: right ≥ 95%: 0 % (0–56)",
        "✗ saved model within half of the noise ≥ 95%: 0 % (0–56)",
        "✓ no effect, ideal: accused ≤ 2%: 0 of 6",
        "✓ no effect, masses10: accused ≤ 2%: 0 of 3",
        "✓ false causes per arm ≤ 0.05: 0.000",
        "✗ misplaced rows found, ≤ 1 false: 0 of 3",
    ):
        assert line in printed
    assert printed.count("encoder-scale ") == 3
    judged = zoo.run(zoo.options(arguments))
    assert list(judged)[:3] == [zoo.Task("none", "ideal", seed) for seed in range(3)]
    assert {j.arm for task, j in judged.items() if task.kind == "none"} == {
        "aria",
        "three-parallel",
        "katana",
    }
    assert all(j.good for task, j in judged.items() if task.kind == "none")
    assert not any(j.good for task, j in judged.items() if task.kind == "scale")


def test_seeds_are_those_for_tuning_or_for_judging():
    assert list(zoo.options(["--arms", "2"]).seeds) == [0, 1]
    assert list(zoo.options(["--arms", "2", "--seeds", "judging"]).seeds) == [1_000_000, 1_000_001]
    assert list(zoo.options(["--seeds", "5:8"]).seeds) == [5, 6, 7]
    for seeds in ("9999:10001", "500000:500001"):
        with pytest.raises(ValueError, match="neither"):
            zoo.main([*ALONE, "--cases", "none", "--alarms", "ideal", "--seeds", seeds])


def test_where_an_arm_shows_nothing_the_next_one_does(monkeypatch):
    """A SCARA's slide always carries the same weight, which no play of it can tell."""
    monkeypatch.setattr("arms.TRIES", 5)
    with pytest.raises(ValueError, match="apart"):
        make("backlash-moment", 2, "scara")
    assert zoo.drawn(zoo.Task("backlash-moment", "ideal", 2), ("aria", "katana", "scara")).arm == "aria"
    assert zoo.drawn(zoo.Task("backlash-moment", "ideal", 2), ("scara",)) is None
