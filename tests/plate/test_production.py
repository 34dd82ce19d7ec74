"""Production of virtual arms: against arms made and identified one at a time; on one machine and many."""

import io
import multiprocessing
import os
import signal
from dataclasses import fields, replace

import numpy as np
import pytest
from rich.console import Console

from workbench.arm.built_in_arms import load_robot
from workbench.arm.effects import JointCompliance
from workbench.arm.frame import Frame
from workbench.arm.inverse.solve import follow_many
from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.base import se3
from workbench.base.errors import DataError, OptionError
from workbench.base.parallel import spread
from workbench.base.progress import running
from workbench.base.types import Outcome
from workbench.data.accuracy_requirement import Requirement
from workbench.data.dataset import Dataset
from workbench.data.simulation.simulate import virtual_arm
from workbench.identification.algorithms.ols import Ols
from workbench.identification.problem import Problem
from workbench.identification.problem_blocks import Noise
from workbench.plate.monte_carlo import production_yield
from workbench.plate.monte_carlo.arms import try_arms
from workbench.plate.monte_carlo.production_yield import gather, try_production
from workbench.plate.monte_carlo.reach_targets import branches_by_distance, reach_targets
from workbench.plate.monte_carlo.yield_inputs import ErrorSizes, YieldJob, constrained_by
from workbench.plate.plate import Kind
from workbench.plate.region_poses import plate_region_poses
from workbench.plate.report.design import yield_tables
from workbench.plate.target_branches import choose_branches

NONE = np.zeros(10)
QUIET = ErrorSizes(
    seat_position=0.0, seat_rotation=0.0, joint=0.0, target_position=NONE, target_rotation=NONE
)
USUAL = replace(
    QUIET,
    seat_position=1e-4,
    seat_rotation=float(np.deg2rad(0.02)),
    target_position=NONE + 5e-5,
    target_rotation=NONE + 2e-4,
)
SEED = np.random.SeedSequence(7)


@pytest.fixture(scope="module")
def job(aria, plate, solutions):
    goal = plate_region_poses(aria, plate)
    q = choose_branches(aria, plate, solutions, goal=goal, rng=np.random.default_rng(0), starts=2).q
    bank = plate_region_poses(aria, plate, 80)
    return YieldJob(
        robot=aria,
        names=aria.default_free,
        poses=plate.poses,
        q=q,
        constrained=constrained_by(plate),
        errors=USUAL,
        sigma=USUAL.assumed,
        length=5e-3,
        angle=float(np.deg2rad(5.0)),
        bank=bank,
        cells=plate.region.cells(tool_poses(aria, Motion(bank))[:, :3, 3]),
    )


@pytest.fixture(scope="module", autouse=True)
def small_chunks():
    """Several chunks of few arms: the pieces of a large trial."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(production_yield, "CHUNK", 100)
        yield


@pytest.fixture(scope="module")
def found(job):
    return try_production(job, arms=400, seed=3)


def equal(one, other):
    for f in fields(one):
        a, b = getattr(one, f.name), getattr(other, f.name)
        same = np.array_equal(a, b) if isinstance(a, np.ndarray) else a == b
        if f.name != "wanted":
            assert same, f.name


def test_without_errors_every_arm_is_calibrated_exactly(job):
    exact = replace(job, errors=QUIET)
    chunk = try_arms(exact, SEED, 40)
    assert chunk.reached.all()
    assert chunk.position.max() < 1e-8
    assert chunk.rotation.max() < 1e-8
    assert (chunk.within == 1.0).all()


def test_an_arm_is_brought_where_following_brings_it(aria, plate, job):
    """The stack against one arm by the inverse kinematics, with the base somewhere else."""
    moved = aria.with_frames(
        base=Frame(np.array([0.3, -0.2, 0.5]), se3.rpy_to_matrix(np.array([0.1, 0.2, 0.3])))
    )
    arm = virtual_arm(moved, rng=np.random.default_rng(1), length=1e-3, angle=0.01)
    wanted = moved.base.pose @ plate.poses
    shift = arm.chain.values - moved.chain.values
    branches = branches_by_distance(moved, wanted, job.q)
    reached = reach_targets(moved, shift[None], wanted[None], branches=branches, constrained=job.constrained)
    followed = follow_many(arm, wanted, job.q)
    assert reached.met.all()
    kept = followed.converged
    assert kept.sum() >= 8
    assert np.allclose(reached.q[0][kept], followed.q[kept], atol=1e-6)
    assert np.allclose(tool_poses(arm, Motion(reached.q[0])), wanted, atol=1e-6)


def test_the_stack_identifies_as_ols_does(aria, job):
    """One virtual arm, its plate off and its seats noisy, through the identification of measured rows."""
    rng = np.random.default_rng(5)
    arm = virtual_arm(aria, rng=rng, length=2e-3, angle=0.02)
    seats = se3.pose(
        se3.rotvec_to_matrix(rng.normal(0, 3e-4, (10, 3))) @ job.poses[:, :3, :3],
        job.poses[:, :3, 3] + rng.normal(0, 1e-4, (10, 3)),
    )
    q = follow_many(arm, seats, job.q).q
    rows = Dataset(q=q, row=np.arange(10), position=job.poses[:, :3, 3], rotation=job.poses[:, :3, :3])
    noise = Noise(float(job.sigma[0, 0]), float(job.sigma[0, 3]))
    problem = Problem.build(aria, rows, noise=noise)
    fitted = Ols().search(problem).x
    from workbench.plate.monte_carlo.arms import _calibrate

    stacked = aria.values(job.names) + _calibrate(job, q[None])[0]
    order = [problem.names.index(n) for n in job.names]
    assert np.allclose(stacked, fitted[order], atol=1e-8)


def test_predicted_and_observed_errors_agree_in_every_cube(job):
    """With many samples a cube; the spread of a root mean square of N values is about 1/√(2N)."""
    coarse = replace(job, cells=job.cells % 8)
    noisy = replace(coarse, errors=replace(USUAL, joint=2e-4))
    found = gather(noisy, [try_arms(noisy, seed) for seed in SEED.spawn(3)], {})
    assert len(found.cells) == 8
    assert (np.abs(found.agreement - 1.0) < 0.15).all()
    assert found.samples.min() > 500


def test_sources_add_up_and_the_worst_is_named(found):
    assert set(found.sources) == {"seat position", "seat rotation", "target position", "target rotation"}
    total = np.sqrt(sum(position**2 for position, _ in found.sources.values()))
    assert total == pytest.approx(found.position_rms, rel=0.1)
    assert found.blame == "seat position"
    assert sum(found.shares.values()) == pytest.approx(1.0)


def test_the_table_says_its_units(found):
    console = Console(width=120, file=io.StringIO())
    console.print(yield_tables(found))
    words = console.file.getvalue()
    assert "position error, rms [mm]" in words
    assert "median, 95 %, worst arm [mm]" in words


def test_all_arms_pass_eq_3_with_mixed_branches_and_fewer_with_more_noise(job, found):
    assert found.share == 1.0
    assert found.interval[0] > 0.99
    loud = replace(job, errors=replace(USUAL, seat_position=1e-3))
    worse = gather(loud, [try_arms(loud, SEED, 100)], {})
    assert worse.share < 0.5
    assert (
        worse.passed.sum()
        == (worse.reached & (worse.worst[:, 0] <= 1e-3) & (worse.worst[:, 1] <= worse.wanted.rotation)).sum()
    )
    easy = replace(loud, wanted=Requirement(radius=0.05, per_axis=0.02).wanted)
    lax = gather(easy, [try_arms(easy, SEED, 100)], {})
    assert lax.share == 1.0
    assert lax.wanted.rotation == pytest.approx(
        2 * np.arcsin((0.05 - 0.02 * np.sqrt(3)) / (2 * np.sqrt(2) * 0.2))
    )


def test_effects_that_nobody_declared_are_seen_and_blamed(job, aria):
    soft = replace(aria, effects=(JointCompliance(joints=(1,), coefficients=(4e-5,)),))
    deflected = replace(job, errors=replace(USUAL, undeclared=soft))
    assert try_arms(deflected, SEED, 25).position.mean() > try_arms(job, SEED, 25).position.mean()
    alone = try_arms(replace(deflected, errors=deflected.errors.alone()["undeclared effects"]), SEED, 25)
    assert alone.position.min() > 1e-6


def test_a_chunk_of_sockets_leaves_orientations_open(job, plate):
    balls = replace(plate, targets=tuple(replace(t, kind=Kind.SOCKET) for t in plate.targets))
    sockets = replace(job, constrained=constrained_by(balls), errors=QUIET)
    assert sockets.linearisation.rank() < 24
    chunk = try_arms(sockets, SEED, 20)
    assert chunk.reached.all()
    assert chunk.position.max() < 5e-3


def test_sockets_are_as_good_as_predicted(job, plate):
    """What no socket shows of the nominal arm, the last joint's angle, they show of arms as they are made."""
    balls = replace(plate, targets=tuple(replace(t, kind=Kind.SOCKET) for t in plate.targets))
    errors = replace(QUIET, seat_position=5e-5)
    sockets = replace(job, constrained=constrained_by(balls), errors=errors, sigma=errors.assumed)
    chunk = try_arms(sockets, SEED, 60)
    observed = np.sqrt(np.median(chunk.position[chunk.planned] ** 2))
    assert observed < 1.6 * np.sqrt(sockets.predicted()[:, 0].mean())


def test_the_same_seed_gives_the_same_arms(job, found):
    few = replace(job, errors=replace(QUIET, seat_position=1e-4))
    equal(*(try_production(few, arms=150, seed=3) for _ in range(2)))
    assert not np.array_equal(try_production(few, arms=50, seed=4).position, found.position[:50])


def test_cancelled_it_hands_back_the_arms_so_far(job, found):
    seen = []
    with running(lambda share, text: seen.append(share), lambda: bool(seen)):
        part = try_production(job, arms=400, seed=3)
    assert part.outcome is Outcome.CANCELLED
    assert 100 <= part.arms < 400
    assert np.array_equal(part.position, found.position[: part.arms])
    assert part.sources == {}
    assert seen == sorted(seen)


@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::ResourceWarning")
def test_a_cluster_gives_the_same_numbers_and_bears_the_loss_of_a_worker(job, found, monkeypatch):
    distributed = pytest.importorskip("distributed")
    multiprocessing.set_forkserver_preload(["distributed", try_arms.__module__])  # once for all workers
    monkeypatch.setattr("distributed.utils._forkserver_preload_set", True)
    forked = {"distributed.worker.multiprocessing-method": "forkserver"}
    with (
        pytest.importorskip("dask").config.set(forked),
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=None, memory_limit=None
        ) as cluster,
    ):
        killed = []

        def kill_one(share, text):
            if not killed and share > 0.3:
                pid = next(iter(cluster.workers.values())).process.process.pid
                os.kill(pid, signal.SIGKILL)
                killed.append(pid)

        address = cluster.scheduler_address
        with running(kill_one):
            equal(try_production(job, arms=400, seed=3, scheduler=address), found)
        assert killed


def test_nobody_at_the_address(monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr("workbench.base.parallel.CONNECTING", 0.3)
    with pytest.raises(OptionError, match="no Dask scheduler answers at tcp"):
        spread(len, [([],)], scheduler="tcp://127.0.0.1:9")


def test_what_can_not_be_tried(job):
    with pytest.raises(OptionError, match="at least 1, got 0"):
        try_production(job, arms=0)
    few = replace(job, poses=job.poses[:2], q=job.q[:2], constrained=job.constrained[:2], sigma=job.sigma[:2])
    with pytest.raises(DataError, match="three targets or more"):
        try_production(few, arms=10)
    with pytest.raises(OptionError, match="negative"):
        replace(USUAL, seat_position=-1.0)
    katana = load_robot("katana450")
    with pytest.raises(DataError, match="can't sit in a seat"):
        try_production(replace(job, robot=katana), arms=10)


def test_a_place_in_the_plane_of_a_ball_bar_s_anchors_has_a_weight():
    """No distance shows the direction across that plane: little weight there, the usual one elsewhere."""
    plane = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-0.6, -0.8, 0.0]])
    errors = replace(QUIET, seat_position=5e-6, away=np.stack([plane, np.eye(3)]))
    assert np.allclose(errors.assumed[0, :3] / 5e-6, [0.9, 0.8, 1e3], rtol=0.1)
    assert np.allclose(errors.assumed[1, :3], 5e-6, rtol=1e-5)
