"""Masses and centres of mass are known as well as the robot's file says, and are found beside the effects."""

import numpy as np
import pytest
from arms import make
from conditions import CONDITIONS, under
from refusals import refuses

from workbench import diagnose, load_robot
from workbench.arm.effects import BearingCompliance, ClearanceTilt, JointCompliance
from workbench.base.errors import FileError
from workbench.identification.problem import Problem

LOADED = (
    JointCompliance((0, 1, 2), (1e-4, 2e-4, 3e-4)),
    BearingCompliance((1, 3), (2e-4, 1e-4)),
    ClearanceTilt((0,), (2e-4,)),
)


def test_columns_of_masses_are_central_differences():
    """Of the deflected arm: moments change with masses and gravity, and with them how far joints give way."""
    case = make("compliance", 3, poses=12)
    names = [n for e in LOADED for n in e.names]
    problem = Problem.build(case.robot.with_effects(*LOADED), case.data, effects=names, inertia=True)
    x, jacobian = problem.start, problem.evaluate(problem.start).jacobian
    mine = [i for i, p in enumerate(problem.parameters) if p.is_inertia]
    assert len(mine) == 4 * case.robot.dof + 2
    for i in mine:
        ends = [np.where(np.arange(len(x)) == i, x + s, x) for s in (1e-5, -1e-5)]
        slope = (problem.residual(ends[0]) - problem.residual(ends[1])) / -2e-5
        assert np.abs(slope - jacobian[:, i]).max() < 1e-5 * max(1.0, np.abs(jacobian[:, i]).max())


@pytest.fixture(scope="module")
def misjudged():
    """All joints of an arm give way, and the file's masses are up to 30 % off."""
    case = under(CONDITIONS["masses30"], "compliance-all", 100)
    return case, diagnose(case.robot, case.data)


def test_wrong_masses_are_no_cause(misjudged):
    """One cause, the drives: what the masses are off by is called neither a harmonic nor a bearing."""
    case, found = misjudged
    assert [c.kind for c in found.causes] == ["joint-compliance"]
    assert {j for t in case.truth for j in t.joints} <= set(found.causes[0].joints)
    assert found.residual_map is None
    assert found.causes[0].confidence == "certain"


def test_what_the_rows_show_of_the_masses_is_found(misjudged):
    """Centres of the wrist's links across its axes, which no stiffness can stand for."""
    case, found = misjudged
    stated, now = (
        np.array([*arm.inertia.values()]).reshape(-1, 4)[3:, 1:3] for arm in (case.robot, found.robot)
    )
    true = case.actual.coms[3:, :2]
    assert np.abs(stated - true).mean() > 0.003
    assert np.abs(now - true).mean() < 0.6 * np.abs(stated - true).mean()


def test_tolerances_are_read_written_and_judged(tmp_path):
    path = tmp_path / "arm.toml"
    text = 'convention = "hayati"\n[[joint]]\nmass = 2.0\nmass_tolerance = 0.05\ncom_tolerance = 0.003\n'
    path.write_text(text)
    arm = load_robot(path)
    assert arm.inertia_tolerance == pytest.approx(
        {"joint1.mass": 0.1, "joint1.com_x": 0.003, "joint1.com_y": 0.003, "joint1.com_z": 0.003}
    )
    assert load_robot(arm.save(tmp_path / "again.toml")).inertia_tolerance == arm.inertia_tolerance
    path.write_text(text.replace("0.05", "-0.05"))
    with refuses(FileError, "mass_tolerance", -0.05):
        load_robot(path)


@pytest.mark.slow
def test_the_standard_error_of_a_compliance_is_that_of_its_scatter_over_arms():
    """Arms whose masses are 10 % off, as the file says: errors are about one stated standard error."""
    off = []
    for seed in range(20, 26):
        case = under(CONDITIONS["masses10"], "compliance", seed)
        (hidden,) = case.hidden
        found = diagnose(case.robot, case.data, held_out=0.0)
        off += [
            (size - hidden.size[0]) / std
            for a in found.effects
            if a.effect.name == hidden.name
            for joint, size, std in zip(a.effect.joints, a.effect.coefficients, a.std, strict=True)
            if joint == hidden.joints[0]
        ]
    assert len(off) == 6
    assert 0.4 < np.sqrt(np.mean(np.square(off))) < 1.5
