"""A chart is drawn where its numbers say; results say what they show, themselves or by their report."""

import re
import subprocess
import sys

import numpy as np
import pytest

from workbench.report.chart import LEFT, MARGIN, WIDTH, Bar, Bars, Chart, Marks


def test_points_lie_where_their_values_are_and_lead_where_they_say():
    marks = Marks(
        np.array([0.0, 1.0, 4.0]), np.array([2.0, np.nan, 6.0]), "#123", ["<a>", "b", "c"], ["/x", "", ""]
    )
    svg = Chart([marks], 100.0, floor=0.0).svg()
    places = [(float(x), float(y)) for x, y in re.findall(r'cx="([\d.]+)" cy="([\d.]+)"', svg)]
    assert places == [
        pytest.approx((LEFT + MARGIN, MARGIN + (100.0 - MARGIN) * (1.0 - 2.0 / 6.0)), abs=0.06),
        pytest.approx((WIDTH - MARGIN, MARGIN), abs=0.06),
    ]
    assert svg.count('<a href="/x">') == svg.count("<a ") == 1
    assert "&lt;a&gt;" in svg
    assert Chart([Marks(np.zeros(2), np.full(2, np.nan), "#123")]).svg() == ""


def test_bars_are_as_long_as_their_numbers():
    svg = Bars([Bar("play", 0.4, "red", "certain"), Bar("left <1>", 0.1, "grey")]).svg()
    lengths = [float(w) for w in re.findall(r'width="([\d.]+)" height="14"', svg)]
    assert lengths[0] == pytest.approx(4.0 * lengths[1], rel=1e-2)
    assert "left &lt;1&gt;" in svg
    assert Bars([]).svg() == ""


REGISTERED = """
import os
import scipy.optimize
import workbench.identification.alignment
import workbench as wb
from workbench.report.result_display import AbstractReported, blocks_of

def below(kind):
    return {kind}.union(*map(below, kind.__subclasses__()))

for verb in ("identify", "evaluate", "diagnose", "score", "optimise_plate"):
    if child := os.fork():
        assert os.waitpid(child, 0)[1] == 0, verb
        continue
    getattr(wb, verb)
    kinds = [k for k in below(AbstractReported) if not k.__name__.startswith("Abstract")]
    assert kinds
    assert not [k for k in kinds if blocks_of.dispatch(k) is blocks_of.dispatch(object)], kinds
    break
"""


def test_a_verb_brings_the_report_of_its_results():
    done = subprocess.run([sys.executable, "-c", REGISTERED], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
