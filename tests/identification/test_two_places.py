"""Rows that lie off the others by one vector are named, and nothing else is taken for such."""

import numpy as np
import pytest
from checks import with_errors

import workbench as wb
from workbench.data.dataset import Dataset
from workbench.identification.rows.two_places import two_places


def measured(shift, away, *, noise=5e-5):
    rng, nominal = np.random.default_rng(3), wb.load_robot("ur5e").bare
    arm = with_errors(nominal, 5e-4 * rng.normal(size=len(nominal.default_free)))
    q = rng.uniform(-2.0, 2.0, (90, 6))
    points = arm.predict(q)[:, :3, 3] + rng.normal(0.0, noise, (90, 3))
    return Dataset(q=q, position=points + away[:, None] * np.asarray(shift))


@pytest.mark.parametrize(
    ("shift", "away", "text"),
    [
        ((0.0, 3e-3, 0.0), np.arange(90) % 3 == 0, "every 3rd, from row 0"),
        ((1e-3, 0.0, -1e-3), np.arange(90) >= 60, "rows 60"),
        ((2e-3, 0.0, 0.0), np.random.default_rng(1).random(90) < 0.2, "rows "),
    ],
)
def test_rows_that_lie_off_together_are_named(shift, away, text):
    found = wb.identify("ur5e", measured(shift, away), held_out=0.0)
    (said,) = [w for w in found.warnings if "together" in w]
    assert said.startswith(f"{away.sum()} of 90 fitted rows (")
    assert text in said
    stated = [float(v) for v in said.split("together, by ")[1].split(" mm in")[0].split(", ")]
    assert stated == pytest.approx([1e3 * v for v in shift], abs=0.1)


@pytest.mark.parametrize("noise", [5e-5, 2e-3])
def test_noise_makes_no_two_groups(noise):
    found = wb.identify("ur5e", measured((0, 0, 0), np.zeros(90, bool), noise=noise), held_out=0.0)
    assert two_places(found.best.fit) == ""
