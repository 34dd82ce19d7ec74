"""The result card: errors stage by stage, a histogram of the rows, the instrument where it is known."""

import re
from types import SimpleNamespace

import numpy as np
import pytest
from refusals import mentions

from workbench.report.chart import WIDTH
from workbench.session.stages import StageErrors
from workbench.views.page.panels.fit import shown_parameter
from workbench.views.page.panels.result_card import HEIGHT, histogram, numbers, weighed


def stage(title: str, mean: float, seed: int = 0) -> StageErrors:
    rows = 1e-3 * mean * np.random.default_rng(seed).lognormal(0.0, 0.4, 40)
    return StageErrors(title, mean, rows)


STAGES = (stage("nominal", 0.739), stage("geometry", 0.375), stage("causes", 0.072))


@pytest.mark.parametrize("count", [2, 3])
def test_numbers_stand_in_their_order(count):
    chosen = STAGES[:count]
    shown = re.sub("<[^>]*>", " ", numbers(chosen))
    found = [shown.index(word) for s in chosen for word in (f"{s.error:.3f}".rstrip("0"), s.title)]
    assert found == sorted(found)
    assert shown.count("→") == count - 1


def test_every_stage_is_an_outline_inside_the_drawing():
    drawn = histogram(STAGES, 0.05)
    outlines = re.findall(r'points="([^"]*)"', drawn)
    assert len(outlines) == 3
    for outline in outlines:
        points = np.array([[float(v) for v in point.split(",")] for point in outline.split()])
        assert points.min() >= 0.0
        assert points[:, 0].max() <= WIDTH + 0.1
        assert points[:, 1].max() <= HEIGHT
    assert mentions(drawn, "0.050 mm")


def test_without_noise_there_is_no_line_and_without_rows_no_drawing():
    assert "instrument" not in histogram(STAGES, float("nan"))
    assert histogram((StageErrors("nominal", float("nan"), np.full(3, np.nan)),), 0.1) == ""
    exact = histogram((STAGES[0], StageErrors("geometry", 0.0, np.zeros(40))), 0.1)
    assert "nan" not in exact


def test_geometry_of_a_diagnosis_says_why_it_is_another():
    assert "noise of the joint readings" in weighed(SimpleNamespace(joint_noise=object()))
    assert weighed(SimpleNamespace(joint_noise=None)).endswith("near nominal.")


@pytest.mark.parametrize(
    ("numbers", "expected"),
    [
        (("kg", 0.0, 4.894456737, 0.21), ("kg", "4.89", "+4.89", "±0.21")),
        (("px", 780.483730, 780.217252, 0.35), ("px", "780.22", "−0.27", "±0.35")),
        (("rad", np.pi / 2, np.pi / 2 + 1e-3, 2e-5), ("°", "90.0573", "+0.0573", "±0.0011")),
        (("m", 0.4, 0.3995, 3e-5), ("mm", "399.500", "−0.500", "±0.030")),
        (("1", 0.0, -0.110163, 0.004), ("", "−0.1102", "−0.1102", "±0.0040")),
        (("rad/(N m)", 0.0, 2.5e-6, 1e-7), ("10⁻⁶ rad/(N m)", "2.50", "+2.50", "±0.10")),
        (("1", 0.0, 0.0, 0.0), ("", "0.000", "0.000", "±0.000")),
    ],
)
def test_parameters_have_units_for_people_and_the_digits_of_their_error(numbers, expected):
    assert shown_parameter(*numbers) == expected
