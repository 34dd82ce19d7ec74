"""A diagnosis for people and scripts: plain data, tables, page and pictures."""

import json
import pickle
import threading
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares

from workbench import Motion, diagnose, load_robot, measure_poses, tool_poses
from workbench.arm.effects.local_joint_error import LocalJointError
from workbench.base.progress import Cancelled, cancelled, running
from workbench.diagnosis.report.document import error_units
from workbench.diagnosis.report.results_json import diagnosis_json
from workbench.identification.problem import Problem

HOSTILE = "<script>alert('x')</script> & \"quoted\" $\\alpha$"
WRONG, KEPT_OUT = 13, 3
DENT = LocalJointError(
    (3,), (0.0, 0.0, 1e-3, 2e-3, 0.0, 0.0, -1e-3, 0.0, 0.0), knots=tuple(np.linspace(-6.3, 6.3, 9).tolist())
)


@pytest.fixture(scope="module")
def diagnosed():
    """Compliance of joint 2 and a nameless error of joint 4; one row off, one excluded; a hostile name."""
    robot = replace(load_robot("aria"), name=HOSTILE)
    _, rows = measure_poses(robot, 120, effects=("joint-compliance:2:5e-5", DENT), seed=1)
    position, exclude = rows.position.copy(), np.zeros(len(rows), bool)
    position[WRONG] += 2e-3
    exclude[KEPT_OUT] = True
    reason = np.array(["<b>probe</b>" if e else "" for e in exclude])
    rows = replace(rows, position=position, exclude=exclude, reason=reason, sigma=None, source="a<i>b.csv")
    return diagnose(robot, rows)


@pytest.fixture(scope="module")
def nothing():
    """Points of an arm without effects, none held out."""
    _, rows = measure_poses(load_robot("aria"), 40, instrument="laser-tracker", seed=2)
    return diagnose(load_robot("aria"), rows, held_out=0.0)


# -- plain data -----------------------------------------------------------------------------------


def check_errors(found, *, turned=True):
    assert found.keys() == {"position_mm", "orientation_deg"}
    assert found["position_mm"].keys() == {"mean", "rms", "max", "median"}
    assert (found["orientation_deg"] is not None) == turned


def test_the_plain_data_are_those_of_the_schema(diagnosed):
    found = json.loads(json.dumps(diagnosis_json(diagnosed), allow_nan=False))
    assert found["schema"] == "workbench.diagnosis/1"
    assert found["robot"] == HOSTILE
    rows = found["measurements"]
    assert rows["outliers"] == [WRONG]
    assert rows["used"] + rows["held_out"] + len(rows["outliers"]) == 119
    assert rows["excluded"] == [{"row": KEPT_OUT, "reason": "<b>probe</b>"}]
    for part in ("nominal", "before", "after"):
        for errors in found[part].values():
            check_errors(errors)
    assert found["verdict"] == "explained"
    assert found["noise"]["position_mm"] > 0.0
    assert np.shape(found["measure_next"])[1] == 6


def test_the_effects_are_those_that_were_hidden(diagnosed):
    found = {e["name"]: e for e in diagnosis_json(diagnosed)["effects"]}
    assert found.keys() == {"joint-compliance", "local-joint-error"}
    soft = found["joint-compliance"]
    assert soft["joints"] == [2]
    assert 0.0 <= soft["p_value"] < 1e-6
    (size,) = soft["coefficients"]
    assert (size["name"], size["unit"]) == ("joint2.compliance", "rad/(N*m)")
    assert abs(size["value"] - 5e-5) < 4.0 * size["std"]
    local = found["local-joint-error"]
    assert local["joints"] == [4]
    assert len(local["coefficients"]) == len(local["knots"])
    assert all(
        {"name", "joints", "after_held_out_mm"} <= r.keys() for e in found.values() for r in e["alternatives"]
    )


def test_the_error_without_an_effect_is_that_of_a_fit_without_it(diagnosed):
    """The arm with the other effect alone: fitted here by itself, and evaluated on the held-out rows."""
    after, fit, held = diagnosed.after.held_out.position_mm.mean, diagnosed.after_fit, diagnosed.held_out_data
    for found in diagnosed.effects:
        (other,) = [e for e in fit.calibrated.effects if e.names != found.effect.names]
        robot = diagnosed.nominal_robot.with_effects(other)
        known = {"frames": fit.problem.frames, "noise": fit.problem.typical_noise}
        problem = Problem.build(robot, fit.problem.data, effects=other.names, **known)
        start, slope = problem.at(fit.problem.named(fit.x)), lambda x, at=problem.evaluate: at(x).jacobian
        arm = problem.robot_at(least_squares(problem.residual, start, slope).x)
        seen = tool_poses(arm, Motion.of(held))[:, :3, 3]
        without = 1e3 * np.linalg.norm(seen - held.position, axis=1).mean()
        assert found.before.position_mm.mean == pytest.approx(without, rel=0.2)
        assert found.before.position_mm.mean > 1.2 * after


def test_orientations_are_judged_wherever_positions_are(diagnosed, nothing):
    """The map, each effect and each alternative have both; the message states both, before and after."""
    found = diagnosis_json(diagnosed)
    assert found["map"]["after_held_out_deg"] == found["after"]["held_out"]["orientation_deg"]["mean"]
    judged = [found["map"], *found["effects"], *(r for e in found["effects"] for r in e["alternatives"])]
    assert all(np.isfinite(part["after_held_out_deg"]) for part in judged)
    assert all(errors.text("mean") in diagnosed.message for errors in diagnosed.error)
    assert [unit for _, unit in error_units(diagnosed)] == ["mm", "°"]
    assert [unit for _, unit in error_units(nothing)] == ["mm"]


def test_what_was_not_measured_is_null(nothing):
    found = diagnosis_json(nothing)
    assert found["effects"] == []
    assert found["verdict"] == "no effect found"
    assert found["noise"]["orientation_deg"] is None
    assert found["after"]["held_out"] is None
    check_errors(found["after"]["train"], turned=False)


# -- cancelled ------------------------------------------------------------------------------------


def cancelled_at(after, robot, rows):
    """A diagnosis that is cancelled once this share is done."""
    done = [0.0]
    with running(lambda share, text: done.append(share), lambda: done[-1] >= after), pytest.raises(Cancelled):
        diagnose(robot, rows)


def test_a_cancelled_diagnosis_leaves_nothing_behind(aria):
    """Neither in the arm and the rows nor in this thread: the next one gives the same, to the last digit."""
    compliant = aria, measure_poses(aria, 40, effects=("joint-compliance:2:5e-5",), seed=1)[1]

    def answer():
        return {key: value for key, value in diagnosis_json(diagnose(*compliant)).items() if key != "seconds"}

    before, given, threads = answer(), pickle.dumps(compliant), threading.active_count()
    for after in (0.1, 0.6):
        cancelled_at(after, *compliant)
        assert not cancelled()
        assert threading.active_count() == threads
        assert pickle.dumps(compliant) == given
    assert answer() == before


def test_markers_that_move_as_one_body_are_its_pose():
    """A tracker's own reflectors were called computed, and nothing was looked for."""
    _, rows = measure_poses(load_robot("aria"), 100, effects=("joint-compliance:2:5e-5",), seed=1)
    body = np.array([[0.07, 0.0, 0.1], [-0.07, 0.02, 0.1], [0.0, 0.09, 0.12]])
    markers = rows.position[:, None] + np.einsum("rij,mj->rmi", rows.rotation, body)
    markers += np.random.default_rng(0).normal(0.0, 3e-6, markers.shape)
    markers[7, 1] = np.nan
    found = diagnose("aria", replace(rows, position=None, rotation=None, sigma=None, markers=markers))
    assert "read as its pose" in " ".join(found.notes)
    assert dict(found.excluded)[7] == "shows too few markers"
    assert [a.effect.name for a in found.effects] == ["joint-compliance"]
    assert found.after.held_out.orientation_deg.mean < 0.5 * found.before.held_out.orientation_deg.mean
