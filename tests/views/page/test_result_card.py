"""The result card: a histogram of the rows stage by stage, parameters with the digits of their errors."""

import numpy as np
import pytest

from workbench.views.page.panels.fit import shown_parameter


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
