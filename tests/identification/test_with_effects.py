"""Geometry and effects identified together, from arms that bend by the generator's own statics."""

from dataclasses import replace

import checks
import generator
import numpy as np
import pytest
from checks import freed, robot_of
from refusals import mentions, refuses

from workbench import Dataset, Motion, evaluate, identify
from workbench.arm.effects import EFFECTS
from workbench.arm.frame import FRAME_PARTS
from workbench.arm.statics.deflection import shift_of
from workbench.base.errors import DataError
from workbench.base.types import Freedom, Outcome
from workbench.identification.algorithms.opt2_levenberg_marquardt import Opt2
from workbench.identification.problem import FrameFreedom, Problem
from workbench.identification.report.document import identified

SIGMA = 5e-5, np.deg2rad(0.01)
POSE = generator.turn("z", 2.0) @ generator.turn("x", 0.6) @ generator.move("x", 1.2)
TOOL = generator.turn("y", -0.5) @ generator.move("z", 0.12) @ generator.move("x", 0.04)


def with_effects(arm, folder, *effects, free=Freedom.FIXED):
    return freed(robot_of(arm, folder).with_effects(*effects), free)


def rows_of(arm, q, rng, sigma=SIGMA, payload=None, **bend):
    loads = np.zeros(len(q)) if payload is None else payload
    deflection = np.concatenate([arm.sag(q[[i]], payload=load, **bend) for i, load in enumerate(loads)])
    return Dataset(q, *arm.measure(q, rng, *sigma, deflection), payload=payload)


def about_the_axis(joint, size, dof=6):
    out = np.zeros((dof, 3))
    out[joint, 2] = size
    return out


CASES = {
    "compliance": ("joint-compliance", "joint2.compliance", {"compliance": about_the_axis(1, 4e-5)}, 4e-5),
    "backlash": ("backlash", "joint3.backlash", {"backlash": about_the_axis(2, 8e-4)}, 8e-4),
}


@pytest.mark.parametrize("free", [False, True], ids=["frames known", "frames free"])
@pytest.mark.parametrize("case", CASES)
def test_an_effect_is_recovered_with_the_geometry(case, free, tmp_path):
    name, coefficient, bend, size = CASES[case]
    rng = np.random.default_rng(7)
    hidden = generator.aria().perturbed(rng, length=2e-3, angle=np.deg2rad(1.0))
    if free:
        hidden = replace(hidden, base=POSE, tool=TOOL)
    data = rows_of(hidden, hidden.random(rng, 120), rng, **bend)
    effect = EFFECTS[name]((int(coefficient[5]) - 1,))
    robot = with_effects(generator.aria(), tmp_path, effect, free=Freedom.FREE if free else Freedom.FIXED)
    # OPT1 takes a minute for 37 unknowns whose frames repeat the arm's own constants
    algorithms = ("ols", "opt2") if free else ("ols", "opt1", "opt2")
    run = identify(robot, data, algorithms=algorithms, held_out=0.2, effects=[coefficient])
    for result in run.runs.values():
        fit = result.fit
        assert fit.outcome is Outcome.CONVERGED
        place = [p.name for p in fit.parameters].index(coefficient)
        assert abs(fit.x[place] - size) < 3.0 * fit.std[place]
        assert fit.std[place] < 0.05 * size
        # mean length of three normal errors, and of what 20 % of the rows leave of the parameters
        assert result.held_out.position_mm.mean < 1.25 * 1.6 * 1e3 * SIGMA[0]
        exact = rows_of(hidden, hidden.random(np.random.default_rng(9), 200), rng, (0.0, 0.0), **bend)
        assert evaluate(result.calibrated, exact).errors.position_mm.mean < 1e3 * SIGMA[0]
    units = {one.name: one.unit for one in identified(run.runs["ols"].fit)}
    assert units[coefficient] == robot.coefficient_units[coefficient]
    without = identify(robot.with_effects(), data, algorithms=("ols",), held_out=0.2)
    assert without.runs["ols"].held_out.position_mm.mean > 2.0 * run.runs["ols"].held_out.position_mm.mean


def test_an_arm_too_soft_for_its_load_is_no_answer(tmp_path):
    """A search that begins there ends at once, one that passes through comes back; a given arm is refused."""
    rng = np.random.default_rng(3)
    hidden = generator.aria()
    data = rows_of(hidden, hidden.random(rng, 40), rng, compliance=about_the_axis(1, 4e-5))
    robot = with_effects(hidden, tmp_path, EFFECTS["joint-compliance"]((1,)))
    problem = Problem.build(robot, data, free=(), effects=["joint2.compliance"])
    too_soft = np.array([0.2])
    assert np.isnan(problem.residual(too_soft)).any()
    lost = Opt2().search(problem, begin=too_soft)
    assert (lost.outcome, lost.x) == (Outcome.DIVERGED, too_soft)
    assert Opt2().search(problem).x == pytest.approx(4e-5, rel=0.1)
    soft = robot.with_effects(EFFECTS["joint-compliance"]((1,), (0.2,)))
    for verb in (identify, evaluate):
        with refuses(DataError):
            verb(soft, data)


def problem_with_effects(tmp_path, **options):
    rng = np.random.default_rng(2)
    arm = replace(generator.aria(), base=POSE, tool=TOOL)
    joints, bearing = EFFECTS["joint-compliance"], EFFECTS["bearing-compliance"]
    effects = joints((1, 2), (4e-5, 8e-5)), bearing((0,), (3e-5,))
    robot = with_effects(arm, tmp_path, *effects)
    data = rows_of(arm, arm.random(rng, 12), rng)
    frames = FrameFreedom(FRAME_PARTS, FRAME_PARTS)
    return Problem.build(robot, data, frames=frames, effects=tuple(robot.coefficients), **options)


def test_the_jacobian_and_gradient_of_a_problem_with_effects(tmp_path):
    problem = problem_with_effects(tmp_path)
    x = problem.start + np.random.default_rng(0).normal(0.0, 1e-4, len(problem.start)) * np.array(
        [0.1 if p.unit == "rad/(N*m)" else 1.0 for p in problem.parameters]
    )
    at = problem.evaluate(x)
    checks.check_jacobian(lambda x: -problem.residual(x), at.jacobian, x, tolerance=1e-6)
    cost, gradient = problem.cost_and_gradient(x)
    assert cost == pytest.approx(0.5 * float(at.residual @ at.residual))
    np.testing.assert_allclose(gradient, -at.jacobian.T @ at.residual, rtol=1e-9)
    moved = problem.robot_at(x)
    assert moved.coefficients == dict(
        zip(problem.robot.coefficients, x[[problem.names.index(n) for n in moved.coefficients]], strict=True)
    )
    plain = Problem.build(moved, problem.data, free=())
    np.testing.assert_allclose(plain.residual(plain.start), problem.residual(x), atol=1e-6)


def test_the_natural_unit_of_a_coefficient_bends_the_arm_by_one(tmp_path):
    problem = problem_with_effects(tmp_path)
    units = dict(zip(problem.names, problem.units.tolist(), strict=True))
    assert {units[p.name] for p in problem.parameters if not p.is_coefficient} == {1.0}
    for name in problem.robot.coefficients:
        robot = problem.robot.with_values(dict.fromkeys(problem.robot.coefficients, 0.0))
        small = 1e-6 * units[name]
        shift = shift_of(robot.with_values({name: small}), Motion.of(problem.data))
        assert np.abs(shift).max() == pytest.approx(1e-6, rel=5e-3)


def test_a_coefficient_that_no_row_drives_is_named(tmp_path):
    """All rows at the reference temperature: nothing tells how much the arm grows."""
    arm, rng = generator.aria(), np.random.default_rng(5)
    robot = with_effects(arm, tmp_path, EFFECTS["thermal-growth"]((), reference=20.0))
    data = replace(rows_of(arm, arm.random(rng, 30), rng), temperature=np.full(30, 20.0))
    run = identify(robot, data, algorithms=("ols",), held_out=0.0, effects=["arm.thermal_growth"])
    assert "arm.thermal_growth" in [n for c in run.runs["ols"].fit.unidentifiable for n in c.names]


def test_rows_beyond_a_range_are_named_by_their_place_in_the_file(tmp_path):
    """One of them refused the whole file."""
    arm, rng = generator.aria(), np.random.default_rng(5)
    effect = EFFECTS["local-joint-error"]((1,), knots=(-1.0, 0.0, 1.0))
    robot = with_effects(arm, tmp_path, effect)
    q = arm.random(rng, 20)
    q[:, 1] = 0.5
    q[12, 1] = 1.5
    data = replace(rows_of(arm, q, rng), row=np.arange(100, 120))
    for found in (evaluate(robot, data), identify(robot, data, algorithms=("ols",), free=("joint1.d",))):
        (note,) = [note for note in found.notes if "row 112 at 85.94°" in note]
        assert mentions(note, "-57.3° to 57.3°", "1 of 20")
