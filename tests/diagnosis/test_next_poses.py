"""Poses to measure next."""

from dataclasses import replace

import numpy as np
import pytest
from arms import TUNING, make
from generator import move, turn

from workbench.arm.built_in_arms import load_robot
from workbench.arm.effects.local_joint_error import LocalJointError
from workbench.diagnosis.diagnose import diagnose
from workbench.diagnosis.next_poses import (
    PRIOR_INFORMATION,
    _covariance,
    _DescribedUnknown,
    _reason,
    next_poses,
)
from workbench.diagnosis.report.results_json import diagnosis_json
from workbench.diagnosis.report.table import diagnosis_tables
from workbench.identification.frames import Sessions
from workbench.identification.problem import Noise, Problem
from workbench.plate.simulated_measurement import measure_poses
from workbench.report.result_display import as_text

ELSEWHERE = move("x", 0.2) @ turn("z", 0.5)


def test_sessions_with_frames_of_their_own():
    """Poses asked for belong to one session, and say nothing of the frames of the others."""
    case = make("compliance", TUNING[2], "aria", free_frames=True)
    data = case.data
    late = np.arange(len(data)) >= len(data) // 2
    position, rotation = data.position.copy(), data.rotation.copy()
    position[late] = position[late] @ ELSEWHERE[:3, :3].T + ELSEWHERE[:3, 3]
    rotation[late] = ELSEWHERE[:3, :3] @ rotation[late]
    session = np.where(late, "noon", "morning")
    moved = replace(data, position=position, rotation=rotation, session=session)
    found = diagnose(case.robot, moved, frames=Sessions.PER_SESSION)
    assert [(e.effect.name, e.effect.joints) for e in found.effects] == [
        ("joint-compliance", case.truth[0].joints)
    ]
    assert any("noon" in name for name in found.after_fit.problem.names)
    assert found.measure_next.shape == (5, 6)
    assert (found.measure_next >= data.q.min(0)).all()
    assert (found.measure_next <= data.q.max(0)).all()


def test_variances_of_nearly_open_directions_are_above_zero():
    """As a difference of large numbers they were not, and the reason of a pose was chosen among NaN."""
    rng = np.random.default_rng(0)
    for _ in range(200):
        rows = (
            rng.standard_normal((30, 12))
            @ np.diag(np.logspace(0.0, -7.0, 12))
            @ rng.standard_normal((12, 12))
        )
        scaled = rows / np.linalg.norm(rows, axis=0)
        assert (np.diag(_covariance(scaled.T @ scaled + PRIOR_INFORMATION * np.eye(12))) > 0.0).all()


def test_a_gap_between_the_rows_that_nothing_shows_is_asked_for():
    """Splines of one joint whose middle knots the rows show by 1e-10 and a new pose by 1."""
    robot = load_robot("ur5")
    _, data = measure_poses(robot, 200, seed=4)
    q = data.q.copy()
    q[:, 1] = np.where(np.arange(200) % 2, -3.0, 0.0) + 0.02 * np.sin(np.arange(200))
    effect = LocalJointError((1,), (0.0,) * 40, knots=tuple(np.linspace(-3.1, 0.1, 40).tolist()))
    problem = Problem.build(robot, replace(data, q=q), free=robot.joint_offsets, noise=Noise(1e-4, 1e-4))
    poses, reasons = next_poses(problem, problem.start, [effect], rng=np.random.default_rng(0))
    assert len(poses) == len(reasons) == 5
    assert ((poses[:, 1] > -2.9) & (poses[:, 1] < -0.1)).all()
    assert all(0.0 < reason.shrinks_to < 1.0 and np.isfinite(reason.gain) for reason in reasons)


def test_a_pose_is_not_praised_for_what_stays_unknown():
    """Of a UR5 it was said that a pose makes an error of joint 3 observable to ± 7 200 mrad."""
    unknowns = [_DescribedUnknown(name, name, "rad") for name in ("zero", "knot", "scale")]
    before, after = np.diag([4.0, 1e8, 9.0]), np.diag([4.0, 2.5e7, 4.0])
    stated = _reason(1.0, before, after, known=1, scale=np.ones(3), unknowns=unknowns)
    assert stated.shrinks_to == pytest.approx(2.0 / 3.0)
    stated = _reason(1.0, before, np.diag([4.0, 1.0, 4.0]), known=1, scale=np.ones(3), unknowns=unknowns)
    assert stated.shrinks_to == pytest.approx(1e-4)


@pytest.fixture(scope="module")
def case():
    return make("compliance", TUNING[2], "aria")


@pytest.fixture(scope="module")
def whole(case):
    return diagnose(case.robot, case.data)


def failing(*_, **__):
    raise np.linalg.LinAlgError("Singular matrix")


@pytest.mark.parametrize(
    "adviser",
    [
        f"workbench.diagnosis.{name}"
        for name in (
            "diagnose.next_poses",
            "saved_model.undetectable",
            "alternative_models.rivals_of",
            "alternative_models.ranked",
        )
    ],
)
def test_an_adviser_that_fails_costs_a_warning_and_nothing_else(adviser, case, whole, monkeypatch):
    monkeypatch.setattr(adviser, failing)
    found = diagnose(case.robot, case.data)
    assert [a.effect for a in found.effects] == [a.effect for a in whole.effects]
    assert found.final_fit.x.tolist() == whole.final_fit.x.tolist()
    assert not whole.warnings
    assert "Singular matrix" in found.warnings[0]
    assert diagnosis_json(found)["warnings"] == list(found.warnings)
    for shown in (repr(found), as_text(diagnosis_tables(found))):
        assert found.warnings[0] in " ".join(shown.split())
