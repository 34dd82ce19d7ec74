"""Hidden arms are found again: measurements come from `generator`, which shares no code with the package."""

from dataclasses import replace

import generator
import numpy as np
import pytest
from checks import freed, robot_of
from slow import slow

from workbench import Dataset, Motion, Noise, identify, load_plate, load_robot, measure_plate, tool_poses
from workbench.base import se3
from workbench.base.types import Freedom, Outcome
from workbench.identification.algorithms.ols import Ols
from workbench.identification.algorithms.opt1_bounded import Opt1
from workbench.identification.algorithms.opt2_levenberg_marquardt import Opt2
from workbench.identification.problem import Problem
from workbench.identification.undetermined_combinations import factorise

PLATE_NOISE = Noise(1e-4, np.deg2rad(0.02))
ALGORITHMS = {"ols": (Ols(), 1e-9), "opt1": (Opt1(), 1e-6), "opt2": (Opt2(), 1e-9)}


def rows_of(arm, q, rng=None, sigma_p=0.0, sigma_r=0.0, deflection=None):
    """Pose measurements of the generator's arm."""
    return Dataset(q, *arm.measure(q, rng or np.random.default_rng(0), sigma_p, sigma_r, deflection))


def held_out_error(robot, arm, rng, rows=100):
    """Greatest distance [m] between an arm and its model at random joint positions."""
    q = arm.random(rng, rows)
    return np.abs(tool_poses(robot, Motion(q))[:, :3, 3] - arm.pose(q)[:, :3, 3]).max()


HIDDEN = {
    "made badly": lambda: generator.aria().perturbed(np.random.default_rng(11)),
    "table 3": generator.ARMS["aria-table3"],
    "table 4": generator.ARMS["aria-table4"],
}


@pytest.mark.parametrize("algorithm", ALGORITHMS)
@pytest.mark.parametrize("hidden", HIDDEN)
def test_the_plate_recovers_a_hidden_aria(hidden, algorithm, tmp_path):
    arm = HIDDEN[hidden]()
    robot = robot_of(arm, tmp_path)
    q = measure_plate(robot, load_plate("table2"), instrument="ideal", actual=robot)[1].q
    identifier, bound = ALGORITHMS[algorithm]
    problem = Problem.build(load_robot("aria"), rows_of(arm, q), noise=PLATE_NOISE)
    search = identifier.search(problem)
    assert search.outcome is Outcome.CONVERGED
    found = problem.robot_at(search.x)
    assert held_out_error(found, arm, np.random.default_rng(5)) < bound


@pytest.mark.parametrize("name", ["three-parallel", "katana", slow("seven")])
def test_other_arms_are_recovered_with_unknown_base_and_tool(name, tmp_path):
    nominal = generator.ARMS[name]()
    rng = np.random.default_rng(3)
    base = se3.pose(se3.rotvec_to_matrix(np.array([0.4, -0.8, 2.0])), np.array([1.5, -0.7, 0.3]))
    tool = se3.pose(se3.rotvec_to_matrix(np.array([-0.5, 0.2, 0.9])), np.array([0.03, -0.02, 0.12]))
    hidden = replace(nominal.perturbed(rng, length=2e-3, angle=np.deg2rad(1.0)), base=base, tool=tool)
    robot = freed(robot_of(nominal, tmp_path), Freedom.AUTO)
    run = identify(robot, rows_of(hidden, hidden.random(rng, 80)), algorithms=("ols", "opt2"), held_out=0.0)
    for result in run.runs.values():
        assert result.fit.outcome is Outcome.CONVERGED
        assert held_out_error(result.calibrated, hidden, rng) < 1e-9
    assert any("base yaw" in text for text in run.unidentifiable)


def test_errors_are_as_large_as_their_standard_errors_say(tmp_path):
    squares, sizes = [], []
    nominal = load_robot("aria")
    for seed in range(40):
        rng = np.random.default_rng(seed)
        arm = generator.aria().perturbed(rng)
        problem = Problem.build(
            nominal, rows_of(arm, arm.random(rng, 30), rng, *PLATE_NOISE[:2]), noise=PLATE_NOISE
        )
        search = Opt2().search(problem)
        actual = robot_of(arm, tmp_path).values(problem.names)
        factor = factorise([problem.evaluate(search.x)], np.ones(len(problem.names)))
        z = (search.x - actual) / np.sqrt(np.diag(factor.covariance()))
        squares.append(np.mean(z**2))
        sizes.append(2.0 * search.history[-1] / (problem.size - factor.rank))
    assert np.mean(squares) == pytest.approx(1.0, abs=0.12)
    assert np.mean(sizes) == pytest.approx(1.0, abs=0.05)


def test_points_recover_what_points_can_show(tmp_path):
    rng = np.random.default_rng(8)
    nominal = replace(generator.three_parallel(), tool=se3.pose(np.eye(3), np.array([0.05, 0.02, 0.1])))
    hidden = nominal.perturbed(rng, length=2e-3, angle=np.deg2rad(1.0))
    q = nominal.random(rng, 120)
    data = Dataset(q=q, row=np.arange(120), position=hidden.pose(q)[:, :3, 3])
    run = identify(robot_of(nominal, tmp_path), data, algorithms=("ols", "opt2"), held_out=0.0)
    for result in run.runs.values():
        assert held_out_error(result.calibrated, hidden, rng) < 1e-9


def test_opt1_keeps_constants_within_their_bounds():
    """A joint 0.2 m from where it nominally is."""
    arm, rng = generator.aria(), np.random.default_rng(3)
    table = arm.table.copy()
    table[2, 1] += 0.2
    problem = Problem.build(load_robot("aria"), rows_of(replace(arm, table=table), arm.random(rng, 40)))
    ols, opt1 = (algorithm.search(problem).x for algorithm in (Ols(), Opt1()))
    lower, upper = problem.bounds
    assert (ols > upper + 0.05).any()
    assert ((opt1 >= lower) & (opt1 <= upper)).all()
    assert (opt1 == upper).any()


def test_repeats_of_a_posture_weigh_as_one_pose_and_move_no_arm():
    """An arm as in its table, whose postures scatter by 0.4 mm: more than six readings of each do."""
    rng, arm = np.random.default_rng(5), generator.aria()
    once = replace(rows_of(arm, arm.random(rng, 22), rng, 4e-4), rotation=None)
    read = np.repeat(once.position, 6, axis=0)
    often = Dataset(np.repeat(once.q, 6, axis=0), read + rng.normal(0.0, 2e-5, read.shape))
    fits = [identify("aria", rows, held_out=0.0).best for rows in (once, often)]
    assert all(run.deviation < 1e-4 for run in fits)
    assert fits[1].fit.std == pytest.approx(fits[0].fit.std, rel=0.2, abs=1e-9)
    assert fits[1].fit.spare == pytest.approx(fits[0].fit.spare)
