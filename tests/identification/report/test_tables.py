import numpy as np
import pytest
from rich.console import Console

from workbench.identification.report.parameters import ConstantStatus, parameter_table
from workbench.identification.report.table import identification_tables, parameters_tables
from workbench.report.numbers import short


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
