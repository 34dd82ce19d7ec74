"""What rows hardly show stays near nominal, in every algorithm; what they show well hardly notices."""

from dataclasses import replace

import generator
import numpy as np
import pytest
from checks import robot_of
from slow import slow

from workbench import Dataset, identify
from workbench.identification.errors.expected_deviation import with_expected_deviation
from workbench.identification.problem import Noise, Problem

REFLECTOR = 0.031
"""Distance of the reflector from the flange, on the last axis [m]."""
ALGORITHMS = ("ols", "opt1", "opt2")


def flange_angle(arm, other, q):
    """Mean angle between the flanges of two arms [°], after the best turn of their bases."""
    a, b = (x.pose(q)[:, :3, :3] for x in (arm, other))
    u, _, v = np.linalg.svd(np.einsum("nij,nkj->ik", a, b))
    turned = u @ np.diag([1.0, 1.0, np.linalg.det(u @ v)]) @ v @ b
    cosine = (np.einsum("nij,nij->n", a, turned) - 1.0) / 2.0
    return np.rad2deg(np.arccos(np.clip(cosine, -1.0, 1.0))).mean()


def virtual(robot, like):
    """The package's arm as one of the generator, tool and base left as they were."""
    table = [[robot.values((f"joint{k}.{n}",))[0] for n in generator.NAMES] for k in range(1, 7)]
    return replace(like, table=np.array(table))


@pytest.mark.parametrize("seed", [0, slow(1), slow(2)])
def test_one_reflector_leaves_the_wrist_as_it_is(seed, tmp_path):
    """In a narrow region; joint errors of a few orders, in no geometry, pull at whatever rows leave open."""
    rng, nominal = np.random.default_rng(seed), generator.three_parallel()
    nominal = replace(nominal, tool=generator.move("z", REFLECTOR))
    made = nominal.perturbed(rng, length=4e-4, angle=4e-4)
    low, high = np.deg2rad([[-24, -105, 30, -120, -100, -60], [57, -25, 140, -60, -70, 60]])
    q = rng.uniform(low, high, (200, 6))
    waves = sum(np.sin(k * q + rng.uniform(0, 6, 6)) for k in (3, 5, 8))
    position, _ = made.measure(q, rng, 3e-5, 0.0, 2e-4 * waves[..., None] * [0.0, 0.0, 1.0])
    rows = Dataset(q=q, row=np.arange(200), position=position)
    robot = robot_of(nominal, tmp_path, free='"auto"')
    run = identify(robot, rows, seed=seed, algorithms=ALGORITHMS)
    before = flange_angle(made, nominal, rows.q)
    for name in ALGORITHMS:
        found = run.runs[name].calibrated
        assert flange_angle(made, virtual(found, nominal), rows.q) < max(2.0 * before, 0.1), name
        assert found.values(("joint6.theta",)) == pytest.approx([0.0], abs=1e-6)
        # nobody pays for it at the reflector
        assert run.runs[name].held_out.position_mm.mean < 1.1 * 0.35
    free = identify(robot, rows, seed=seed, deviation=np.inf, algorithms=("opt2",))
    assert run.best.held_out.position_mm.mean < 1.02 * free.best.held_out.position_mm.mean


@pytest.mark.parametrize("size", [3e-4, 3e-3, 3e-2])
def test_the_size_of_an_arms_errors_is_found(size, tmp_path):
    found = []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        arm = generator.aria()
        made = arm.perturbed(rng, length=size * np.sqrt(3.0), angle=size * np.sqrt(3.0))
        q = arm.random(rng, 60)
        rows = Dataset(q, *made.measure(q, rng, 5e-5, 1e-4))
        problem = Problem.build(robot_of(arm, tmp_path), rows, noise=Noise(5e-5, 1e-4))
        found.append(with_expected_deviation(problem).deviation)
    assert np.median(found) == pytest.approx(size, rel=0.25)
