"""Calibrations over time: steps and drifts are found with their joint, chance is not, wherever computed."""

import json
from dataclasses import replace
from datetime import date
from pathlib import Path

import numpy as np
import pytest
from html_page import Page
from refusals import mentions, refuses

import workbench as wb
from workbench.arm.calibration_record import Calibration
from workbench.base.errors import FileError, OptionError
from workbench.extras.service.fleet.history import History, arms_of
from workbench.extras.service.fleet.movement import Law, movements, scatter_factor, threshold
from workbench.extras.service.fleet.page import write_fleet
from workbench.extras.service.fleet.report import fleet_json

DATES = ("2026-01-10", "2026-04-02", "2026-07-01", "2026-10-01")
SIGMA = 2e-5
ARM = wb.load_robot("aria")
WORN = {"arm-04": ("joint3.theta", Law.STEP), "arm-15": ("joint2.theta", Law.DRIFT)}


def write_arm(folder: Path, arm, rng, law=None, name="", size=6e-4):
    """Calibrations of an arm, of which one constant may move."""
    free = arm.default_free
    for k, day in enumerate(DATES):
        values = arm.values(free) + rng.normal(0.0, SIGMA, len(free))
        if law is not None:
            values[free.index(name)] += size * (k >= 2 if law is Law.STEP else k / 3.0)
        message = Calibration(source="x", poses=np.zeros(0, np.uint32), std=dict.fromkeys(free, SIGMA))
        made = arm.with_values(dict(zip(free, values.tolist(), strict=True)))
        replace(made, calibration=message).save(folder / f"{day}.toml")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Sixteen arms, two of them worn."""
    root, rng = tmp_path_factory.mktemp("fleet"), np.random.default_rng(0)
    arm = wb.load_robot("aria")
    for k in range(16):
        place = root / f"arm-{k:02d}"
        place.mkdir()
        name, law = WORN.get(place.name, ("", None))
        write_arm(place, arm, rng, law, name)
    return root


@pytest.fixture(scope="module")
def fleet(folder):
    return wb.compare_fleet(folder, workers=1)


def history(values, std=1.0) -> History:
    """One constant of one arm over the dates."""
    x = np.array(values, float)[:, None]
    return History(
        arm="a",
        dates=tuple(map(date.fromisoformat, DATES[: len(x)])),
        names=("joint2.theta",),
        values=x,
        std=np.full_like(x, std),
        robot=ARM,
    )


# -- laws -----------------------------------------------------------------------------------------


def test_two_dates_differ_by_sigmas_by_hand():
    (found,) = movements(history([1.0, 11.0]), factor=1.0, minimum=5.0)
    assert found.sigmas == pytest.approx(10.0 / np.sqrt(2.0))
    assert (found.shift, found.since, found.rate) == (pytest.approx(10.0), date(2026, 4, 2), 0.0)
    assert not movements(history([1.0, 11.0]), factor=2.0, minimum=5.0)
    assert not movements(history([1.0]), factor=1.0, minimum=0.0)


def test_a_step_is_told_from_a_drift():
    (step,) = movements(history([0.0, 0.1, 20.0, 19.9]), factor=1.0, minimum=5.0)
    assert (step.law, step.since, step.joint) == (Law.STEP, date(2026, 7, 1), 2)
    assert step.shift == pytest.approx(19.9)
    assert step.std == pytest.approx(1.0)  # √(1/2 + 1/2)
    days = history([0, 0, 0, 0]).days
    (drift,) = movements(history(0.1 * days), factor=1.0, minimum=5.0)
    assert drift.law is Law.DRIFT
    assert drift.rate == pytest.approx(0.1)
    assert drift.since == date(2026, 1, 10)


def test_sigma_is_widened_to_what_calibrations_really_scatter():
    rng = np.random.default_rng(0)
    many = [history(rng.normal(0.0, 3.0, 4)) for _ in range(1000)]
    assert scatter_factor(many) == pytest.approx(3.0, rel=0.1)
    assert scatter_factor([history(rng.normal(0.0, 0.1, 4)) for _ in range(100)]) == 1.0
    factor, lowest = scatter_factor(many), threshold(many)
    assert 4.5 < lowest < 4.9  # 0.01 / 3000 tests, both sides
    assert not [m for h in many for m in movements(h, factor=factor, minimum=lowest)]


# -- a fleet --------------------------------------------------------------------------------------


def test_the_worn_arms_are_found_with_their_joint(fleet):
    assert {arm.history.arm: (arm.worst.name, arm.worst.law) for arm in fleet.worn} == WORN
    assert {arm.joint for arm in fleet.worn} == {2, 3}
    step = next(arm for arm in fleet.worn if arm.joint == 3)
    assert step.worst.since == date(2026, 7, 1)
    assert step.again is None
    drift = next(arm for arm in fleet.worn if arm.joint == 2)
    assert 1e-4 < drift.tool < 1e-3
    assert date(2026, 10, 5) < drift.again < date(2027, 2, 1)
    assert mentions(fleet.verdict, "2 of 16")
    assert "arm-15" in fleet._repr_html_()


def test_everywhere_the_same_numbers(folder, fleet):
    wanted = json.dumps(fleet_json(fleet))
    assert json.dumps(fleet_json(wb.compare_fleet(folder, workers=2))) == wanted
    with refuses(OptionError, option="--workers", found=0):
        wb.compare_fleet(folder, workers=0)


@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::ResourceWarning")
def test_a_cluster_gives_the_same_numbers_of_a_fleet(folder, fleet):
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, dashboard_address=":0", processes=False
    ) as cluster:
        found = wb.compare_fleet(folder, scheduler=cluster.scheduler_address)
    assert fleet_json(found) == fleet_json(fleet)


def test_the_page_shows_worn_arms(fleet, tmp_path):
    page = write_fleet(fleet, tmp_path / "out")
    html = Page()
    html.feed(page.read_text())
    message = " ".join(html.text)
    assert "joint3.theta" in message
    assert mentions(message, "14 arms")
    assert {p.name for p in page.parent.iterdir()} == {
        *("fleet.html", "result.json", "fleet.svg", "drift-1.svg", "drift-2.svg")
    }
    assert fleet.plot(name="arm-04")._repr_png_().startswith(b"\x89PNG")
    with refuses(OptionError, option="arm", found="x"):
        fleet.plot("x")


def test_the_picture_has_room_for_every_dot_and_name(fleet):
    """The arm that moved most stands below the upper end, on paper as small as the page's."""
    axes = fleet.plot().axes[0]
    highest = max(np.max(line.get_ydata()) for line in axes.lines)
    assert highest < axes.get_ylim()[1] / 1.2
    assert {text.get_text() for text in axes.texts} == set(WORN)


# -- folders --------------------------------------------------------------------------------------


def test_measurements_are_identified(run, tmp_path):
    """A folder of files is one arm; joint 4 slips between two days."""
    arm = wb.load_robot("aria")
    actual, before = wb.measure_poses(arm, 25, seed=1)
    slipped = actual.with_values({"joint4.theta": actual.values(("joint4.theta",))[0] + 2e-3})
    _, after = wb.measure_poses(arm, 25, seed=2, actual=slipped)
    for day, rows in zip(DATES, (before, after), strict=False):
        wb.write_measurements(rows, tmp_path / f"{day}.csv")
    run("fleet", ".", "--robot", "aria", "--workers", "1", "--json", "found.json")
    (found,) = json.loads(Path("found.json").read_text())["arms"]
    worst = max(found["moved"], key=lambda moved: moved["sigmas"])
    assert (found["worst_joint"], worst["name"]) == (4, "joint4.theta")
    assert worst["shift"] == pytest.approx(2e-3, rel=0.1)


def test_an_arm_that_can_not_be_read_spoils_nothing(run, tmp_path):
    arm, rng = wb.load_robot("aria"), np.random.default_rng(1)
    for name in ("good", "old", "undated", "measured"):
        (tmp_path / "f" / name).mkdir(parents=True)
    write_arm(tmp_path / "f" / "good", arm, rng)
    arm.save(tmp_path / "f" / "old" / "2026-01-01.toml")
    arm.save(tmp_path / "f" / "undated" / "today.toml")
    (tmp_path / "f" / "measured" / "2026-01-01.csv").write_text("q1[rad]\n1\n")
    status, out, err = run("fleet", "f", "--workers", "1", "--json", "r.json")
    assert status == 2
    assert mentions(err, "3 arms")
    result = json.loads(Path("r.json").read_text())
    why = {entry["arm"]: entry["reason"] for entry in result["unread"]}
    assert "no standard errors" in why["old"]
    assert "must begin with its date" in why["undated"]
    assert "--robot" in why["measured"]
    assert [entry["arm"] for entry in result["arms"]] == ["good"]
    assert "Nothing moved in 1 arm" in out


def test_folders_without_calibrations_are_refused(tmp_path):
    with refuses(FileError, path=str(tmp_path)):
        arms_of(tmp_path)
    with refuses(FileError, path=str(tmp_path / "none")):
        arms_of(tmp_path / "none")
    with refuses(OptionError, option="allowed", found=0.0):
        wb.compare_fleet(tmp_path, allowed=0.0)


def test_its_files_are_there_though_nobody_reads(run_unread, folder, tmp_path):
    status, _, err = run_unread("fleet", folder, "--json", "r.json", "--report", "out", "--workers", "1")
    assert status == 0, err
    assert (tmp_path / "r.json").is_file()
    assert (tmp_path / "out" / "fleet.html").is_file()
