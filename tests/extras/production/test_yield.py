"""Virtual arms on a plate: against predictions, here and on a cluster, as a command and on the page."""

import multiprocessing
import os
import signal
import threading
from dataclasses import replace

import numpy as np
import pytest
from refusals import mentions, refuses
from slow import slow

import workbench as wb
from tests.plate.test_like_with_like import of_kind
from workbench import Requirement, Wanted, load_robot, running
from workbench.base.errors import DataError
from workbench.extras.production import plate_trial
from workbench.extras.production.plate_trial import Trial, Yield, try_plate
from workbench.extras.production.session import TryPlate
from workbench.plate.plate import Kind, Target
from workbench.plate.plate_toml import read_plate
from workbench.plate.region_poses import plate_region_poses
from workbench.plate.tolerances import Production
from workbench.session.live_score import PlateTrial
from workbench.session.next_step import _trial, next_step
from workbench.session.page_state import Severity, Tab
from workbench.session.start import default_plate, start
from workbench.session.state import UndoStep


@pytest.fixture(scope="module")
def fixed(aria, plate):
    """The plate with the branches in which it is scored, and as it is made."""
    found = wb.score(aria, plate).measured
    made = Production(tolerance=(5e-5, 5e-4), play=(1e-5, 1e-3))
    return replace(plate.with_joints(found.q, found.branches), production=made)


@pytest.fixture(scope="module")
def trial(aria, fixed):
    return Trial(
        robot=aria,
        plate=fixed,
        q=np.stack([target.q for target in fixed.targets]),
        evaluation_q=plate_region_poses(aria, fixed, 80),
        made=(1e-3, 5e-3),
        sigmas={},
    )


@pytest.fixture(scope="module", autouse=True)
def few_alone():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(plate_trial, "ALONE", 40)
        yield


@pytest.fixture(scope="module")
def found(aria, fixed):
    return try_plate(aria, fixed, arms=60, poses=80, seed=3)


def rms(found) -> float:
    """Of all position errors [m]."""
    return float(np.sqrt(np.mean((found.errors[..., :3] ** 2).sum(-1))))


def test_arms_are_as_good_as_predicted(aria, fixed, found):
    """On seats, as made and read; on sockets, none of which shows the nominal arm's last joint."""
    poses = plate_region_poses(aria, fixed, 80)
    predicted = wb.score(aria, fixed, evaluation_poses=poses).measured.error
    assert rms(found) == pytest.approx(predicted.position_rms, rel=0.1)
    assert found.json()["orientation_rms_deg"] == pytest.approx(np.rad2deg(predicted.rotation_rms), rel=0.1)
    sockets = of_kind(fixed, Kind.SOCKET)
    tried = try_plate(aria, sockets, arms=25, poses=80)
    expected = wb.score(aria, sockets, evaluation_poses=poses).measured.error.position_rms
    assert rms(tried) < 1.6 * expected


def test_sources_add_up_and_the_worst_is_named(found):
    assert set(found.sources) == {"instrument", "manufacture", "play"}
    alone = [np.mean((errors[..., :3] ** 2).sum(-1)) for errors in found.sources.values()]
    assert np.sqrt(sum(alone)) == pytest.approx(rms(found), rel=0.1)
    assert found.blame == "instrument"
    assert mentions(repr(found), "instrument alone", "the instrument dominates", "±0.05 mm")


def test_arms_pass_eq_3_and_fewer_do_with_more_noise(aria, fixed, found):
    assert found.share == 1.0
    loud = try_plate(aria, fixed, arms=20, sigma=(1e-3, 3e-4), poses=80)
    assert loud.share < 0.5
    worst = np.abs(loud.errors).reshape(20, -1, 2, 3).max((1, 3))
    limits = Requirement().wanted
    assert loud.share == (worst <= [limits.position, limits.rotation]).all(1).mean()
    assert try_plate(aria, fixed, arms=20, poses=80, wanted=Wanted(position=0.05)).share == 1.0


def test_an_arm_is_calibrated_with_the_targets_that_it_reaches(trial):
    targets = list(trial.plate.targets)
    targets[4] = replace(targets[4], xyz=np.array([3.0, 0.0, 0.5]))
    met, errors = replace(trial, plate=replace(trial.plate, targets=tuple(targets))).judged_arm(
        np.random.SeedSequence(7)
    )
    assert met.tolist() == [k != 4 for k in range(10)]
    assert np.abs(errors).max() < 1e-7
    three = {"met": np.array([met, ~met | True, met]), "errors": np.zeros((3, 1, 6))}
    part = Yield(**three, wanted=Wanted(position=1e-3), sources={}, assumptions="")
    assert part.unreached == 2
    assert part.interval == pytest.approx((0.292, 1.0), abs=1e-3)
    assert mentions(part.text, "2 of them")


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::ResourceWarning")
def test_a_cluster_gives_the_same_numbers_and_bears_the_loss_of_a_worker(aria, fixed, found, monkeypatch):
    distributed = pytest.importorskip("distributed")
    multiprocessing.set_forkserver_preload(["distributed", Trial.__module__])  # once for all workers
    monkeypatch.setattr("distributed.utils._forkserver_preload_set", True)
    monkeypatch.setattr(plate_trial, "PIECE", 5)
    forked = {"distributed.worker.multiprocessing-method": "forkserver"}
    with (
        pytest.importorskip("dask").config.set(forked),
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=":0", memory_limit=None
        ) as cluster,
    ):
        killed = []

        def kill_one(share, text):
            if not killed and text.startswith("trying") and share > 0.1:
                pid = next(iter(cluster.workers.values())).process.process.pid
                os.kill(pid, signal.SIGKILL)
                killed.append(pid)

        with running(kill_one):
            same = try_plate(aria, fixed, arms=60, poses=80, seed=3, scheduler=cluster.scheduler_address)
        assert killed
    assert np.array_equal(same.errors, found.errors)
    assert all(np.array_equal(same.sources[name], found.sources[name]) for name in found.sources)


def test_what_can_not_be_tried(aria, plate):
    with refuses(DataError, found=5):
        try_plate(load_robot("katana450"), plate)
    away = replace(plate, targets=(Target(np.array([2.0, 0.0, 0.0])), *plate.targets))
    with refuses(DataError, "target 1 is out of reach"):
        try_plate(aria, away)
    with refuses(DataError, column="target"):
        try_plate(aria, replace(plate, targets=()))


@pytest.mark.slow
def test_an_optimised_plate_calibrates_arms_better_than_table_2(told, tmp_path, aria, monkeypatch):
    """Predicted and tried out over the same poses: any place and branch, 60° about Table 2's targets."""
    options = ("plate", "optimise", "table2", "--robot", "aria", "--out", "best.toml")
    best, _ = told(*options, "--tilt", "40deg", "--spacing", "75mm", "--places", "100")
    assert best["schema"] == "workbench.plate-design/1"
    predicted = best["predicted"]
    assert predicted["given_position_rms_mm"] / predicted["position_rms_mm"] > 1.1
    assert min(t["clearance_mm"] for t in best["targets"]) >= 10.0 - 1e-6
    best_plate = read_plate(tmp_path / "best.toml")
    plates = [
        replace(each, production=best_plate.production) for each in (wb.load_plate("table2"), best_plate)
    ]
    monkeypatch.setattr(Trial, "sources", ())  # whatever is to blame
    found = [try_plate(aria, p, arms=150, poses=60, towards=plates[0], seed=2) for p in plates]
    table2, optimised = (rms(each) for each in found)
    assert table2 / optimised > 1.1


def test_yield_of_table_2(told, refused):
    how = ("--tolerance", "0.05mm,0.05deg", "--joint-noise", "0.002deg", "--poses", "60")
    found, out = told("plate", "yield", "table2", "--robot", "aria", "--arms", "60", *how)
    assert mentions(out, "100.0 % of 60 virtual arms meet")
    assert (found["schema"], found["arms"], found["share"]) == ("workbench.plate-yield/1", 60, 1.0)
    assert set(found["sources"]) == {"instrument", "manufacture", "joint readings"}
    refused(["arms", "got 0"], "plate", "yield", "table2", "--robot", "aria", "--arms", "0", status=64)


def test_the_yield_of_the_present_plate_is_one_sentence(do, worker, first):
    refused = do(TryPlate(0))
    assert refused.part(PlateTrial) is None
    assert refused.page.messages[-1].severity is Severity.ERROR

    worker.submit(TryPlate(2000))
    while worker.session.page.job is None or not worker.session.page.job.text:
        threading.Event().wait(0.01)
    worker.cancel()
    assert worker.wait(120.0)
    assert worker.session.part(PlateTrial) is None

    session = do(TryPlate(20, seed=3))
    tried = session.part(PlateTrial)
    assert tried.plate is first.plate
    assert (tried.arms, tried.unreached) == (20, 0)
    assert f"{100 * tried.share:.1f} % of 20 virtual arms" in tried.text
    assert session.page.messages[-1].text == tried.text


def test_the_guide_suggests_a_trial_where_an_error_is_wanted_and_one_tells_else_what_most_arms_keep(first):
    moved = replace(first, history=replace(first.history, done=(UndoStep.of(first),)))
    step = next_step(moved)
    assert mentions(step.sentence, "1 mm")
    assert (step.next.command, step.next.tab, step.other.label) == (TryPlate(), Tab.PLATE, "Measure")
    assert _trial().command == TryPlate()
    trial = TryPlate(20).compute(replace(moved, choices=replace(moved.choices, wanted=None)))
    assert f"95 % of 20 virtual arms stay within {trial.used:.3g} mm" in trial.text


@pytest.mark.parametrize("name", [slow("katana450"), slow("so101")])
def test_an_arm_of_five_joints_is_tried_on_the_plate_that_it_begins_on_and_never_in_seats(name):
    """The page offered them seats, and refused these only once the trial had begun."""
    robot = load_robot(name)
    begun = start(robot, default_plate(robot))
    begun = replace(begun, choices=replace(begun.choices, wanted=Wanted(position=5e-3)))
    TryPlate().check(begun)
    assert TryPlate(arms=4).compute(begun).share > 0.5
    with refuses(DataError, found=5):
        TryPlate().check(replace(begun, plate=of_kind(begun.plate, Kind.SEAT)))
