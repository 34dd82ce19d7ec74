"""The result card: a histogram of the rows stage by stage, parameters with the digits of their errors."""

import re

import numpy as np
import pytest
from refusals import mentions

from workbench.report.chart import WIDTH
from workbench.session.next_step import StageErrors
from workbench.views.page.panels.fit import shown_parameter
from workbench.views.page.panels.result_card import HEIGHT, histogram


def stage(title: str, mean: float) -> StageErrors:
    rows = 1e-3 * mean * np.random.default_rng(0).lognormal(0.0, 0.4, 40)
    return StageErrors(title, mean, rows)


def test_every_stage_is_an_outline_inside_the_drawing():
    stages = (stage("nominal", 0.739), stage("geometry", 0.375), stage("causes", 0.072))
    drawn = histogram(stages, 0.05)
    outlines = re.findall(r'points="([^"]*)"', drawn)
    assert len(outlines) == 3
    for outline in outlines:
        points = np.array([[float(v) for v in point.split(",")] for point in outline.split()])
        assert points.min() >= 0.0
        assert (points.max(axis=0) <= [WIDTH + 0.1, HEIGHT]).all()
    assert mentions(drawn, "0.050 mm")
    assert histogram((StageErrors("nominal", float("nan"), np.full(3, np.nan)),), 0.1) == ""
    assert "nan" not in histogram((stages[0], StageErrors("geometry", 0.0, np.zeros(40))), float("nan"))


@pytest.mark.parametrize(
    ("numbers", "expected"),
    [
        (("kg", 0.0, 4.894456737, 0.21), ("kg", "4.89", "+4.89", "±0.21")),
        (("rad", np.pi / 2, np.pi / 2 + 1e-3, 2e-5), ("°", "90.0573", "+0.0573", "±0.0011")),
        (("m", 0.4, 0.3995, 3e-5), ("mm", "399.500", "−0.500", "±0.030")),
        (("rad/(N m)", 0.0, 2.5e-6, 1e-7), ("10⁻⁶ rad/(N m)", "2.50", "+2.50", "±0.10")),
        (("1", 0.0, 0.0, 0.0), ("", "0.000", "0.000", "±0.000")),
    ],
)
def test_parameters_have_units_for_people_and_the_digits_of_their_error(numbers, expected):
    assert shown_parameter(*numbers) == expected
