"""Arms that no maker can have built: said of tables and of URDFs alike, in positions and in orientations."""

from contextlib import nullcontext
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from checks import robot_of
from generator import three_parallel
from refusals import mentions

import workbench as wb
from workbench.base import se3
from workbench.data.dataset import Dataset
from workbench.identification.errors.row_errors import Errors, explains_little
from workbench.identification.report.results_json import identification_json


@pytest.mark.parametrize("kind", ["toml", "urdf"])
@pytest.mark.parametrize(("off", "longer"), [(0.0, 0.0), (np.pi / 3, 0.0), (0.0, 0.015)])
def test_another_zero_or_a_length_that_is_off_alone_is_implausible(kind, off, longer, tmp_path):
    """A URDF spreads the angle over the origins of parallel joints, none of which is known alone."""
    rng, nominal = np.random.default_rng(1), three_parallel()
    path = robot_of(nominal, tmp_path, free='"auto"').save(tmp_path / f"arm.{kind}")
    q = rng.uniform(-1.2, 1.2, (60, nominal.dof))
    actual = nominal.perturbed(rng, length=2e-4, angle=1e-3)
    actual.table[2, 2] += longer
    poses = actual.pose(q)
    data = Dataset(
        q=q + off * np.eye(nominal.dof)[1],
        position=poses[:, :3, 3] + rng.normal(0.0, 3e-5, (60, 3)),
        rotation=poses[:, :3, :3] @ se3.rotvec_to_matrix(rng.normal(0.0, 1e-4, (60, 3))),
    )
    found = wb.identify(wb.load_robot(str(path)), data, reading="given")
    assert bool(found.best.implausible) == bool(off or longer)
    for name, write in (("b.toml", found.robot.save), ("c.csv", partial(wb.export, found.robot, "dh-csv"))):
        with pytest.raises(wb.WorkbenchError, match="implausible") if off or longer else nullcontext():
            write(path=tmp_path / name)
        assert write(path=tmp_path / name, force=True)


def test_rows_that_the_nominal_arm_computed_calibrate_nothing(tmp_path):
    arm = robot_of(three_parallel(), tmp_path, free='"auto"')
    q = np.random.default_rng(2).uniform(-1.2, 1.2, (40, three_parallel().dof))
    other = "columns left out: 'lt_p1', 'lt_p2', 'lt_p3'"
    rows = Dataset(q=q, position=np.round(three_parallel().pose(q)[:, :3, 3], 5), notes=["a", other])
    with pytest.raises(wb.WorkbenchError, match=f"they were computed with it; {other}"):
        wb.identify(arm, rows).robot.save(tmp_path / "b.toml")
    (warning,) = wb.evaluate(arm, rows).warnings
    assert mentions(warning, "0.005 mm", "they were computed with it", "lt_p1")
    turned = se3.rotvec_to_matrix([1e-3, 0, 0]) @ three_parallel().pose(q)[:, :3, :3]
    for real in ({"position": rows.position + [[3e-5, 0, 0]] * 40}, {"rotation": turned}):
        assert not wb.evaluate(arm, replace(rows, **real)).warnings
    with pytest.raises(wb.WorkbenchError, match="tell only a base for each"):
        wb.identify(arm, replace(rows, session=np.arange(40).astype(str)))


@pytest.mark.parametrize(
    ("position", "rotation", "little"),
    [(0.3, 0.1, False), (0.3, 8.5, True), (0.3, 0.9, False), (9.0, 0.1, True)],
)
def test_orientations_that_stay_are_little_explained(position, rotation, little):
    def errors(mm, degrees):
        return Errors(np.full(9, 1e-3 * mm), np.deg2rad(np.full(9, degrees)), np.full(9, np.nan))

    assert explains_little(errors(11.0, 10.0), errors(position, rotation), 0.85) == little


@pytest.mark.parametrize(("rows", "is_assessed"), [(8, False), (30, True)])
def test_few_rows_have_no_standard_errors(rows, is_assessed, tmp_path):
    """Six fitted poses are as many numbers as a URDF has constants: errors were up to 28 times as large."""
    rng, nominal = np.random.default_rng(101), three_parallel()
    path = robot_of(nominal, tmp_path, free='"auto"').save(tmp_path / "arm.urdf")
    q = rng.uniform(-2.0, 2.0, (rows, nominal.dof))
    poses = nominal.perturbed(rng, length=1e-3, angle=2e-3).pose(q)
    position = poses[:, :3, 3] + rng.normal(0.0, 2e-5, (rows, 3))
    data = Dataset(q=q, row=np.arange(rows), source="a.csv", position=position, rotation=poses[:, :3, :3])
    found = wb.identify(wb.load_robot(str(path)), data, algorithms=("ols",))
    known = [p["std"] is not None for p in identification_json(found)["algorithms"]["ols"]["parameters"]]
    assert any(known) == is_assessed
    assert any("too few rows" in text for text in found.warnings) != is_assessed
    assert is_assessed or not any("near the measured" in text for text in found.warnings)
