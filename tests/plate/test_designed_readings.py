"""Plates that are read by a ball-bar, and sockets in a posture that was designed."""

from dataclasses import replace

import numpy as np

from workbench.plate.collision import hits
from workbench.plate.optimiser.candidates import Setting
from workbench.plate.optimiser.capsules import capsule_arm
from workbench.plate.optimiser.constraints import Constraints
from workbench.plate.plate import Kind
from workbench.plate.target_branches import choose_branches, plate_solutions
from workbench.plate.target_readings import reading_named
from workbench.plate.tolerances import EXACT


def test_the_search_keeps_clear_of_a_ball_bar_s_posts(aria, plate):
    """A target called blocked by the post of an anchor is never a candidate."""
    reading = reading_named("ball-bar", aria, plate)
    setting = Setting(
        robot=aria,
        plate=plate,
        arm=capsule_arm(aria),
        constraints=Constraints(),
        reading=reading,
        production=EXACT,
        names=aria.default_free,
        scales=np.ones(len(aria.default_free)),
    )
    q = np.random.default_rng(2).uniform(*aria.limits.T, (3000, aria.dof))
    met = np.array(
        [" anchor " in hit for hit in hits(aria, replace(plate, anchors=reading.anchors), [0] * len(q), q)]
    )
    assert met.sum() > 3
    assert (setting.around(setting.arm.placements(q[met]))[:, 2] < 1e-6).all()


def test_a_designed_socket_is_measured_at_its_own_joint_angles(aria, plate):
    """Such plates could not be scored: a free orientation has other branches than the designed one."""
    q = choose_branches(aria, plate, plate_solutions(aria, plate), goal="O1", rng=np.random.default_rng(0))
    there = plate.with_joints(q.q, q.branches)
    sockets = replace(there, targets=tuple(replace(t, kind=Kind.SOCKET) for t in there.targets))
    solutions = plate_solutions(aria, sockets)
    assert np.allclose([found[0].q for found in solutions], q.q, atol=1e-6)
    assert tuple(found[0].name for found in solutions) == q.branches
