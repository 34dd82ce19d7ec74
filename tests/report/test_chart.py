"""A chart is drawn where its numbers say."""

import re

import numpy as np
import pytest

from workbench.report.chart import LEFT, MARGIN, WIDTH, Bar, Bars, Chart, Marks


def test_points_lie_where_their_values_are_and_lead_where_they_say():
    marks = Marks(
        np.array([0.0, 1.0, 4.0]), np.array([2.0, np.nan, 6.0]), "#123", ["<a>", "b", "c"], ["/x", "", ""]
    )
    svg = Chart([marks], 100.0, ("first", "last"), floor=0.0).svg()
    places = [(float(x), float(y)) for x, y in re.findall(r'cx="([\d.]+)" cy="([\d.]+)"', svg)]
    assert places == [
        pytest.approx((LEFT + MARGIN, MARGIN + (100.0 - 2 * MARGIN) * (1.0 - 2.0 / 6.0)), abs=0.06),
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
