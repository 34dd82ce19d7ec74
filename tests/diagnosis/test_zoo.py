"""The benchmark of the diagnosis: its seeds, and arms that can't show what is asked for."""

import sys
from pathlib import Path

import pytest
from arms import make

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "benchmarks"))
import zoo


def test_seeds_are_those_for_tuning_or_for_judging():
    assert list(zoo.options(["--arms", "2"]).seeds) == [0, 1]
    assert list(zoo.options(["--arms", "2", "--seeds", "judging"]).seeds) == [1_000_000, 1_000_001]
    assert list(zoo.options(["--seeds", "5:8"]).seeds) == [5, 6, 7]
    for seeds in ("9999:10001", "500000:500001"):
        with pytest.raises(ValueError, match="neither"):
            zoo.main(["--jobs", "0", "--cases", "none", "--alarms", "ideal", "--seeds", seeds])


def test_where_an_arm_shows_nothing_the_next_one_does(monkeypatch):
    """A SCARA's slide always carries the same weight, which no play of it can tell."""
    monkeypatch.setattr("arms.TRIES", 5)
    with pytest.raises(ValueError, match="apart"):
        make("backlash-moment", 2, "scara")
    assert zoo.drawn(zoo.Task("backlash-moment", "ideal", 2), ("aria", "katana", "scara")).arm == "aria"
    assert zoo.drawn(zoo.Task("backlash-moment", "ideal", 2), ("scara",)) is None
