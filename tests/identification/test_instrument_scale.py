"""An instrument whose lengths are wrong is named, and no arm's own errors are taken for it."""

import numpy as np
import pytest
import round_trip as trip
from generator import three_parallel

import workbench as wb
from workbench.data.dataset import Dataset
from workbench.identification.checks.instrument_scale import instrument_scale


def warned(factor: float, errors: float, *, seed: int, rows: int = 80, span: float = 1.5) -> str:
    """What is said of points of a UR5 by other code, whose parts differ by errors [m, rad]."""
    rng = np.random.default_rng(seed)
    q, wrong = rng.uniform(-span, span, (rows, 6)), rng.normal(0.0, errors, (6, 6))
    here = np.eye(4)
    for k, (before, driven, after) in enumerate(three_parallel().parts(q)):
        here = here @ before @ driven @ after @ trip.placed(wrong[k, :3], wrong[k, 3:])
    points = factor * (here @ [0.03, 0.0, 0.1, 1.0])[:, :3] + rng.normal(0.0, 3e-5, (rows, 3))
    return instrument_scale(wb.load_robot("ur5"), Dataset(q=q, position=points))


@pytest.mark.parametrize(("factor", "what"), [(1.02, "longer"), (0.99, "shorter")])
def test_a_board_printed_too_large_is_named(factor, what):
    said = warned(factor, 4e-4, seed=1)
    percent, _, rest = said.removeprefix("all lengths are ").partition(" % ")
    assert float(percent) == pytest.approx(100.0 * abs(factor - 1.0), abs=0.2)
    assert rest.startswith(what)


@pytest.mark.parametrize("rows", [6, 20, 80])
@pytest.mark.parametrize("span", [0.5, 1.0, 2.5])
def test_errors_of_an_arm_are_no_scale(rows, span):
    """Two long links that err alike look like one, of half a percent."""
    assert not any(warned(1.0, 1e-3, seed=seed, rows=rows, span=span) for seed in range(40))
