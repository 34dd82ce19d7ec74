import numpy as np
import pytest
from rich.console import Console

from workbench.identification.errors.row_errors import Errors, Spread
from workbench.identification.report.how_to_apply import controller_use
from workbench.identification.report.parameters import ConstantStatus, parameter_table
from workbench.identification.report.table import (
    error_cells,
    error_columns,
    evaluation_tables,
    identification_tables,
    parameters_tables,
)
from workbench.report.numbers import compared, factor, short, signed, standard_error


def printed(content, width=80):
    console = Console(width=width, no_color=True, legacy_windows=False)
    with console.capture() as capture:
        console.print(content)
    return capture.get()


@pytest.mark.parametrize("name", ["result", "points"])
def test_fits_eighty_columns_and_loses_no_number(name, request):
    found = request.getfixturevalue(name)
    text = printed(identification_tables(found))
    assert max(map(len, text.splitlines())) <= 80
    assert "…" not in text.split("note:")[0]
    for run in found.runs.values():
        assert short(run.train.position_mm.mean) in text
    fit = found.best.fit
    table = parameter_table(fit)
    for _, cells in table.rows:
        for cell in cells:
            if cell is not None and cell.state is ConstantStatus.IDENTIFIED:
                factor = np.rad2deg(1.0) if cell.unit == "rad" else 1e3
                change = float(cell.shown[1].replace("−", "-"))
                rounded = 10.0 ** -len(cell.shown[1].partition(".")[2])
                assert change == pytest.approx(factor * (cell.value - cell.nominal), abs=0.51 * rounded)
                assert rounded <= 0.1 * factor * cell.std or rounded == pytest.approx(1e-6)
                assert cell.shown[1] in text
    flat = " ".join(text.split())
    for message in (*found.unidentifiable, *found.warnings, *found.notes):
        assert " ".join(message.split()) in flat


@pytest.mark.parametrize("size", [0.0004, 0.37, 11.06, 123.4])
def test_errors_in_mm_degrees_and_pixels_fit_eighty_columns(size):
    spread = Spread(size, 1.1 * size, 3.0 * size, size)
    errors = Errors(spread, spread, own=spread, own_name="pixel[px]")
    kinds, table = error_columns([errors])
    table.add_row("calibrated", "held out", *error_cells(errors, kinds))
    text = printed(table)
    assert max(map(len, text.splitlines())) <= 80
    assert "…" not in text


def test_units_and_hostile_names_are_shown_as_they_are(result):
    text = printed(identification_tables(result))
    assert "[mm]" in text
    assert "θ [°]" in text
    assert result.robot.name.split()[0] in text
    assert "<b>probe</b>" in text


def test_the_joint_table_is_the_papers(result):
    table = parameter_table(result.best.fit)
    assert table.headings == ("θ [°]", "d [mm]", "a [mm]", "α [°]", "β [°]")
    assert [joint for joint, _ in table.rows] == [f"joint{k}" for k in range(1, 7)]
    held = [[c.state is ConstantStatus.HELD for c in cells] for _, cells in table.rows]
    # Table 4: β is held everywhere but on link 2, where d is
    assert [row.index(True) for row in held] == [4, 1, 4, 4, 4, 4]
    assert all(sum(row) == 1 for row in held)
    cell = table.rows[1][1][2]
    assert (cell.name, cell.nominal) == ("joint2.a", 0.41)
    place = result.best.fit.problem.names.index("joint2.a")
    assert (cell.value, cell.std) == (result.best.fit.x[place], result.best.fit.std[place])


def test_what_no_row_tells_apart_is_marked(points):
    table = parameter_table(points.best.fit)
    cells = {c.name: c for _, row in table.rows for c in row if c} | {c.name: c for c in table.others}
    for combination in points.best.fit.unidentifiable:
        wanted = ConstantStatus.SHARED if len(combination.names) > 1 else ConstantStatus.UNSEEN
        assert {cells[n].state for n in combination.names} <= {wanted, ConstantStatus.UNSEEN}
    assert ConstantStatus.SHARED in table.marks
    assert "†" in printed(parameters_tables(points.best.fit))


def test_evaluation_and_controller_tables(evaluated, result):
    text = printed(evaluation_tables(evaluated))
    assert short(evaluated.errors.position_mm.max) in text
    text = printed(controller_use(result).summary())
    assert "joint offsets only" in text
    assert max(map(len, text.splitlines())) <= 80


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.1234, "0.123"), (-1.5, "−1.500"), (0.0, "0.000"), (2e-7, "2e-07"), (np.nan, "–"), (np.inf, "–")],
)
def test_short(value, text):
    assert short(value) == text


def test_other_numbers():
    assert signed(-0.0001, 3) == "0.000"
    assert standard_error(1.2e-4) == "±0.000120"
    assert standard_error(3e-9) == "±3e-09"
    assert factor(1.0, 0.1) == "10 times smaller"
    assert factor(1.0, 0.5) == "2.0 times smaller"
    assert factor(1.0, 1.0) == "unchanged"
    assert factor(1.0, 2.0) == "2 times larger"
    assert factor(1.0, 0.0) == "no error left"


def test_numbers_beside_others_keep_their_zeros():
    numbers = [compared(value) for value in (0.43, 0.0929, 12.0, 123.4, np.nan)]
    assert numbers == ["0.430", "0.0929", "12.0", "123", "–"]
