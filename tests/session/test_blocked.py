"""Targets at which the arm would run into the plate can't be measured: they count nowhere."""

from dataclasses import replace

import numpy as np

import workbench as wb
from workbench.arm.kinematics.skeleton import body_frames
from workbench.plate.collision import hits
from workbench.plate.simulated_measurement import measure_plate
from workbench.session.commands.drag import SelectTarget
from workbench.session.commands.edit import ChooseBranch
from workbench.session.commands.undo import RestoreBest, Undo
from workbench.session.target_postures import clearance

DOWN = "shoulder right, elbow down, wrist flip"


def test_a_blocked_target_counts_neither_in_the_indices_nor_as_the_best_plate(do, first):
    blocked = do(SelectTarget(2), ChooseBranch(2, DOWN))
    state = blocked.states[2]
    assert state.reached
    assert not state.measurable
    assert "would run into the plate" in state.obstacle
    assert blocked.score.measurable == 9
    assert np.isnan(blocked.score.per_target[2])
    assert blocked.score.position > first.score.position
    assert do(Undo(), RestoreBest()).plate is first.plate


def test_the_score_of_a_plate_leaves_blocked_targets_out(first):
    named = replace(first.plate.targets[2], branch=DOWN)
    plate = replace(first.plate, targets=(*first.plate.targets[:2], named, *first.plate.targets[3:]))
    found = wb.score(first.robot, plate)
    assert [bool(hit) for hit in found.can.hits] == [i == 2 for i in range(10)]
    assert np.isnan(found.measured.per_target[2])
    assert np.isfinite(np.delete(found.measured.per_target, 2)).all()
    q = found.measured.q[[0, 1, *range(3, 10)]]
    assert not any(hits(first.robot, plate, [0, 1, *range(3, 10)], q))
    elbow = first.states[7].q
    assert clearance(first.robot, plate, elbow) == "link 2 clears the plate by 7 mm"
    moved = (replace(plate, xyz=plate.xyz - [0.0, step, 0.0]) for step in (0.006, 0.008))
    assert [bool(hits(first.robot, one, [7], elbow[None])[0]) for one in moved] == [False, True]


def test_the_table_is_in_the_way_of_elbows_below_it(first):
    robot, away = first.robot, first.plate.moved(np.array([0.0, 0.0, 5.0]), np.zeros(3))
    q = np.random.default_rng(0).uniform(*robot.limits.T, (40, robot.dof))
    lowest, found = body_frames(robot, q)[:, 2:-1, 2, 3].min(1), np.array(hits(robot, away, [0] * 40, q))
    assert {hit.partition(" would ")[2] for hit in found[lowest < 0.0]} == {"run into the table"}
    assert "" in found[lowest > 0.0]
    deep = first.plate.moved(np.array([0.0, 0.0, -5.0]), np.zeros(3))  # beside a pedestal
    assert not any(hits(robot, deep, [0] * 40, q))


def test_what_stands_in_the_way_is_said_of_a_virtual_arm_too(first):
    """Rows of blocked targets were measured like any other."""
    down = tuple(replace(target, branch=DOWN) for target in first.plate.targets)
    _, rows = measure_plate(first.robot, replace(first.plate, targets=down), actual=first.robot)
    assert np.flatnonzero(~rows.exclude).tolist() == [8]
    assert rows.reason[0] == "link 2 would run into the plate"
    assert np.isnan(rows.position[0]).all()
    _, rows = measure_plate(first.robot, first.plate)  # among what is clear
    assert rows.exclude is None
