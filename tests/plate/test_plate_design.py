"""Readings of a plate's targets against finite differences; plates of every kind designed and tried."""

from dataclasses import replace

import numpy as np
import pytest
from slow import slow

import workbench as wb
from workbench.arm.kinematics.skeleton import height_above_floor
from workbench.base import se3
from workbench.plate import target_readings as readings
from workbench.plate.design import NARROW
from workbench.plate.plate import Kind
from workbench.plate.plate_toml import read_plate
from workbench.session.start import default_circle

STEP = 1e-6
READERS = {
    "seat": lambda pose, nominal, anchors: se3.pose_error(pose, nominal),
    "socket": lambda pose, nominal, anchors: pose[:3, 3],
    "point": lambda pose, nominal, anchors: pose[:3, 3],
    "ball-bar": lambda pose, nominal, anchors: np.linalg.norm(pose[:3, 3] - anchors, axis=1),
}


def moved(pose, twist):
    turned = se3.rotvec_to_matrix(twist[3:]) @ pose[:3, :3]
    return se3.pose(turned, pose[:3, 3] + twist[:3])


@pytest.mark.parametrize("name", list(READERS))
def test_a_reading_changes_as_the_tool_moves(name, aria, plate):
    reading, anchors = readings.reading_named(name, aria, plate), readings.anchors_of(aria, plate)
    nominal = plate.poses[3]
    read = READERS[name]
    expected = [
        (read(moved(nominal, STEP * e), nominal, anchors) - read(moved(nominal, -STEP * e), nominal, anchors))
        / (2.0 * STEP)
        for e in np.eye(6)
    ]
    found = reading.by_twist(nominal[None])
    assert np.allclose(found[0], np.stack(expected, -1), atol=1e-6)


def test_distances_change_as_their_anchors_move(aria, plate):
    nominal, anchors = plate.poses[3], readings.anchors_of(aria, plate)
    columns = []
    for k in range(9):
        off = np.zeros(9)
        off[k] = STEP
        gaps = [nominal[:3, 3] - anchors - s * off.reshape(3, 3) for s in (1, -1)]
        more, less = (np.linalg.norm(gap, axis=1) for gap in gaps)
        columns.append((more - less) / (2.0 * STEP))
    reading = readings.reading_named("ball-bar", aria, plate)
    found, sigma = reading.rows(nominal[None], np.zeros((1, 6, 0)), np.zeros((1, 2)))
    assert np.allclose(found[0] * sigma[0, :, None], np.stack(columns, -1), atol=1e-6)


def test_six_contacts_locate_a_cube_in_all_six_directions(aria, plate):
    """Each contact moves along its normal as the cube's point there does; together they hold the pose."""
    rows = readings.contact_rows()
    assert np.linalg.matrix_rank(rows) == 6
    assert sorted(np.abs(rows[:, :3]).argmax(1)) == [0, 0, 1, 2, 2, 2]
    twist = np.array([1e-5, -2e-5, 3e-5, 1e-4, 2e-4, -1e-4])
    pose = moved(np.eye(4), twist)
    points = np.array([[0.015, 0, 0], [-0.015, 0.015, 0], [-0.015, -0.015, 0]])
    assert np.allclose(rows[:3] @ twist, (se3.apply(pose, points) - points)[:, 2], atol=1e-8)
    seat = readings.reading_named("contacts", aria, plate).by_twist(plate.poses[:1])[0]
    turned = np.kron(np.eye(2), plate.poses[0, :3, :3].T)
    assert np.allclose(seat, rows @ turned, atol=1e-12)


def test_visits_lower_the_noise_but_not_the_target_s_own_error(aria, plate):
    q = np.zeros((1, 6)) + 0.4
    poses, twists = wb.identification_jacobian(aria, wb.Motion(q))
    one, many = (readings.reading_named("seat", aria, plate, visits=n) for n in (1, 10**9))
    made = np.array([[5e-5, 1e-4]])
    rows, _ = many.rows(poses, twists, made)
    assert np.allclose(rows[0, :3], twists[0, :3] / 5e-5, rtol=1e-6)
    rows, _ = one.rows(poses, twists, made)
    assert np.allclose(rows[0, 3:], twists[0, 3:] / np.hypot(np.deg2rad(0.02), 1e-4))


def test_unknown_anchors_are_solved_with_the_arm(aria, plate):
    """Covariance of the arm's constants from the whole linear problem, the anchors as unknowns too."""
    reading = readings.reading_named("ball-bar", aria, plate)
    q = np.random.default_rng(0).uniform(-1.0, 1.0, (14, 6))
    names = aria.default_free[4:12]
    found = readings.linearise_reading(aria, q, reading, target_sigma=np.zeros((14, 2)), names=names)
    poses, twists = wb.identification_jacobian(aria, wb.Motion(q), names)
    rows = reading.rows(poses, twists, np.zeros((14, 2)))[0].reshape(-1, 8 + 9)
    prior = np.diag(np.concatenate([np.zeros(8), np.full(9, 5e-5**-2.0)]))
    whole = np.linalg.inv(rows.T @ rows + prior)[:8, :8]
    assert np.allclose(found.covariance, whole, rtol=1e-6)


@pytest.mark.parametrize(
    "name", [slow(n) if n in ("contacts", "point", "socket") else n for n in readings.READINGS if n != "seat"]
)
def test_plates_of_every_kind_are_designed(name, aria, plate, tmp_path):
    heights, places = ((0.05, 0.35), 40) if name == "ball-bar" else ((0.04, 0.12), 20)
    request = wb.DesignRequest(number=9, places=places, starts=1, blocks=wb.Blocks(heights=heights))
    design = wb.optimise_plate(aria, replace(plate, targets=()), request=request, reading=name, seed=1)
    assert np.isfinite(design.cost)
    assert len(design.plate) == 9
    assert design.clearance.min() >= 0.01 - 1e-9
    kinds = {t.kind for t in design.plate.targets}
    assert kinds == {{"socket": Kind.SOCKET, "contacts": Kind.SEAT}.get(name, Kind.POINT)}
    again = read_plate(wb.write_plate(design.plate, tmp_path / "plate.toml"))
    q = np.stack([t.q for t in again.targets])
    assert np.allclose(wb.tool_poses(aria, wb.Motion(q)), design.plate.poses, atol=1e-6)


def test_blocks_for_balls_face_an_arm_of_five_joints():
    """No search had a solution: the arm was asked for the direction of every random block."""
    katana = wb.load_robot("katana450")
    plate = default_circle(katana)
    request = wb.DesignRequest(
        number=5, places=30, starts=1, constraints=replace(NARROW, floor=-height_above_floor(katana))
    )
    found = wb.optimise_plate(katana, plate, request=request).plate
    assert {target.kind for target in found.targets} == {Kind.SOCKET}
    at = se3.inverse(katana.base.pose) @ wb.tool_poses(
        katana, wb.Motion(np.stack([t.q for t in found.targets]))
    )
    assert np.allclose(at[:, :3, 3], found.poses[:, :3, 3], atol=1e-6)
    assert np.allclose(at[:, :3, 2], found.poses[:, :3, 2], atol=1e-6)
