"""The benchmark of the diagnosis, run with the geometric fit alone: it names nothing, and is told so."""

import json
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from workbench.identification.identify import identify

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "benchmarks"))
import confusion


def geometry(robot, data, held_out):
    """The diagnosis of somebody who believes in geometry."""
    run = identify(robot, data, algorithms=("ols",), held_out=held_out)
    return SimpleNamespace(
        effects=(), outliers=(), calibrated=run.runs["ols"].calibrated, verdict="no effect found"
    )


def test_geometry_alone_is_judged(tmp_path, capsys):
    arguments = [
        "--cases",
        "none,scale,misseated",
        "--seeds",
        "0:3",
        "--processes",
        "0",
        "--wrong",
        "--check",
    ]
    arguments += ["--diagnose", f"{__name__}:geometry", "--json", str(tmp_path / "judged.json")]
    assert confusion.main(arguments) == 1
    printed = capsys.readouterr().out
    for line in (
        "✗ right over all named ≥ 95%: 0 %",
        "✗ right of each kind ≥ 90%: 0 % (scale)",
        "✓ false alarms ≤ 5%: 0 of 6",
        "✗ misplaced rows found, ≤ 1 false: 0 of 3",
    ):
        assert line in printed
    assert printed.count("encoder-scale ") == 3
    judged = json.loads((tmp_path / "judged.json").read_text())
    assert [j["kind"] for j in judged] == ["none"] * 3 + ["scale"] * 3 + ["misseated"] * 3
    assert [j["arm"] for j in judged[:3]] == ["aria", "three-parallel", "katana"]
    assert all(j["good"] for j in judged[:3])
    assert not any(j["good"] for j in judged[3:6])


def test_bounds_hold_where_all_is_well(capsys):
    arguments = ["--cases", "none", "--seeds", "1:2", "--processes", "0", "--check"]
    assert confusion.main([*arguments, "--diagnose", f"{__name__}:geometry", "--poses", "60"]) == 0
    assert "✓ false alarms" in capsys.readouterr().out


@pytest.mark.parametrize("seeds", ["9999:10001", "500000:500001"])
def test_seeds_of_neither_kind_are_refused(seeds):
    with pytest.raises(ValueError, match="neither for tuning nor for judging"):
        confusion.main(
            ["--cases", "none", "--seeds", seeds, "--processes", "0", "--diagnose", f"{__name__}:geometry"]
        )
