"""The benchmark of the diagnosis, run with the geometric fit alone: it names nothing, and is told so."""

import json
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

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


def test_geometry_alone_is_judged(tmp_path, capsys):
    kept = tmp_path / "judged.jsonl"
    arguments = [*ALONE, "--cases", "none,scale,dent,misseated", "--arms", "3", "--alarms", "ideal,masses10"]
    arguments += ["--wrong", "--check", "--json", str(kept)]
    assert zoo.main(arguments) == 1
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
    (head, _), *records = (json.loads(line) for line in kept.read_text().splitlines())
    assert head == "sources"
    assert [key for key, _ in records[:3]] == ["none, ideal, 0", "none, masses10, 0", "scale, ideal, 0"]
    assert {r["arm"] for key, r in records if key.startswith("none")} == {"aria", "three-parallel", "katana"}
    assert all(r["good"] for key, r in records if key.startswith("none"))
    assert not any(r["good"] for key, r in records if key.startswith("scale"))


def test_seeds_are_those_for_tuning_or_for_judging():
    assert list(zoo.options(["--arms", "2"]).seeds) == [0, 1]
    assert list(zoo.options(["--arms", "2", "--seeds", "judging"]).seeds) == [1_000_000, 1_000_001]
    assert list(zoo.options(["--seeds", "5:8"]).seeds) == [5, 6, 7]
    for seeds in ("9999:10001", "500000:500001"):
        with pytest.raises(ValueError, match="neither"):
            zoo.main([*ALONE, "--cases", "none", "--alarms", "ideal", "--seeds", seeds])
