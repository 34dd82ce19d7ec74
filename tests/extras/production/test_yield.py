"""Production of virtual arms: against arms made and identified one at a time; on one machine and many."""

import io
import json
import multiprocessing
import os
import signal
import threading
from dataclasses import fields, replace

import numpy as np
import pytest
from refusals import mentions, refuses
from rich.console import Console

from tests.plate.test_like_with_like import of_kind
from tests.plate.test_plate_score import in_the_air
from tests.session.test_blocked import DOWN
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
from workbench.data.accuracy_requirement import Requirement, Wanted
from workbench.data.dataset import Dataset
from workbench.data.simulation.simulate import virtual_arm
from workbench.extras.production import plate_trial, production_yield
from workbench.extras.production.plate_trial import planned_joints, try_plate
from workbench.extras.production.production_yield import Yield, gather, try_production
from workbench.extras.production.reach_targets import branches_by_distance, reach_targets
from workbench.extras.production.report import yield_sentence, yield_tables
from workbench.extras.production.session import TryPlate
from workbench.extras.production.virtual_arms import try_arms
from workbench.extras.production.yield_inputs import ErrorSizes, YieldJob, constrained_by
from workbench.identification.algorithms.ols import Ols
from workbench.identification.problem import Problem
from workbench.identification.problem_blocks import Noise
from workbench.plate.plate import Kind, Target
from workbench.plate.plate_toml import load_plate, read_plate
from workbench.plate.predicted_error import predicted_error
from workbench.plate.region_poses import plate_region_poses
from workbench.plate.score import alike
from workbench.plate.target_branches import choose_branches
from workbench.plate.target_readings import SIGMAS, linearise_reading, reading_named, usual_sigma
from workbench.session.commands.drag import SelectTarget
from workbench.session.commands.edit import ChooseBranch
from workbench.session.commands.region import SetRegion, ShowCubes
from workbench.session.cube_values import values
from workbench.session.live_score import PlateTrial
from workbench.session.next_step import next_step
from workbench.session.page_state import Severity, Tab
from workbench.session.start import default_plate, start
from workbench.session.state import CubeView, UndoStep

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
    assert chunk.met.all()
    assert chunk.position.max() < 1e-8
    assert chunk.rotation.max() < 1e-8
    assert (chunk.used <= 1.0).all()


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
    from workbench.extras.production.virtual_arms import _calibrate

    stacked = aria.values(job.names) + _calibrate(job, q[None], np.ones((1, 10), bool))[0]
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
    text = console.file.getvalue()
    assert "position error, rms [mm]" in text
    assert "median, 95 %, worst arm [mm]" in text


def test_all_arms_pass_eq_3_with_mixed_branches_and_fewer_with_more_noise(job, found):
    assert found.share == 1.0
    assert found.interval[0] > 0.99
    loud = replace(job, errors=replace(USUAL, seat_position=1e-3))
    worse = gather(loud, [try_arms(loud, SEED, 100)], {})
    assert worse.share < 0.5
    assert (
        worse.passed.sum()
        == ((worse.worst[:, 0] <= 1e-3) & (worse.worst[:, 1] <= worse.wanted.rotation)).sum()
    )
    easy = replace(loud, wanted=Requirement(radius=0.05, per_axis=0.02).wanted)
    lax = gather(easy, [try_arms(easy, SEED, 100)], {})
    assert lax.share == 1.0
    assert lax.wanted.rotation == pytest.approx(
        2 * np.arcsin((0.05 - 0.02 * np.sqrt(3)) / (2 * np.sqrt(2) * 0.2))
    )


def test_an_arm_is_calibrated_with_the_targets_that_it_reaches(job):
    """One target that no arm reaches failed them all, though nine others tell nearly as much."""
    poses = job.poses.copy()
    poses[4, :3, 3] = [3.0, 0.0, 0.5]
    away = replace(job, poses=poses, errors=QUIET)
    chunk = try_arms(away, SEED, 20)
    assert chunk.met.all(axis=0).tolist() == [k != 4 for k in range(len(poses))]
    assert not chunk.planned.any()
    assert chunk.position.max() < 1e-8
    assert (chunk.used <= 1.0).all()
    found = gather(away, [chunk], {})
    assert not found.reached.any()
    (note,) = found.notes
    assert mentions(note, "target 5")
    assert mentions(yield_sentence(found), "20 of them")


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
    assert chunk.met.all()
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
            n_workers=2, threads_per_worker=1, dashboard_address=":0", memory_limit=None
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
    monkeypatch.setattr("workbench.base.parallel.CONNECTION_TIMEOUT", 0.3)
    with refuses(OptionError, option="--scheduler", found="tcp://127.0.0.1:9"):
        spread(len, [([],)], scheduler="tcp://127.0.0.1:9")


def test_what_can_not_be_tried(job):
    with refuses(OptionError, option="arms", found=0):
        try_production(job, arms=0)
    few = replace(job, poses=job.poses[:2], q=job.q[:2], constrained=job.constrained[:2], sigma=job.sigma[:2])
    with refuses(DataError, found=2):
        try_production(few, arms=10)
    with refuses(OptionError, option="sigma"):
        replace(USUAL, seat_position=-1.0)
    katana = load_robot("katana450")
    with refuses(DataError, found=5):
        try_production(replace(job, robot=katana), arms=10)


def test_a_place_in_the_plane_of_a_ball_bar_s_anchors_has_a_weight():
    """No distance shows the direction across that plane: little weight there, the usual one elsewhere."""
    plane = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-0.6, -0.8, 0.0]])
    errors = replace(QUIET, seat_position=5e-6, away=np.stack([plane, np.eye(3)]))
    assert np.allclose(errors.assumed[0, :3] / 5e-6, [0.9, 0.8, 1e3], rtol=0.1)
    assert np.allclose(errors.assumed[1, :3], 5e-6, rtol=1e-5)


@pytest.mark.slow
def test_virtual_arms_on_a_ball_bar_are_as_good_as_the_search_predicts(aria, plate):
    air = in_the_air(plate, 0.12)
    sigma = usual_sigma(air)
    found = try_plate(aria, air, arms=32, sigma=sigma)
    q, reading = planned_joints(aria, air, sigma), reading_named("ball-bar", aria, air)
    exact = np.zeros((len(q), 2))
    searched = linearise_reading(aria, q, reading, target_sigma=exact, names=aria.default_free)
    error = predicted_error(searched, aria, plate_region_poses(aria, air)).position_rms
    tried = np.sqrt((found.predicted[:, 0] ** 2 * found.samples).sum() / found.samples.sum())
    assert np.isclose(tried, error, rtol=0.25)
    assert np.isclose(found.position_rms, error, rtol=0.4)


def test_an_optimised_plate_calibrates_arms_better_than_table_2(run, tmp_path, aria, monkeypatch):
    """Predicted and tried out over the same poses: any place and branch, 60° about Table 2's targets."""
    options = ("plate", "optimise", "table2", "--robot", "aria", "--out", "best.toml", "--json", "best.json")
    status, *_ = run(*options, "--tilt", "40deg", "--spacing", "75mm", "--places", "100")
    assert status == 0
    best = json.loads((tmp_path / "best.json").read_text())
    assert best["schema"] == "workbench.plate-design/1"
    predicted = best["predicted"]
    assert predicted["given_position_rms_mm"] / predicted["position_rms_mm"] > 1.1
    assert min(t["clearance_mm"] for t in best["targets"]) >= 10.0 - 1e-6
    plates = alike([load_plate("table2"), read_plate(tmp_path / "best.toml")])
    monkeypatch.setattr(ErrorSizes, "alone", lambda self: {})  # whatever is to blame
    found = [try_plate(aria, p, arms=250, poses=60, towards=plates[0], seed=2) for p in plates]
    table2, optimised = (each.position_rms for each in found)
    assert table2 / optimised > 1.1


def test_yield_of_table_2(run, tmp_path, monkeypatch):
    monkeypatch.setattr(production_yield, "CHUNK", 50)
    options = ("plate", "yield", "table2", "--robot", "aria", "--arms", "100", "--json", "yield.json")
    status, out, _ = run(
        *options, "--tolerance", "0.05mm,0.05deg", "--joint-noise", "0.002deg", "--poses", "60"
    )
    assert status == 0
    assert "arms that meet it" in out
    found = json.loads((tmp_path / "yield.json").read_text())
    assert found["schema"] == "workbench.plate-yield/1"
    assert found["arms"] == 100
    assert found["share"] == 1.0
    assert set(found["sources"]) == {
        "seat position",
        "seat rotation",
        "joint readings",
        "target position",
        "target rotation",
    }
    assert len(found["cubes"]) > 30


def test_no_arms_are_no_trial(refused):
    refused(["--arms", "got 0"], "plate", "yield", "table2", "--robot", "aria", "--arms", "0", status=64)


def test_virtual_arms_read_what_the_targets_are(monkeypatch, aria, plate, solutions):
    """Sockets and ball-bars were tried with the noise of seats: 0.25 mm where 0.04 mm was predicted."""
    jobs = []

    def tried(job, **_):
        jobs.append(job)
        return yield_of(1, 1)

    monkeypatch.setattr(plate_trial, "try_production", tried)
    fixed = plate.with_joints(np.stack([found[0].q for found in solutions]), plate.branches)
    for kind in (Kind.SEAT, Kind.SOCKET):
        found = try_plate(aria, of_kind(fixed, kind), joint_sigma=1e-4, poses=10)
        assert jobs[-1].errors.seat_position == SIGMAS[str(kind)][0]
        assert f"instrument {1e3 * SIGMAS[str(kind)][0]:g} mm" in found.assumptions
        assert found.assumptions.endswith("joint readings 0.0057°")


def test_the_yield_of_the_present_plate_is_one_sentence(do, worker, first):
    refused = do(TryPlate(0))
    assert refused.part(PlateTrial) is None
    assert refused.page.messages[-1].severity is Severity.ERROR

    worker.submit(TryPlate(4000))
    while worker.session.page.job is None or not worker.session.page.job.text:
        threading.Event().wait(0.01)
    worker.cancel()
    assert worker.wait(120.0)
    assert worker.session.part(PlateTrial) is None

    session = do(TryPlate(20, seed=3))
    tried = session.part(PlateTrial)
    assert tried.plate is first.plate
    assert (tried.arms, tried.unreached) == (20, 0)
    assert (20 * tried.share).is_integer()
    assert f"{100 * tried.share:.1f} % of 20 virtual arms" in tried.text
    assert "the seat position" in tried.text
    assert session.page.messages[-1].text == tried.text

    session = do(ShowCubes(CubeView(field="yield")))
    assert np.array_equal(values(session).numbers, tried.errors, equal_nan=True)
    assert 30 < np.isfinite(tried.errors).sum() <= first.plate.region.cubes
    region = session.plate.region
    session = do(SetRegion(tuple((region.min + 0.05).tolist()), tuple(region.max.tolist()), region.cube))
    assert values(session) is None
    assert do(ShowCubes(CubeView(field="yield"))).page.messages[-1].severity is Severity.ERROR


def test_a_plate_with_a_blocked_target_is_not_tried(do):
    refused = do(SelectTarget(2), ChooseBranch(2, DOWN), TryPlate(20))
    assert mentions(refused.page.messages[-1].text, "target 3")


def test_a_plate_with_a_target_out_of_reach_is_not_tried(aria, plate):
    away = replace(plate, targets=(Target(np.array([2.0, 0.0, 0.0])), *plate.targets))
    with refuses(DataError, target=0):
        planned_joints(aria, away, SIGMAS["seat"])


def test_the_guide_suggests_a_trial_only_where_an_error_is_wanted(first):
    moved = replace(first, history=replace(first.history, done=(UndoStep(first.plate, first.states),)))
    step = next_step(moved)
    assert mentions(step.sentence, "1 mm")
    assert (step.next.command, step.next.tab, step.other.label) == (TryPlate(), Tab.PLATE, "Measure")
    with refuses(OptionError, option="wanted"):
        TryPlate(20).check(replace(moved, choices=replace(moved.choices, wanted=None)))


def yield_of(good, arms):
    """A trial of so many arms of which some were good."""
    few, none = np.arange(arms) < good, np.zeros((0, 2))
    return Yield(
        wanted=None,
        reached=np.ones(arms, bool),
        planned=np.ones(arms, bool),
        position=np.ones(arms),
        rotation=np.ones(arms),
        worst=np.ones((arms, 2)),
        used=np.where(few, 0.5, 2.0),
        cells=np.zeros(0, int),
        predicted=none,
        observed=none,
        samples=np.zeros(0, int),
        sources={},
    )


def test_where_too_few_arms_keep_the_required_error_enough_of_them_keep_a_larger_one(first, monkeypatch):
    found = replace(yield_of(9, 10), wanted=first.choices.wanted, used=np.where(np.arange(10) < 9, 0.5, 1.1))
    monkeypatch.setattr("workbench.extras.production.session.try_plate", lambda *_, **__: found)
    trial = TryPlate(10).compute(first)
    assert (trial.share, trial.used) == (0.9, 1.1)


@pytest.mark.parametrize("name", ["katana450", "so101"])
def test_an_arm_of_five_joints_is_tried_on_the_plate_that_it_begins_on_and_never_in_seats(name):
    """The page offered them seats, and refused these only once the trial had begun."""
    robot = load_robot(name)
    begun = start(robot, default_plate(robot))
    begun = replace(begun, choices=replace(begun.choices, wanted=Wanted(position=5e-3)))
    TryPlate().check(begun)
    assert TryPlate(arms=10).compute(begun).share > 0.5
    with refuses(DataError, found=5):
        TryPlate().check(replace(begun, plate=of_kind(begun.plate, Kind.SEAT)))
