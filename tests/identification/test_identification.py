"""Whole runs on data of every kind: held-out errors that can be believed, and sentences where they can't."""

from dataclasses import replace

import generator
import numpy as np
import pytest
from checks import freed

from workbench import Dataset, Motion, Noise, evaluate, identify, load_robot, tool_poses, write_toml
from workbench.arm.robot_toml import read_toml
from workbench.base import se3
from workbench.base.types import Freedom, Outcome
from workbench.data.simulation.simulate import virtual_arm
from workbench.identification.algorithms.opt2_levenberg_marquardt import Opt2
from workbench.identification.problem import Problem
from workbench.identification.report.document import identified

NOISE = Noise(1e-4, 3e-4)
LAYOUT = np.array([[0.05, 0, 0], [0, 0.05, 0], [-0.05, 0, 0.02], [0, -0.05, 0.04]])
ANCHORS = np.array([[0.9, 0.2, 0.1], [-0.4, 0.8, 0.3], [0.1, -0.9, 0.6]])


@pytest.fixture(scope="module")
def arm():
    return generator.aria().perturbed(np.random.default_rng(1), length=2e-3, angle=0.01)


def poses(arm, rng, rows, base=None):
    q = arm.random(rng, rows)
    position, rotation = arm.measure(q, rng, *NOISE[:2])
    if base is not None:
        position, rotation = se3.apply(base[None], position), base[:3, :3] @ rotation
    return Dataset(q=q, row=np.arange(rows), position=position, rotation=rotation)


def join(*parts, sessions):
    session = np.repeat(sessions, [len(p) for p in parts])
    return Dataset(
        q=np.concatenate([p.q for p in parts]),
        position=np.concatenate([p.position for p in parts]),
        rotation=np.concatenate([p.rotation for p in parts]),
        session=session,
    )


def some_base(rng):
    return se3.pose(se3.rotvec_to_matrix(rng.normal(0.0, 1.0, 3)), rng.normal(0.0, 1.0, 3))


def distances(arm, rng, rows, noise=0.0):
    q = arm.random(rng, rows)
    which = np.arange(rows) % 3
    length = np.linalg.norm(arm.pose(q)[:, :3, 3] - ANCHORS[which], axis=1)
    return Dataset(
        q=q, distance=length + noise * rng.standard_normal(rows), anchor=np.array(list("ABC"))[which]
    )


KNOWN = {f"anchor[{n}].{a}": ANCHORS[i, k] for i, n in enumerate("ABC") for k, a in enumerate("xyz")}


def test_distances_from_known_anchors(arm):
    rng = np.random.default_rng(3)
    rows, q = distances(arm, rng, 120), arm.random(rng, 100)
    run = identify(load_robot("aria"), rows, algorithms=("ols", "opt2"), known=KNOWN)
    for result in run.runs.values():
        assert result.held_out.position_mm.max < 1e-3
        off = tool_poses(result.calibrated, Motion(q))[:, :3, 3] - arm.pose(q)[:, :3, 3]
        assert np.abs(off).max() < 1e-9
    zeros = np.array([4e-3, -2e-3, 0.05])
    distance = rows.distance + zeros[np.arange(120) % 3] + 2e-5 * rng.standard_normal(120)
    best = identify(load_robot("aria"), replace(rows, distance=distance), known=KNOWN).best
    found = best.fit.problem.instrument(best.fit.x)
    assert [found[f"wire[{n}].zero"] for n in "ABC"] == pytest.approx(zeros, abs=1e-4)
    assert best.held_out.position_mm.mean < 0.04


def test_loose_markers(arm):
    rng = np.random.default_rng(4)
    q = arm.random(rng, 60)
    exact = se3.apply(arm.pose(q)[:, None], LAYOUT[None])
    markers = exact + 1e-4 * rng.standard_normal((60, 4, 3))
    hidden = markers.copy()
    hidden[::2, 1:] = np.nan
    for seen in (markers, hidden):
        run = identify(load_robot("aria"), Dataset(q=q, row=np.arange(60), markers=seen))
        assert run.best.held_out.position_mm.rms == pytest.approx(np.sqrt(3.0) * 0.1, rel=0.4)
        assert run.noise.position == pytest.approx(1e-4, rel=0.15)
    run = identify(load_robot("aria"), Dataset(q=q, markers=exact), algorithms=("ols", "opt2"))
    for result in run.runs.values():
        assert result.held_out.position_mm.rms < 1e-3 * run.nominal.held_out.position_mm.rms


@pytest.mark.parametrize(("name", "yaw"), [("xarm6", 230), ("iiwa14", 110), ("iiwa14", 205)])
def test_markers_find_a_base_wherever_it_is(name, yaw):
    robot = load_robot(name)
    q = np.random.default_rng(yaw + 300).uniform(-0.6, 0.6, (30, robot.dof))
    base = se3.pose(se3.rotvec_to_matrix(np.radians([0.0, 0.0, yaw])), np.array([3.0, 0.3, -0.6]))
    markers = se3.apply((base @ robot.predict(q))[:, None], LAYOUT[None])
    assert evaluate(robot, Dataset(q=q, markers=markers), fit_frames=True).errors.position_mm.max < 1e-3


def test_contacts_beside_their_known_places_are_held_out_as_points(arm):
    """They are no contacts then: held out rows were ignored, as if no fitted row used them."""
    rows = distances(arm, np.random.default_rng(5), 60)
    seen = arm.pose(rows.q)[:, :3, 3] + 5e-5 * np.random.default_rng(1).standard_normal((60, 3))
    run = identify(load_robot("aria"), Dataset(q=rows.q, position=seen, contact=rows.anchor))
    assert len(run.held_out_data) == 12
    assert run.best.held_out.position_mm.mean < 0.2


def touching(arm, rng):
    """Joint positions, half of their ranges around the middle, that touch one of three places exactly."""
    q, names = [], []
    places = np.array([[0.4, 0.3, 0.2], [0.5, -0.1, 0.4], [0.2, 0.5, 0.5]])
    while len(q) < 90:
        place = places[len(q) % 3]
        x = arm.touching(place, arm.random(rng, 1))
        within = (np.abs(x - arm.limits.mean(1)) < 0.5 * np.ptp(arm.limits, axis=1)).all()
        if within and np.linalg.norm(arm.pose(x)[0, :3, 3] - place) < 1e-12:
            names.append("abc"[len(q) % 3])
            q.append(x[0])
    return np.array(q), np.array(names)


def test_contacts_that_are_exact_are_explained(arm):
    q, names = touching(arm, np.random.default_rng(21))
    problem = Problem.build(load_robot("aria"), Dataset(q=q, contact=names))
    search = Opt2().search(problem)
    assert search.outcome is Outcome.CONVERGED
    before, after = (problem.residual(x) for x in (problem.start, search.x))
    assert after @ after < 1e-6 * (before @ before)


@pytest.mark.slow
def test_contacts_do_not_shrink_the_arm(arm):
    rng = np.random.default_rng(5)
    q, names = touching(arm, rng)
    q += 1e-4 * rng.standard_normal((90, 6))
    pedestal = load_robot("aria").with_values({"joint1.d": 0.8})  # the longest, and moves all places alike
    run = identify(pedestal, Dataset(q=q, row=np.arange(90), contact=names))
    assert any("scale" in note for note in run.notes)
    fit, lengths = run.best.fit, ("joint2.a", "joint4.d")
    assert fit.arm.values(lengths) == pytest.approx(pedestal.values(lengths), abs=0.02)
    std = dict(zip(fit.problem.names, fit.std, strict=True))
    assert all(std[name] > 2e-4 for name in lengths)  # as near as they are to nominal, not as the rows agree
    assert run.best.transfer.anywhere.position > 5e-4
    assert "nobody measured" in run.transfer_warning()
    problem = run.ready.problem  # as of a diagnosis, which expects nothing of the constants
    search = replace(fit.search, x=problem.at(fit.problem.named(fit.x)))
    again = run.ready.scaled(replace(fit, problem=problem, search=search))
    assert again.calibrated.calibration.observed.flange.position > 5e-4


def test_held_out_anchors_of_few_rows_leave_rows_and_data_alike(arm):
    """In the same file; a gross error in a held-out row was kept, as the rows seemed another file's."""
    rows = distances(arm, np.random.default_rng(6), 120, 1e-4)
    anchor, distance = rows.anchor.astype("U2"), rows.distance.copy()
    anchor[-3:], distance[90] = "D", distance[90] + 1.0
    session = np.array(["s1"] * 80 + ["s2"] * 40)
    data = replace(rows, anchor=anchor, distance=distance, session=session)
    run = identify(load_robot("aria"), data, held_out="session:s2", frames="shared")
    assert len(run.held_out_rows) == len(run.held_out_data) == 36
    assert {row for row, _ in run.excluded} | {o.row for o in run.outliers} == {90, 117, 118, 119}


def test_a_calibrated_file_with_sessions_is_identified_again(arm, tmp_path):
    rng = np.random.default_rng(8)
    data = join(*(poses(arm, rng, 30, some_base(rng)) for _ in range(3)), sessions=["a", "b", "c"])
    first = identify(freed(load_robot("aria"), Freedom.AUTO), data)
    mean = first.best.held_out.position_mm.mean
    again = read_toml(write_toml(first.best.calibrated, tmp_path / "calibrated.toml"))
    for freedom in (Freedom.AUTO, Freedom.FIXED, Freedom.FREE):
        second = identify(freed(again, freedom), data)
        for result in second.runs.values():
            assert result.held_out.position_mm.mean == pytest.approx(mean, rel=0.1)


def test_held_out_sessions_find_their_own_base(arm):
    rng = np.random.default_rng(9)
    data = join(*(poses(arm, rng, 30, some_base(rng)) for _ in range(4)), sessions=["a", "b", "c", "d"])
    run = identify(freed(load_robot("aria"), Freedom.AUTO), data, held_out=("c", "d"))
    assert run.best.held_out.position_mm.mean < 0.3
    assert any("c, d" in note for note in run.notes)
    assert run.nominal.held_out.position_mm.mean > 10 * run.best.held_out.position_mm.mean


def test_a_joint_that_never_moved_makes_the_model_doubtful_elsewhere(arm):
    rng = np.random.default_rng(12)
    q = arm.random(rng, 60)
    q[:, 3] = 0.4
    run = identify(load_robot("aria"), Dataset(q, *arm.measure(q, rng, *NOISE[:2])))
    tried = arm.random(rng, 400)
    off = tool_poses(run.best.calibrated, Motion(tried))[:, :3, 3] - arm.pose(tried)[:, :3, 3]
    assert run.best.transfer.anywhere.position > 0.5 * np.sqrt((off**2).sum(1).mean())
    assert run.best.transfer.anywhere.position > 3 * run.best.transfer.near.position


def test_sigma_of_rows_reaches_every_observation(arm):
    rng = np.random.default_rng(14)
    data = distances(arm, rng, 300, 1e-3)
    stated = replace(data, sigma=np.full((300, 6), 1e-3))
    run = identify(load_robot("aria"), stated, held_out=0.0, algorithms=("opt2",))
    assert run.best.fit.variance_factor == pytest.approx(1.0, abs=0.35)
    assert run.instrument.position == pytest.approx(1e-3)
    half = replace(
        poses(arm, rng, 60), sigma=np.column_stack([np.full((60, 3), 1e-4), np.full((60, 3), np.nan)])
    )
    run = identify(load_robot("aria"), half, held_out=0.0, algorithms=("opt2",))
    assert run.noise.rotation == pytest.approx(3e-4, rel=0.15)


def test_evaluation_gives_what_identification_said(arm):
    data = distances(arm, np.random.default_rng(16), 120, 1e-4)
    run = identify(load_robot("aria"), data, held_out=0.0)
    found = evaluate(run.best.calibrated, data)
    assert found.errors.position_mm.mean == pytest.approx(run.best.train.position_mm.mean, rel=0.02)


def test_base_and_tool_that_parallel_joints_alone_moved_are_open():
    """They had ± 0.6 mm, a hundred times less than they were off."""
    arm, rng = load_robot("ur5e"), np.random.default_rng(4)
    q = [0.3, -1.6, 1.4, -1.7, -1.6, 0.2] + rng.uniform(-0.6, 0.6, (40, 6)) * [0, 1, 1, 1, 0, 0]
    at = virtual_arm(arm, rng=rng, errors=(3e-4, 3e-4)).predict(q)
    seen = (
        at[:, :3, 3] + at[:, :3, :3] @ [0.03, -0.02, 0.11] + [0.9, -0.4, 0.2] + rng.normal(0, 3e-5, (40, 3))
    )
    run = identify(arm, Dataset(q=q, position=seen), reading="given")
    assert any("open by any length" in text for text in run.warnings)
    std = {one.name: one.std for one in identified(run.best.fit)}
    assert not {"base.x", "base.y", "tool.x"} & {name for name in std if std[name] is not None}
