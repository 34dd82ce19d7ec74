"""Measuring technologies: what each loses, how well it sees, and what an arm can be found from."""

import numpy as np
import pytest
from checks import any_joints

from workbench import (
    Instrument,
    Motion,
    link_frames,
    measure_poses,
    read_measurements,
    tool_poses,
    write_measurements,
)
from workbench.base import se3
from workbench.data.simulation.instruments import INSTRUMENTS, THREE_MARKERS, Observes
from workbench.data.simulation.readings import SIDES, mounting, station, three_planes
from workbench.data.simulation.simulate import simulate, virtual_arm
from workbench.identification.identify import identify


def test_a_fixed_reflector_is_lost_beyond_45_degrees(katana):
    """Every row that is kept looks at the tracker within 45°, every other one does not."""
    q, tracker = any_joints(katana, 300), INSTRUMENTS["laser-tracker-fixed"]
    rows = simulate(katana, Motion(q), instrument=tracker, rng=np.random.default_rng(1))
    poses, place = tool_poses(katana, Motion(q)), station(katana)
    side = SIDES[mounting(tracker.sight, poses, place)]
    line = place - poses[:, :3, 3]
    cosine = np.einsum("rij,j,ri->r", poses[:, :3, :3], side, line / np.linalg.norm(line, axis=1)[:, None])
    assert np.array_equal(rows.included, cosine >= np.cos(np.deg2rad(45.0)))
    assert 0.05 < rows.included.mean() < 0.5
    assert np.isnan(rows.position[~rows.included]).all()
    assert np.isfinite(rows.position[rows.included]).all()
    assert all("line of sight" in reason for reason in rows.reason[~rows.included])
    assert any("looks along" in note for note in rows.notes)


@pytest.mark.parametrize("samples", [1, 16])
def test_three_markers_give_a_pose_as_well_as_promised(katana, samples):
    """Spread of 3000 fitted poses against the deviations that follow from the markers' places."""
    instrument = Instrument(
        name="o", observes=Observes.RIGID_BODY, sigma_position=1e-5, markers=THREE_MARKERS, samples=samples
    )
    q = np.tile(any_joints(katana, 1), (3000, 1))
    rows = simulate(katana, Motion(q), instrument=instrument, rng=np.random.default_rng(2))
    error = se3.pose_error(se3.pose(rows.rotation, rows.position), tool_poses(katana, Motion(q)))
    position, rotation = instrument.deviations
    assert np.isclose(position, 1e-5 / np.sqrt(3 * samples))  # the mean of three markers
    assert np.isclose(np.sqrt((error[:, :3] ** 2).mean()), position, rtol=0.05)
    assert np.isclose(np.sqrt((error[:, 3:] ** 2).mean()), rotation, rtol=0.05)
    assert np.allclose(rows.sigma[0], [position] * 3 + [rotation] * 3)


def test_a_short_ball_bar_takes_the_nearest_anchor_within_its_stroke(katana):
    anchors = {"A": np.array([0.4, 0.1, 0.3]), "B": np.array([-0.3, 0.1, 0.3])}
    q = any_joints(katana, 200)
    bar, rng = INSTRUMENTS["short-ball-bar"], np.random.default_rng(0)
    rows = simulate(katana, Motion(q), instrument=bar, rng=rng, anchors=anchors)
    tips = tool_poses(katana, Motion(q))[:, :3, 3]
    distances = np.stack([np.linalg.norm(tips - place, axis=1) for place in anchors.values()])
    kept, nearest = rows.included, distances.min(axis=0)
    assert np.array_equal(rows.anchor[kept], np.array(list(anchors))[distances.argmin(axis=0)][kept])
    assert np.allclose(rows.distance[kept], nearest[kept], atol=3e-5)
    assert (rows.distance[kept] <= 0.5).all()
    assert ((nearest[~kept] > 0.4999) | (nearest[~kept] < 0.1001)).all()


def test_probes_touch_what_they_say(katana):
    actual = virtual_arm(katana, rng=np.random.default_rng(0), length=5e-4, angle=5e-3)
    q = any_joints(actual, 60)
    rows = simulate(actual, Motion(q), instrument=INSTRUMENTS["plane-probe"], rng=np.random.default_rng(1))
    tips = tool_poses(actual, Motion(rows.q))[:, :3, 3]
    planes = three_planes(actual)
    off = [planes[n][0] @ tip - planes[n][1] for n, tip in zip(rows.contact, tips, strict=True)]
    kept = rows.included
    assert kept.sum() > 20
    assert np.isclose(np.std(np.array(off)[kept]), 3e-5, rtol=0.4)
    rows = simulate(actual, Motion(q), instrument=INSTRUMENTS["sphere-probe"], rng=np.random.default_rng(1))
    tips = tool_poses(actual, Motion(rows.q))[:, :3, 3]
    for name in np.unique(rows.contact):
        mine = tips[(rows.contact == name) & rows.included]
        assert np.isclose(mine.std(axis=0).mean(), 3e-5, rtol=0.6)


def test_inclinometers_read_where_up_is(katana):
    """A link turned back by its readings, first about x and then about y, has its z axis upright again."""
    q = any_joints(katana, 40)
    rows = simulate(katana, Motion(q), instrument=INSTRUMENTS["inclinometer"], rng=np.random.default_rng(0))
    assert set(rows.tilt) == {1, 2, 3, 4, 5}
    frames, off = link_frames(katana, Motion(q)), []
    for link, tilt in rows.tilt.items():
        back = se3.rpy_to_matrix(np.stack([tilt[:, 0], tilt[:, 1], np.zeros(40)], 1))
        upright = frames[:, link, :3, :3] @ np.swapaxes(back, 1, 2)
        off.append(upright[:, :2, 2])
    assert np.isclose(np.std(off), np.deg2rad(0.001), rtol=0.1)
    assert np.abs(rows.tilt[1]).max() < 1e-4  # the first link turns about the vertical


WITHIN_MM = {"laser-tracker-fixed": 0.06, "photogrammetric-tracker": 0.12, "optotrak": 0.02}
WITHIN_MM |= {"short-ball-bar": 0.02, "sphere-probe": 0.09, "plane-probe": 0.09}


@pytest.mark.parametrize(("name", "within_mm"), WITHIN_MM.items())
def test_an_arm_is_found_with_each(katana, name, within_mm, tmp_path):
    """Measured, written, read and identified: held-out rows are met to about the instrument's noise."""
    _, rows = measure_poses(katana, 160, instrument=name, errors=(5e-3, np.deg2rad(5.0)), seed=2)
    back = read_measurements(write_measurements(rows, tmp_path / "rows.csv"), joints=katana.dof)
    assert np.array_equal(back.included, rows.included)
    run = identify(katana, back, algorithms=("opt2",), held_out=0.2)
    held = run.best.held_out.position_mm
    assert run.nominal.held_out.position_mm.mean > 5.0
    assert held.mean < within_mm


def test_a_bent_arm_touches_with_its_bend(katana):
    """With a compliant joint 2, the tip that gravity bends stands on the ball; the rigid one would not."""
    actual, rows = measure_poses(
        katana, 60, instrument="sphere-probe", effects=("joint-compliance:2:1e-3",), seed=4
    )
    kept = rows.take(rows.included)
    spreads = []
    for arm in (actual, actual.with_effects()):
        tips = tool_poses(arm, Motion.of(kept))[:, :3, 3]
        spreads.append(max(tips[kept.contact == n].std(axis=0).max() for n in np.unique(kept.contact)))
    assert spreads[0] < 6e-5
    assert spreads[1] > 2e-4
