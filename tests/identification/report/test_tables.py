import numpy as np
import pytest

from workbench.identification.report import document
from workbench.identification.report.document import SHARED, UNSEEN, identified
from workbench.report.numbers import short
from workbench.report.result_display import as_text


@pytest.mark.parametrize("name", ["result", "points"])
def test_fits_eighty_columns_and_loses_no_number(name, request):
    found = request.getfixturevalue(name)
    text = as_text(document.identification_blocks(found), 80)
    assert max(map(len, text.splitlines())) <= 80
    assert "…" not in text.split("note:")[0]
    for run in found.runs.values():
        assert short(run.train.position_mm.mean) in text
    for one in identified(found.best.fit):
        assert one.name in text
        if not one.mark:
            factor = np.rad2deg(1.0) if one.unit == "rad" else 1e3
            change = float(one.shown[1].replace("−", "-"))
            rounded = 10.0 ** -len(one.shown[1].partition(".")[2])
            assert change == pytest.approx(factor * (one.value - one.nominal), abs=0.51 * rounded)
            assert rounded <= 0.1 * factor * one.std or rounded == pytest.approx(1e-6)
            assert one.shown[1] in text
    flat = " ".join(text.split())
    for message in (*found.unidentifiable, *found.warnings, *found.notes):
        assert " ".join(message.split()) in flat


def test_what_no_row_tells_apart_is_marked(points):
    fit = points.best.fit
    marks = {one.name: one.mark for one in identified(fit)}
    for combination in fit.unidentifiable:
        wanted = SHARED if len(combination.names) > 1 else UNSEEN
        assert {marks[name] for name in combination.names} <= {wanted, UNSEEN}
    assert SHARED in marks.values()
    assert SHARED in repr(fit)


@pytest.mark.parametrize(
    ("numbers", "expected"),
    [
        (("kg", 0.0, 4.894456737, 0.21), ("0.000", "+4.89", "±0.21", "kg")),
        (("rad", np.pi / 2, np.pi / 2 + 1e-3, 2e-5), ("90.000", "+0.0573", "±0.0011", "°")),
        (("m", 0.4, 0.3995, 3e-5), ("400.000", "−0.500", "±0.030", "mm")),
        (("rad/(N*m)", 0.0, 2.5e-6, 1e-7), ("0.000", "+0.00250", "±0.00010", "mrad/(N·m)")),
        (("1", 0.0, 0.0, None), ("0.000", "0.000", "", "%")),
    ],
)
def test_parameters_have_units_for_people_and_the_digits_of_their_error(numbers, expected):
    assert document.Identified("a", *numbers).shown == expected
