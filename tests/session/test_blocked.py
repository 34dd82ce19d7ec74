"""Targets at which the arm would run into the plate can't be measured: they count nowhere."""

from dataclasses import replace

import numpy as np

import workbench as wb
from workbench.plate.collision import hits
from workbench.plate.plate import AUTO
from workbench.plate.simulated_measurement import measure_plate
from workbench.session.commands.drag import GrabTarget, MoveTarget, SelectTarget
from workbench.session.commands.edit import ChooseBranch
from workbench.session.commands.undo import RestoreBest, Undo
from workbench.session.target_steps import with_targets

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


def test_a_branch_left_to_the_program_leaves_what_blocks_it(do):
    do(SelectTarget(2), ChooseBranch(2, DOWN))
    freed = do(ChooseBranch(2, AUTO))
    assert freed.states[2].measurable
    assert freed.score.measurable == 10


def test_a_drag_sees_at_every_step_whether_the_arm_is_blocked(do, first):
    target = first.plate.targets[2]
    x, y, z = target.xyz.tolist()
    do(SelectTarget(2), ChooseBranch(2, DOWN), GrabTarget(2, client=3))
    held = do(MoveTarget(2, (x + 0.002, y, z), tuple(target.rpy.tolist()), client=3))
    assert held.drag is not None
    assert held.states[2].reached
    assert held.states[2].hit == hits(held.robot, held.plate, [2], held.states[2].q[None])[0] != ""
    assert held.score.measurable == 9


def test_the_score_of_a_plate_leaves_blocked_targets_out(first):
    named = replace(first.plate.targets[2], branch=DOWN)
    plate = replace(first.plate, targets=(*first.plate.targets[:2], named, *first.plate.targets[3:]))
    found = wb.score(first.robot, plate)
    assert [bool(hit) for hit in found.can.hits] == [i == 2 for i in range(10)]
    assert np.isnan(found.measured.per_target[2])
    assert np.isfinite(np.delete(found.measured.per_target, 2)).all()
    q = found.measured.q[[0, 1, *range(3, 10)]]
    assert not any(hits(first.robot, plate, [0, 1, *range(3, 10)], q))


def test_states_known_before_are_not_looked_at_again_while_dragging(first):
    again = with_targets(first, first.plate, first.states)
    assert again.states is first.states


def test_what_stands_in_the_way_is_said_of_a_virtual_arm_too(first):
    """Rows of blocked targets were measured like any other."""
    _, rows = measure_plate(first.robot, first.plate, branch=DOWN, actual=first.robot)
    assert np.flatnonzero(~rows.exclude).tolist() == [8]
    assert rows.reason[0] == "link 2 would run into the plate"
    assert np.isnan(rows.position[0]).all()
    for branch in ("designed", "mixed"):  # among what is clear
        _, rows = measure_plate(first.robot, first.plate, branch=branch)
        assert rows.exclude is None
